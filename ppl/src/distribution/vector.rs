//! Sequences of values, with a length known at compile time or at run time.

use super::family::{Array, Family, Iid};
use crate::number::scalar::Scalar;
use crate::quantity::datum::{Datum, Recordable};

/// Independent values of one distribution, `.array::<N>()` or `.iid(n)`, to which [`ordered`](Family::ordered) applies.
#[diagnostic::on_unimplemented(
    message = "`{Self}` does not consist of independent values",
    label = "write `.array::<N>()` or `.iid(n)` first: `Normal(0.0, 1.0).array::<3>().ordered()`"
)]
pub trait Repeated<R: Scalar>: Family {
    /// Distribution of one value.
    type Element;

    /// Type of all values: an array or a `Vec`.
    type Values: Clone + Recordable + AsRef<[R]> + AsMut<[R]>;

    /// Distribution of one value.
    fn element(&self) -> &Self::Element;

    /// Number of values.
    fn size(&self) -> usize;

    /// Creates an array or a `Vec` of zeros with this number of values.
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

/// A sequence of parameters, an array, a slice or a `Vec`: the slopes and intercepts of a regression, or the weights
/// and components of a [`Mixture`](super::Mixture).
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a vector",
    label = "expected an array, a slice or a `Vec`"
)]
pub trait Sequence: Clone {
    /// Type of an item.
    type Item: Clone;

    /// All items.
    fn items(&self) -> &[Self::Item];

    /// Item `i`, converted to the scalar type of the model.
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
