//! Literals in the body of a model whose type is inferred from neighbouring values.

use crate::number::real::Real;
use crate::number::scalar::Scalar;

/// Type to which a literal in the body of a model can be converted, if neighbouring values determine its type.
#[diagnostic::on_unimplemented(
    message = "a literal cannot be combined with `{Self}`",
    label = "all elements of an array, and all arms of a branch, must have one type"
)]
pub trait Literal {
    /// Converts the value of the literal to this type.
    fn from_literal(value: f64) -> Self;
}

impl Literal for f64 {
    #[inline(always)]
    fn from_literal(value: f64) -> Self {
        value
    }
}

impl Literal for f32 {
    #[inline(always)]
    fn from_literal(value: f64) -> Self {
        value as Self
    }
}

impl<S: Scalar> Literal for Real<S> {
    #[inline(always)]
    fn from_literal(value: f64) -> Self {
        Self::from(value)
    }
}

/// Converts a literal to the inferred type.
#[inline(always)]
pub fn literal<T: Literal>(value: f64) -> T {
    T::from_literal(value)
}
