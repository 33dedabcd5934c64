//! What an operation depends on, and how strongly.

use crate::datum::Datum;

/// Arguments of an operation with their partial derivatives.
///
/// Tuples of pairs (argument, partial), where an argument is anything that can be read as an
/// `R`: data among them cost nothing.
pub trait Partials<R> {
    /// How many arguments there are at most, if the type tells.
    #[doc(hidden)]
    const MOST: usize = usize::MAX;

    /// Calls `f` with every argument that is no constant, and its partial.
    fn spread(self, f: &mut impl FnMut(R, f64));

    /// As [`spread`](Partials::spread) for a summand of the result: its partials are final.
    #[doc(hidden)]
    #[inline(always)]
    fn settle(self, f: &mut impl FnMut(R, f64))
    where
        Self: Sized,
    {
        self.spread(f);
    }
}

/// Pairs from an iterator.
pub(crate) struct Each<I>(pub(crate) I);

impl<R, I: IntoIterator<Item = (R, f64)>> Partials<R> for Each<I> {
    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        for (argument, partial) in self.0 {
            f(argument, partial);
        }
    }
}

/// Arguments and partials side by side.
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
