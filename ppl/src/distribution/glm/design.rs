//! Design matrices of regressions.

use std::fmt::Debug;

use crate::distribution::Sequence;

/// Predictors of one datum: an array `[f64; K]`, a `Vec<f64>`, or a number for a single predictor.
pub trait Predictors: Debug {
    /// The values of the predictors, one per slope.
    fn numbers(&self) -> &[f64];
}

impl<const K: usize> Predictors for [f64; K] {
    #[inline(always)]
    fn numbers(&self) -> &[f64] {
        self
    }
}

impl Predictors for Vec<f64> {
    #[inline]
    fn numbers(&self) -> &[f64] {
        self
    }
}

impl Predictors for f64 {
    #[inline(always)]
    fn numbers(&self) -> &[f64] {
        std::slice::from_ref(self)
    }
}

/// Design matrix with one row per datum: `&[[f64; K]]` for K predictors, `&[Vec<f64>]` if their number is known at run
/// time, `&[f64]` for a single predictor. A reference to a `Vec` or an array of rows is accepted too.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a design matrix",
    label = "expected one row of predictors per datum: `&[[f64; K]]`, `&[Vec<f64>]` or `&[f64]`"
)]
pub trait Design: Copy + Debug {
    /// Number of rows.
    fn size(&self) -> usize;

    /// Predictors of datum `i`.
    fn row(&self, i: usize) -> &[f64];
}

impl<S: Sequence<Item: Predictors> + Copy + Debug> Design for S {
    #[inline(always)]
    fn size(&self) -> usize {
        self.items().len()
    }

    #[inline(always)]
    fn row(&self, i: usize) -> &[f64] {
        self.items()[i].numbers()
    }
}
