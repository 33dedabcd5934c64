//! Sequences of values, with a length known at compile time or at run time.

use crate::quantity::datum::Datum;

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
