//! Lengths in the type, or in a number.

use super::family::{Array, Family, Iid};
use crate::datum::{Datum, Recordable};
use crate::scalar::Scalar;

/// Independent values of one distribution, `.array::<N>()` or `.iid(n)`: what
/// [`ordered`](Family::ordered) acts on.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a number of independent values",
    label = "write `.array::<N>()` or `.iid(n)` first: `Normal(0.0, 1.0).array::<3>().ordered()`"
)]
pub trait Repeated<R: Scalar>: Family {
    /// The distribution of each.
    type Element;

    /// An array or a `Vec`.
    type Values: Clone + Recordable + AsRef<[R]> + AsMut<[R]>;

    /// The distribution of each.
    fn element(&self) -> &Self::Element;

    /// How many.
    fn size(&self) -> usize;

    /// As many zeros.
    fn zeros(&self) -> Self::Values;
}

impl<R: Scalar, D: Family, const N: usize> Repeated<R> for Array<D, N> {
    type Element = D;
    type Values = [R; N];

    fn element(&self) -> &D {
        &self.inner
    }

    fn size(&self) -> usize {
        N
    }

    fn zeros(&self) -> [R; N] {
        [R::from(0.0); N]
    }
}

impl<R: Scalar, D: Family> Repeated<R> for Iid<D> {
    type Element = D;
    type Values = Vec<R>;

    fn element(&self) -> &D {
        &self.inner
    }

    fn size(&self) -> usize {
        self.n
    }

    fn zeros(&self) -> Vec<R> {
        vec![R::from(0.0); self.n]
    }
}

/// An array, a slice or a `Vec`: slopes and levels of a regression, weights and components of a
/// [`Mixture`](super::Mixture).
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a vector",
    label = "needed: an array, a slice or a `Vec`"
)]
pub trait Sequence: Clone {
    /// One of them.
    type Item: Clone;

    /// All of them.
    fn items(&self) -> &[Self::Item];

    /// Item `i` as a number of the model's kind.
    #[inline(always)]
    fn at<R>(&self, i: usize) -> R
    where
        Self::Item: Datum<R>,
    {
        self.items()[i].lift()
    }
}

macro_rules! impl_sequences {
    ($([$($generics:tt)*] $Sequence:ty),*) => {$(
        impl<$($generics)*> Sequence for $Sequence {
            type Item = T;

            #[inline]
            fn items(&self) -> &[T] {
                &self[..]
            }
        }
    )*};
}
impl_sequences!(
    [T: Clone, const N: usize] [T; N],
    [T: Clone, const N: usize] &[T; N],
    [T: Clone] &[T],
    [T: Clone] Vec<T>,
    [T: Clone] &Vec<T>
);
