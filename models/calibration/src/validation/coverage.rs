//! Coverage of an interval: the fraction of specimens inside, with its binomial uncertainty.

/// Number of specimens inside an interval.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Coverage {
    /// Specimens inside the interval.
    pub inside: usize,
    /// All specimens.
    pub total: usize,
}

impl Coverage {
    /// Counts the values inside an interval, ends included.
    pub fn of(values: &[f64], [low, high]: [f64; 2]) -> Self {
        let inside = values.iter().filter(|y| (low..=high).contains(*y)).count();
        Self { inside, total: values.len() }
    }

    /// Fraction of the specimens inside.
    pub fn fraction(&self) -> f64 {
        self.inside as f64 / self.total as f64
    }

    /// Interval of Clopper and Pearson for the probability of being inside: the probabilities that neither tail of the
    /// binomial distribution rejects. It contains the probability at least with probability `level`, if the specimens are
    /// independent.
    pub fn interval(&self, level: f64) -> [f64; 2] {
        let tail = 0.5 * (1.0 - level);
        let Self { inside, total } = *self;
        let low = match inside {
            0 => 0.0,
            _ => root(|p| binomial_tail(inside, total, p) - tail),
        };
        let high = match inside == total {
            true => 1.0,
            // P(at most `inside`) = 1 − P(at least `inside` + 1)
            false => root(|p| binomial_tail(inside + 1, total, p) - (1.0 - tail)),
        };
        [low, high]
    }
}

/// Root between 0 and 1 of an increasing function.
fn root(function: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        match function(middle) < 0.0 {
            true => low = middle,
            false => high = middle,
        }
    }
    0.5 * (low + high)
}

/// Probability of at least `least` successes in `total` independent trials with the success probability `p`.
pub(super) fn binomial_tail(least: usize, total: usize, p: f64) -> f64 {
    if least == 0 || p >= 1.0 {
        return f64::from(u8::from(least <= total));
    }
    if p <= 0.0 {
        return 0.0;
    }
    // logarithm of the binomial coefficient, factor by factor
    let mut ln_coefficient = 0.0;
    let mut sum = 0.0;
    for k in 0..=total {
        if k >= least {
            let ln_probability =
                ln_coefficient + k as f64 * p.ln() + (total - k) as f64 * (-p).ln_1p();
            sum += ln_probability.exp();
        }
        ln_coefficient += ((total - k) as f64).ln() - ((k + 1) as f64).ln();
    }
    sum.min(1.0)
}
