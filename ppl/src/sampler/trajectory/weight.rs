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
#[path = "../../../tests/unit/sampler_trajectory_weight.rs"]
mod tests;
