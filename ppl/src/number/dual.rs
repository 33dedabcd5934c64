//! Forward-mode differentiation: a value with its gradient in `N` directions.

use crate::number::partials::Partials;
use crate::number::scalar::{Scalar, impl_arithmetic};

/// A number with its derivatives along `N` directions (forward-mode differentiation).
///
/// Suitable for functions with few inputs, and used to test the tape.
#[derive(Clone, Copy, Debug)]
pub struct Dual<const N: usize> {
    value: f64,
    gradient: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// A number with a given gradient.
    pub const fn new(value: f64, gradient: [f64; N]) -> Self {
        Self { value, gradient }
    }

    /// The `N` independent variables at the point `x`, with unit gradients.
    pub fn variables(x: [f64; N]) -> [Self; N] {
        std::array::from_fn(|i| {
            let mut gradient = [0.0; N];
            gradient[i] = 1.0;
            Self::new(x[i], gradient)
        })
    }

    /// Derivatives along the `N` directions.
    pub const fn gradient(&self) -> [f64; N] {
        self.gradient
    }
}

impl<const N: usize> From<f64> for Dual<N> {
    #[inline]
    fn from(value: f64) -> Self {
        Self::new(value, [0.0; N])
    }
}

impl_arithmetic!([const N: usize] Dual<N>);

impl<const N: usize> Scalar for Dual<N> {
    const DIFFERENTIABLE: bool = true;

    #[inline]
    fn value(self) -> f64 {
        self.value
    }

    #[inline]
    fn is_constant(self) -> bool {
        self.gradient.iter().all(|&g| g == 0.0)
    }

    #[inline]
    fn has_finite_slopes(self) -> bool {
        self.gradient.iter().all(|slope| slope.is_finite())
    }

    #[inline]
    fn gather(value: f64, partials: impl Partials<Self>) -> Self {
        let mut gradient = [0.0; N];
        partials.spread(&mut |argument, partial| {
            for (total, g) in gradient.iter_mut().zip(argument.gradient) {
                // skip directions with zero derivative, because 0 · ∞ is NaN
                if g != 0.0 {
                    *total += partial * g;
                }
            }
        });
        Self::new(value, gradient)
    }
}

crate::quantity::datum::impl_number_record! {
    [const N: usize] Dual<N>: self => self.value;
}
