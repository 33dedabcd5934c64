//! Parameters of distributions.

use crate::number::real::Real;
use crate::number::scalar::Scalar;

/// A parameter of a distribution, convertible to `f64`: an `f64`, any [`Scalar`], or a reference to
/// an `f64` or a scalar.
pub trait Parameter: Copy {
    /// Value of the parameter.
    fn number(self) -> f64;
}

impl<S: Scalar> Parameter for S {
    #[inline]
    fn number(self) -> f64 {
        self.value()
    }
}

impl Parameter for &f64 {
    #[inline]
    fn number(self) -> f64 {
        *self
    }
}

impl<S: Scalar> Parameter for &Real<S> {
    #[inline]
    fn number(self) -> f64 {
        self.value()
    }
}

/// Implements [`Parameter`] for integers. Densities still do not accept integers. With this implementation, the
/// compiler reports only one error for `Normal(0, 1.0)`: that the integer must be converted.
macro_rules! impl_count_parameter {
    ($($Count:ty),*) => {$(
        impl Parameter for $Count {
            #[inline]
            fn number(self) -> f64 {
                self as f64
            }
        }
    )*};
}
impl_count_parameter!(i32, i64, u8, u16, u32, u64, usize);
