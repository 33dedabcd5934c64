//! Known predictors.

use std::fmt::Debug;

use crate::distribution::Sequence;

/// The predictors of one datum: an array `[f64; K]`, a `Vec<f64>`, or a number if there is one.
pub trait Predictors: Debug {
    /// The numbers, one a slope.
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

/// A design matrix, one row a datum: `&[[f64; K]]` for K predictors, `&[Vec<f64>]` where their number
/// is known at run time, `&[f64]` for one; a reference to a `Vec` or an array of these too.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a design matrix",
    label = "needed: one row of predictors a datum, as `&[[f64; K]]`, `&[Vec<f64>]` or `&[f64]`"
)]
pub trait Design: Copy + Debug {
    /// Number of rows.
    fn size(&self) -> usize;

    /// The predictors of datum `i`.
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
