//! Weights of states, e^(H₀−H), and their sums.

/// Energy errors up to which a weight is a plain number; so are sums of 2¹⁵⁰ of them.
const PLAIN: f64 = 600.0;

/// `sum · e^unit`. The unit is 0 but for states that lie very far in energy from where the
/// trajectory began, so that weights are joined by an addition, without logarithms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Weight {
    sum: f64,
    unit: f64,
}

impl Weight {
    /// Of no state.
    pub(super) const NONE: Self = Self { sum: 0.0, unit: f64::NEG_INFINITY };

    /// Of a state whose energy is H₀ + `error`.
    #[inline]
    pub(super) fn of(error: f64) -> Self {
        if error.abs() <= PLAIN {
            Self { sum: (-error).exp(), unit: 0.0 }
        } else {
            Self { sum: 1.0, unit: -error }
        }
    }

    /// With what probability Metropolis would accept a state of this weight.
    #[inline]
    pub(super) fn acceptance(self) -> f64 {
        if self.unit == 0.0 { self.sum.min(1.0) } else { self.unit.exp().min(1.0) }
    }

    /// The sum of both, and the fraction of `next` in it.
    #[inline]
    pub(super) fn join(self, next: Self) -> (Self, f64) {
        let (a, b) = if self.unit == next.unit { (self, next) } else { self.alike(next) };
        let sum = a.sum + b.sum;
        (Self { sum, ..a }, b.sum / sum)
    }

    /// Both in the larger of their units.
    #[cold]
    fn alike(self, other: Self) -> (Self, Self) {
        let unit = self.unit.max(other.unit);
        let express = |w: Self| Self { sum: w.sum * (w.unit - unit).exp(), unit };
        (express(self), express(other))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ln of the sum and the fraction, by logarithms all the way.
    fn reference(errors: &[f64]) -> (f64, f64) {
        let least = errors.iter().copied().fold(f64::INFINITY, f64::min);
        let sum = |errors: &[f64]| errors.iter().map(|e| (least - e).exp()).sum::<f64>();
        let last = errors.len() - 1;
        (sum(errors).ln() - least, sum(&errors[last..]) / sum(errors))
    }

    #[test]
    fn sums_and_shares_are_those_of_logarithms() {
        let errors = [0.0, 0.3, -2.0, 599.0, 601.0, -601.0, -599.5, 5e4, -5e4, -5e4 - 1.0, 990.0];
        for i in 0..errors.len() {
            for j in i + 1..=errors.len() {
                let errors = &errors[i..j];
                let mut sum = (Weight::NONE, 1.0);
                for error in errors {
                    sum = sum.0.join(Weight::of(*error));
                }
                let (ln, fraction) = reference(errors);
                let found = sum.0.sum.ln() + sum.0.unit;
                approx::assert_relative_eq!(found, ln, max_relative = 1e-14, epsilon = 1e-13);
                approx::assert_relative_eq!(sum.1, fraction, max_relative = 1e-11);
            }
        }
    }

    #[test]
    fn acceptances_are_at_most_one() {
        for (error, expected) in [(0.5, (-0.5f64).exp()), (-0.5, 1.0), (-700.0, 1.0), (900.0, 0.0)]
        {
            assert_eq!(Weight::of(error).acceptance(), expected);
        }
    }
}
