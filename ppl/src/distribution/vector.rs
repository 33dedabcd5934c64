//! Lengths in the type, or in a number.

use super::family::{Array, Family, Iid};
use crate::datum::{Datum, Recordable};
use crate::scalar::Scalar;

/// How far from 1 the sum of probabilities or shares may be.
pub(super) const TOLERANCE: f64 = 1e-8;

/// A vector of parameters: an array (length known at compile time) or a `Vec` or slice (at run
/// time), by value or by reference.
///
/// Values of the distribution come in the same container: arrays for arrays, a `Vec` otherwise.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a vector of parameters",
    label = "needed: an array, a slice or a `Vec` of numbers or unknowns"
)]
pub trait Vector<R> {
    /// The same container for elements of type `T`.
    type Of<T: Clone + Recordable>: Clone + Recordable + AsRef<[T]> + AsMut<[T]>;

    /// Number of elements.
    fn size(&self) -> usize;

    /// Element `i`.
    fn at(&self, i: usize) -> R;

    /// Copies of `value` in the same container.
    fn filled<T: Copy + Recordable>(&self, value: T) -> Self::Of<T>;
}

macro_rules! impl_vector {
    ($([$($generics:tt)*] $Own:ty as $Of:ty, $own:ident, $value:ident => $filled:expr;)*) => {$(
        impl<R, V: Datum<R>, $($generics)*> Vector<R> for $Own {
            type Of<T: Clone + Recordable> = $Of;

            fn size(&self) -> usize {
                self.len()
            }

            #[inline]
            fn at(&self, i: usize) -> R {
                self[i].lift()
            }

            fn filled<T: Copy + Recordable>(&self, $value: T) -> $Of {
                let $own = self;
                $filled
            }
        }
    )*};
}
impl_vector! {
    [const N: usize] [V; N] as [T; N], _own, value => [value; N];
    [] [V] as Vec<T>, own, value => vec![value; own.len()];
    [] Vec<V> as Vec<T>, own, value => vec![value; own.len()];
}

impl<R, V: Vector<R> + ?Sized> Vector<R> for &V {
    type Of<T: Clone + Recordable> = V::Of<T>;

    fn size(&self) -> usize {
        (**self).size()
    }

    #[inline]
    fn at(&self, i: usize) -> R {
        (**self).at(i)
    }

    fn filled<T: Copy + Recordable>(&self, value: T) -> V::Of<T> {
        (**self).filled(value)
    }
}

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

/// What a [`Mixture`](super::Mixture) is made of: an array, a slice or a `Vec` of weights or of
/// distributions of one family.
pub trait Sequence: Clone {
    /// One of them.
    type Item: Clone;

    /// All of them.
    fn items(&self) -> &[Self::Item];
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
