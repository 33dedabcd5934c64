//! Arguments of operations and their partial derivatives.

use crate::quantity::datum::Datum;

/// Arguments of an operation with their partial derivatives.
///
/// Implemented for tuples of pairs (argument, partial derivative). An argument is any value that is convertible to
/// `R`; arguments that are data cause no computation.
pub trait Partials<R> {
    /// Largest number of arguments of the operation; `usize::MAX` if the type does not determine the number.
    #[doc(hidden)]
    const MOST: usize = usize::MAX;

    /// Calls `f` with every argument that is not constant, and its partial derivative.
    fn spread(self, f: &mut impl FnMut(R, f64));

    /// Version of [`spread`](Partials::spread) for a term of the log density, whose partial derivatives are final,
    /// that is, are not multiplied by a further factor.
    #[doc(hidden)]
    #[inline(always)]
    fn settle(self, f: &mut impl FnMut(R, f64))
    where
        Self: Sized,
    {
        self.spread(f);
    }
}

/// Pairs of arguments and partial derivatives from an iterator.
pub(crate) struct Each<I>(pub(crate) I);

impl<R, I: IntoIterator<Item = (R, f64)>> Partials<R> for Each<I> {
    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        for (argument, partial) in self.0 {
            f(argument, partial);
        }
    }
}

/// Arrays of arguments and of partial derivatives.
pub(crate) struct Zipped<R, const K: usize>(pub(crate) [R; K], pub(crate) [f64; K]);

impl<R: Copy, const K: usize> Partials<R> for Zipped<R, K> {
    const MOST: usize = K;

    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        for k in 0..K {
            f(self.0[k], self.1[k]);
        }
    }
}

macro_rules! impl_partials {
    ($($A:ident $i:tt),*) => {
        impl<R, $($A: Datum<R> + Copy),*> Partials<R> for ($(($A, f64),)*) {
            const MOST: usize = 0usize$(.saturating_add($A::NUMBERS))*;

            #[inline(always)]
            fn spread(self, f: &mut impl FnMut(R, f64)) {
                $(self.$i.0.spread(self.$i.1, f);)*
            }

            #[inline(always)]
            fn settle(self, f: &mut impl FnMut(R, f64)) {
                $(self.$i.0.settle(self.$i.1, f);)*
            }
        }
    };
}
impl_partials!(A 0);
impl_partials!(A 0, B 1);
impl_partials!(A 0, B 1, C 2);
impl_partials!(A 0, B 1, C 2, D 3);
impl_partials!(A 0, B 1, C 2, D 3, E 4);
