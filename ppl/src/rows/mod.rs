//! Few rows that stand for the many observations of a loop.
//!
//! Normal observations about means that are linear in unknowns, yᵢ = Σₖ cᵢₖ uₖ + ε with data cᵢₖ,
//! enter a density through ‖y − C u‖² alone. With C = Q R and z = Qᵀ y that is ‖z − R u‖² and what
//! is left of ‖y‖², so that the rows of R, with z for their data, say all that those of C do, and
//! there are no more of them than unknowns. Observations whose uₖ differ, as they are elements of
//! arrays, form groups of their own.

mod collect;

use std::{iter, slice};

use crate::distribution::Distribution;
use crate::dot::{Dot, Numbers, dot};
use crate::expression::Expression;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::terms::Settled;

pub(crate) use collect::Collected;
pub use collect::NewRow;

/// The rows of all groups.
#[derive(Clone, Debug, PartialEq)]
pub struct Rows {
    /// Numbers in a row: coefficients and a datum.
    width: usize,
    groups: Box<[Group]>,
    numbers: Box<[f64]>,
    /// n, 0 and Σ x² of observations of zero that make up for the rest.
    rest: [f64; 3],
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Group {
    /// How many iterations lie between the first one of the group before and that of this one.
    gap: usize,
    rows: usize,
}

impl Rows {
    /// For every group how many iterations to leave out, and its rows; `WIDTH` is the number of
    /// numbers in them, or 0 where that is not known before.
    #[inline(always)]
    pub fn groups<const WIDTH: usize>(
        &self,
    ) -> impl Iterator<Item = (usize, impl Iterator<Item = Row<'_>>)> {
        let mut numbers = &*self.numbers;
        let width = if WIDTH == 0 { self.width } else { WIDTH };
        self.groups.iter().map_while(move |group| {
            let (own, others) = numbers.split_at_checked(group.rows * width)?;
            numbers = others;
            Some((group.gap, own.chunks_exact(width).map(|numbers| Row { numbers })))
        })
    }

    /// Adds the terms of what the rows leave, of `distribution` about zero.
    #[inline(always)]
    pub fn settle_rest<R: Scalar, D: Distribution<R>>(
        &self,
        distribution: &D,
        total: &mut Settled,
    ) {
        distribution.add_pooled_terms(&self.rest, total);
    }
}

/// What is left of a row.
#[derive(Clone, Copy, Debug)]
pub struct Row<'r> {
    numbers: &'r [f64],
}

impl<'r> Row<'r> {
    /// The next coefficient.
    #[inline(always)]
    pub fn coefficient(&mut self) -> f64 {
        let Some((&first, rest)) = self.numbers.split_first() else { return f64::NAN };
        self.numbers = rest;
        first
    }

    /// The next coefficients with their unknowns.
    #[inline(always)]
    pub fn dot<N: Numbers + ?Sized>(&mut self, unknowns: &'r N) -> Expression<Dot<'r, N>> {
        dot(self.next(unknowns.numbers().len()), unknowns)
    }

    /// Pairs what `over` yields with the next coefficients, `N` for each.
    #[inline(always)]
    pub fn along<I, const N: usize>(
        &mut self,
        over: I,
    ) -> iter::Zip<I::IntoIter, iter::Copied<slice::Iter<'r, [f64; N]>>>
    where
        I: IntoIterator<IntoIter: Clone>,
    {
        let over = over.into_iter();
        let (own, _) = self.next(N * over.clone().count()).as_chunks();
        iter::zip(over, own.iter().copied())
    }

    /// The next `n` numbers, or none if there are fewer: where `n` is known when this is compiled,
    /// loops over them have a known length.
    #[inline(always)]
    fn next(&mut self, n: usize) -> &'r [f64] {
        let (own, rest) = self.numbers.split_at_checked(n).unwrap_or_default();
        self.numbers = rest;
        own
    }

    /// The last number, once all coefficients are gone.
    #[inline(always)]
    pub fn datum(&self) -> f64 {
        if let &[datum] = self.numbers { datum } else { f64::NAN }
    }
}

/// Adds the terms of `distribution`, which has taken all coefficients of the row.
#[inline(always)]
pub fn settle<R: Scalar, D: Distribution<R>>(distribution: &D, row: Row<'_>, total: &mut Settled)
where
    f64: Datum<D::Value>,
{
    distribution.add_terms(&row.datum().lift(), total);
}

/// As [`Iterator::zip`], where leaving out many elements takes no longer than it takes its parts.
#[inline(always)]
pub fn zip<A: IntoIterator, B: IntoIterator>(a: A, b: B) -> Zip<A::IntoIter, B::IntoIter> {
    Zip(a.into_iter(), b.into_iter())
}

/// See [`zip`].
#[derive(Clone, Debug)]
pub struct Zip<A, B>(A, B);

impl<A: Iterator, B: Iterator> Iterator for Zip<A, B> {
    type Item = (A::Item, B::Item);

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        Some((self.0.next()?, self.1.next()?))
    }

    #[inline(always)]
    fn nth(&mut self, n: usize) -> Option<Self::Item> {
        Some((self.0.nth(n)?, self.1.nth(n)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_can_be_left_out() {
        let mut pairs = zip(&[1, 2, 3, 4], 10..20);
        assert_eq!(pairs.nth(1), Some((&2, 11)));
        assert_eq!(pairs.next(), Some((&3, 12)));
        assert_eq!(pairs.nth(1), None);
    }

    #[test]
    fn a_row_of_another_length_has_no_datum() {
        let numbers = [2.0, 3.0, 5.0];
        let mut row = Row { numbers: &numbers };
        assert!(row.datum().is_nan());
        assert_eq!(row.coefficient(), 2.0);
        assert_eq!(row.dot(&[crate::Real(4.0)]).value(), 12.0);
        assert_eq!(row.datum(), 5.0);
        row.coefficient();
        assert!(row.coefficient().is_nan() && row.datum().is_nan());
    }
}
