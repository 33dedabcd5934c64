//! A sum over a loop as part of a formula, with nothing stored: its derivative runs the loop again.

use std::fmt;

use crate::expression::{Expression, Node};

/// Σ each(x) over what `over` yields.
pub struct Total<'a, I, F> {
    value: f64,
    over: &'a I,
    each: &'a F,
}

impl<I, F> Clone for Total<'_, I, F> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<I, F> Copy for Total<'_, I, F> {}

impl<I, F> fmt::Debug for Total<'_, I, F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Total").field("value", &self.value).finish_non_exhaustive()
    }
}

impl<I, F, A> Node for Total<'_, I, F>
where
    I: Iterator + Clone,
    F: Fn(I::Item) -> Expression<A>,
    A: Node,
{
    type Number = A::Number;

    #[inline(always)]
    fn result(self) -> f64 {
        self.value
    }

    #[inline(always)]
    fn spread(self, weight: f64, f: &mut impl FnMut(A::Number, f64)) {
        for x in self.over.clone() {
            (self.each)(x).0.spread(weight, f);
        }
    }

    #[inline(always)]
    fn settle(self, weight: f64, f: &mut impl FnMut(A::Number, f64)) {
        for x in self.over.clone() {
            (self.each)(x).0.settle(weight, f);
        }
    }
}

/// What a loop can sum: formulas, and numbers that only look like some to the macro.
pub trait Summand<'a, I, F>: Sized {
    /// The sum.
    type Total;

    /// Σ each(x).
    fn total(over: &'a I, each: &'a F) -> Self::Total;
}

impl<'a, I, F, A> Summand<'a, I, F> for Expression<A>
where
    I: Iterator + Clone + 'a,
    F: Fn(I::Item) -> Expression<A> + 'a,
    A: Node,
{
    type Total = Expression<Total<'a, I, F>>;

    #[inline(always)]
    fn total(over: &'a I, each: &'a F) -> Self::Total {
        let value = over.clone().map(|x| each(x).value()).sum();
        Expression(Total { value, over, each })
    }
}

macro_rules! plain {
    ($($t:ty),*) => {$(
        impl<'a, I: Iterator + Clone, F: Fn(I::Item) -> $t> Summand<'a, I, F> for $t {
            type Total = $t;

            #[inline(always)]
            fn total(over: &'a I, each: &'a F) -> $t {
                over.clone().map(each).sum()
            }
        }
    )*};
}
plain!(f64, f32, usize, u32, u64, isize, i32, i64);

/// The summand of a loop: gives the closure the type of what the loop yields.
#[inline(always)]
pub fn summand<I: Iterator, R, F: Fn(I::Item) -> R>(_: &I, each: F) -> F {
    each
}

/// Σ each(x) over what `over` yields, as a formula if the summands are formulas.
#[inline(always)]
pub fn total<'a, I, R, F>(over: &'a I, each: &'a F) -> R::Total
where
    I: Iterator,
    F: Fn(I::Item) -> R,
    R: Summand<'a, I, F>,
{
    R::total(over, each)
}
