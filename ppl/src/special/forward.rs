//! Forward-mode derivatives of continued fractions and series.

/// A number with its derivatives with respect to `N` shape parameters (forward mode), for continued fractions and
/// series.
#[derive(Clone, Copy)]
pub(super) struct Forward<const N: usize> {
    pub(super) value: f64,
    pub(super) slopes: [f64; N],
}

impl<const N: usize> Forward<N> {
    pub(super) fn new(value: f64, slopes: [f64; N]) -> Self {
        Self { value, slopes }
    }

    pub(super) fn constant(value: f64) -> Self {
        Self::new(value, [0.0; N])
    }

    pub(super) fn plus(self, other: Self) -> Self {
        let slope = |i: usize| self.slopes[i] + other.slopes[i];
        Self::new(self.value + other.value, std::array::from_fn(slope))
    }

    pub(super) fn shifted(self, by: f64) -> Self {
        Self { value: self.value + by, ..self }
    }

    pub(super) fn times(self, other: Self) -> Self {
        let slope = |i: usize| self.value * other.slopes[i] + other.value * self.slopes[i];
        Self::new(self.value * other.value, std::array::from_fn(slope))
    }

    pub(super) fn recip(self) -> Self {
        let inverse = self.value.recip();
        Self::new(inverse, self.slopes.map(|slope| -slope * inverse * inverse))
    }

    /// Whether the addition of `self` changes neither the value nor the derivatives of `sum`. Also true if `sum` is
    /// not finite.
    pub(super) fn is_negligible_in(self, sum: Self) -> bool {
        const ROUNDING: f64 = 0.1 * f64::EPSILON;
        let small = |part: f64, all: f64| part.abs() <= ROUNDING * all.abs();
        if !sum.value.is_finite() {
            return true;
        }
        small(self.value, sum.value)
            && self.slopes.iter().zip(sum.slopes).all(|(&part, all)| small(part, all))
    }
}

/// Largest number of terms of a continued fraction or series, far above the number of terms that a convergent
/// fraction or series needs.
pub(super) const MOST_TERMS: f64 = 1e7;
