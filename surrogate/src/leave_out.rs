//! Leaving out a run with all its rows, without another fit.

use faer::Mat;

/// Below, 1 − h is mostly rounding, and without the run the others are short of rank.
const DETERMINED: f64 = 1e-10;

/// The fit of the first columns of a basis to the rows of all runs: one row for its value each, then, run
/// after run, those of its derivatives.
pub(crate) struct Prefix {
    pub(crate) terms: usize,
    pub(crate) runs: usize,
    /// y − f, rows × outputs, as the rows are weighted
    pub(crate) residuals: Mat<f64>,
    /// H_bb = Q_b Q_bᵀ of each run's rows, the derivatives first and the value last
    pub(crate) hat: Vec<f64>,
    /// tr (ΨᵀΨ)⁻¹ = |R⁻¹|²_F
    pub(crate) trace: f64,
}

/// The row of the `place`-th of a run's rows, the value being the last of `block`.
#[inline]
pub(crate) fn row_of(runs: usize, block: usize, run: usize, place: usize) -> usize {
    if place + 1 == block { run } else { runs + run * (block - 1) + place }
}

impl Prefix {
    /// Rows of a run.
    fn block(&self) -> usize {
        self.residuals.nrows() / self.runs
    }

    /// Sums over the runs of the leverages at a place in their blocks.
    pub(crate) fn leverage_at(&self, place: usize) -> f64 {
        let block = self.block();
        self.hat.chunks(block * block).map(|hat| hat[place * (block + 1)]).sum()
    }

    /// h_i of the values.
    pub(crate) fn leverages(&self) -> impl Iterator<Item = f64> {
        let size = self.block().pow(2);
        self.hat.chunks(size).map(move |hat| hat[size - 1])
    }

    /// Degrees of freedom that the terms leave to the values: N − P where there are no derivatives, which
    /// bear their share of the terms.
    pub(crate) fn freedom(&self) -> f64 {
        match self.block() {
            1 => (self.runs - self.terms) as f64,
            block => self.runs as f64 - self.leverage_at(block - 1),
        }
    }

    /// The residuals of the values, runs × outputs.
    pub(crate) fn value_residuals(&self) -> Mat<f64> {
        self.residuals.get(..self.runs, ..).to_owned()
    }

    /// The residuals (rows × outputs) at the rows of each run of the fit to all the other runs:
    /// (I − H_bb)⁻¹ (y_b − f_b). None if some run alone determines a coefficient.
    pub(crate) fn left_out(&self) -> Option<Mat<f64>> {
        let (block, outputs) = (self.block(), self.residuals.ncols());
        let mut left_out = self.residuals.clone();
        let mut factor = vec![0.0; block * block];
        for (run, hat) in self.hat.chunks(block * block).enumerate() {
            factorise(hat, block, &mut factor)?;
            let row = |place| row_of(self.runs, block, run, place);
            for m in 0..outputs {
                for a in 0..block {
                    for b in 0..a {
                        left_out[(row(a), m)] -= factor[a * block + b] * left_out[(row(b), m)];
                    }
                }
                for a in (0..block).rev() {
                    left_out[(row(a), m)] /= factor[a * block + a];
                    for b in a + 1..block {
                        left_out[(row(a), m)] -= factor[b * block + a] * left_out[(row(b), m)];
                    }
                }
            }
        }
        Some(left_out)
    }

    /// The rows of [`Self::left_out`] that are values, runs × outputs.
    pub(crate) fn loo_residuals(&self) -> Option<Mat<f64>> {
        Some(self.left_out()?.get(..self.runs, ..).to_owned())
    }

    /// N/(N−P) · (1 + tr (ΨᵀΨ)⁻¹): Chapelle's correction of the leave-one-out error, where N − P is
    /// [`Self::freedom`].
    pub(crate) fn correction(&self) -> f64 {
        self.runs as f64 / self.freedom() * (1.0 + self.trace)
    }
}

/// I − H = L D Lᵀ with L below the diagonal of `factor` and D on it.
fn factorise(hat: &[f64], block: usize, factor: &mut [f64]) -> Option<()> {
    for a in 0..block {
        for b in 0..=a {
            let identity = if a == b { 1.0 } else { 0.0 };
            let known: f64 = (0..b)
                .map(|c| factor[a * block + c] * factor[b * block + c] * factor[c * block + c])
                .sum();
            let entry = identity - hat[a * block + b] - known;
            if a > b {
                factor[a * block + b] = entry / factor[b * block + b];
            } else if entry > DETERMINED {
                factor[a * block + a] = entry;
            } else {
                return None;
            }
        }
    }
    Some(())
}
