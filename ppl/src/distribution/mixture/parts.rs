//! What a mixture is made of.

use crate::distribution::{Either, Family, Parameter};

/// The weights of a [`Mixture`](super::Mixture): an array, slice or vector of parameters.
pub trait Weights: Clone {
    /// One weight.
    type Weight: Parameter;

    /// All of them.
    fn weights(&self) -> &[Self::Weight];
}

/// The components of a [`Mixture`](super::Mixture): an array, slice or vector of one family, or a pair of two.
pub trait Components: Clone {
    /// One component.
    type Component: Family;

    /// How many there are.
    fn number(&self) -> usize;

    /// The `i`-th, counted from 0.
    fn component(&self, i: usize) -> Self::Component;
}

macro_rules! impl_sequences {
    ($([$($generics:tt)*] $Sequence:ty),*) => {$(
        impl<$($generics)*> Weights for $Sequence
        where
            T: Parameter,
        {
            type Weight = T;

            #[inline]
            fn weights(&self) -> &[T] {
                &self[..]
            }
        }

        impl<$($generics)*> Components for $Sequence
        where
            T: Family,
        {
            type Component = T;

            #[inline]
            fn number(&self) -> usize {
                self.len()
            }

            #[inline]
            fn component(&self, i: usize) -> T {
                self[i].clone()
            }
        }
    )*};
}
impl_sequences!(
    [T, const N: usize] [T; N],
    [T, const N: usize] &[T; N],
    [T] &[T],
    [T] Vec<T>,
    [T] &Vec<T>
);

impl<A: Family, B: Family> Components for (A, B) {
    type Component = Either<A, B>;

    #[inline]
    fn number(&self) -> usize {
        2
    }

    #[inline]
    fn component(&self, i: usize) -> Either<A, B> {
        if i == 0 { Either::First(self.0.clone()) } else { Either::Second(self.1.clone()) }
    }
}
