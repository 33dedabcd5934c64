//! Sets of values of distributions, and smooth maps of unconstrained coordinates onto them.

use std::ops::{RangeFrom, RangeInclusive};

use super::Support;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Recordable;

/// Set of the values of a distribution.
///
/// | domain | values |
/// |---|---|
/// | [`Support`] | numbers in an interval |
/// | `[Support; N]`, `Vec<Support>` | arrays and vectors with one interval per entry |
/// | [`Simplex`](super::Simplex) | positive shares whose sum is 1 |
/// | `0..`, `0..=n` with `u64` ends | counts |
pub trait Domain<R: Scalar> {
    /// Type of the values.
    type Value: Clone + Recordable;

    /// Whether the value belongs to the domain.
    fn includes(&self, x: &Self::Value) -> bool;
}

/// A domain with a smooth map of unconstrained coordinates onto it. An unknown can have a distribution with such a
/// domain.
pub trait SmoothDomain<R: Scalar>: Domain<R> {
    /// Number of unconstrained coordinates.
    fn dim(&self) -> usize;

    /// Maps the next coordinates to a value. Returns the value and the log-Jacobian.
    fn value_at(&self, next: &mut impl FnMut() -> R) -> (Self::Value, R);

    /// Appends the unconstrained coordinates of `x`, the inverse of
    /// [`value_at`](SmoothDomain::value_at).
    fn coordinates_of(&self, x: &Self::Value, out: &mut Vec<f64>);

    /// Ends of the intervals of all entries, if they are finite and the same for all entries; otherwise `None`. A
    /// warning is issued if a posterior reaches such an end.
    fn ends(&self) -> Option<(f64, f64)> {
        None
    }
}

impl<R: Scalar> Domain<R> for Support<R> {
    type Value = R;

    fn includes(&self, x: &R) -> bool {
        self.contains(x.value())
    }
}

impl<R: Scalar> SmoothDomain<R> for Support<R> {
    fn dim(&self) -> usize {
        1
    }

    fn value_at(&self, next: &mut impl FnMut() -> R) -> (R, R) {
        self.constrain(next())
    }

    fn coordinates_of(&self, x: &R, out: &mut Vec<f64>) {
        out.push(self.unconstrain(x.value()));
    }

    fn ends(&self) -> Option<(f64, f64)> {
        let (lower, upper) = self.bounds();
        (lower.is_finite() && upper.is_finite()).then_some((lower, upper))
    }
}

impl<R: Scalar, const N: usize> Domain<R> for [Support<R>; N] {
    type Value = [R; N];

    fn includes(&self, x: &[R; N]) -> bool {
        includes_all(self, x)
    }
}

impl<R: Scalar, const N: usize> SmoothDomain<R> for [Support<R>; N] {
    fn dim(&self) -> usize {
        N
    }

    fn value_at(&self, next: &mut impl FnMut() -> R) -> ([R; N], R) {
        let mut log_jacobian = R::from(0.0);
        let values = std::array::from_fn(|i| mapped(&self[i], next, &mut log_jacobian));
        (values, log_jacobian)
    }

    fn coordinates_of(&self, x: &[R; N], out: &mut Vec<f64>) {
        unmapped(self, x, out);
    }

    fn ends(&self) -> Option<(f64, f64)> {
        common_ends(self)
    }
}

impl<R: Scalar> Domain<R> for Vec<Support<R>> {
    type Value = Vec<R>;

    fn includes(&self, x: &Vec<R>) -> bool {
        includes_all(self, x)
    }
}

impl<R: Scalar> SmoothDomain<R> for Vec<Support<R>> {
    fn dim(&self) -> usize {
        self.len()
    }

    fn value_at(&self, next: &mut impl FnMut() -> R) -> (Vec<R>, R) {
        let mut log_jacobian = R::from(0.0);
        let values = self.iter().map(|support| mapped(support, next, &mut log_jacobian)).collect();
        (values, log_jacobian)
    }

    fn coordinates_of(&self, x: &Vec<R>, out: &mut Vec<f64>) {
        unmapped(self, x, out);
    }

    fn ends(&self) -> Option<(f64, f64)> {
        common_ends(self)
    }
}

impl<R: Scalar> Domain<R> for RangeInclusive<u64> {
    type Value = u64;

    fn includes(&self, x: &u64) -> bool {
        self.contains(x)
    }
}

impl<R: Scalar> Domain<R> for RangeFrom<u64> {
    type Value = u64;

    fn includes(&self, x: &u64) -> bool {
        self.contains(x)
    }
}

fn includes_all<R: Scalar>(supports: &[Support<R>], x: &[R]) -> bool {
    supports.len() == x.len() && supports.iter().zip(x).all(|(s, x)| s.contains(x.value()))
}

fn mapped<R: Scalar>(
    support: &Support<R>,
    next: &mut impl FnMut() -> R,
    log_jacobian: &mut R,
) -> R {
    let (x, term) = support.constrain(next());
    *log_jacobian += term;
    x
}

fn unmapped<R: Scalar>(supports: &[Support<R>], x: &[R], out: &mut Vec<f64>) {
    out.extend(supports.iter().zip(x).map(|(support, x)| support.unconstrain(x.value())));
}

fn common_ends<R: Scalar>(supports: &[Support<R>]) -> Option<(f64, f64)> {
    let ends = SmoothDomain::ends(supports.first()?)?;
    supports.iter().all(|support| SmoothDomain::ends(support) == Some(ends)).then_some(ends)
}
