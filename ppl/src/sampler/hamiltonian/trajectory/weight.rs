//! Weights e^(H₀−H) of the states of a trajectory, and sums of weights. H is the energy of a state, H₀ the energy at
//! the start.

/// Largest absolute energy error H − H₀ whose weight is stored without scaling. Even the sum of 2¹⁵⁰ such weights
/// does not overflow.
const PLAIN: f64 = 600.0;

/// Scaled weight `sum · e^unit`. The unit is 0 unless the energy of a state differs extremely from the energy at the
/// start of the trajectory. Weights are therefore usually added without logarithms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Weight {
    sum: f64,
    unit: f64,
}

impl Weight {
    /// Weight of an empty set of states.
    pub(crate) const NONE: Self = Self { sum: 0.0, unit: f64::NEG_INFINITY };

    /// Weight of a state with energy H₀ + `error`.
    #[inline]
    pub(crate) fn from_error(error: f64) -> Self {
        if error.abs() <= PLAIN {
            Self { sum: (-error).exp(), unit: 0.0 }
        } else {
            Self { sum: 1.0, unit: -error }
        }
    }

    /// Metropolis acceptance probability of a state with this weight.
    #[inline]
    pub(crate) fn acceptance(self) -> f64 {
        if self.unit == 0.0 { self.sum.min(1.0) } else { self.unit.exp().min(1.0) }
    }

    /// Returns the sum of both weights, and the fraction of `next` in the sum.
    #[inline]
    pub(crate) fn join(self, next: Self) -> (Self, f64) {
        let (a, b) = if self.unit == next.unit { (self, next) } else { self.alike(next) };
        let sum = a.sum + b.sum;
        (Self { sum, ..a }, b.sum / sum)
    }

    /// Rescales both weights to the larger of their units.
    #[cold]
    fn alike(self, other: Self) -> (Self, Self) {
        let unit = self.unit.max(other.unit);
        let express = |w: Self| Self { sum: w.sum * (w.unit - unit).exp(), unit };
        (express(self), express(other))
    }
}

#[cfg(test)]
#[path = "../../../../tests/unit/sampler_trajectory_weight.rs"]
mod tests;
