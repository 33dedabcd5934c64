//! Sums of adjoints over the iterations of a plate (a `for` loop of the model), which are not stored on the tape.
//!
//! Every iteration of a plate adds to the adjoints of the same few scalars. On the tape, each addition must wait
//! until the previous addition has reached memory. A separate sum can stay in a register until the plate ends.

use std::cell::Cell;
use std::ops::{Deref, Index};

use crate::number::real::Real;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::term::dot::Numbers;
use crate::term::formula::{Expression, Formula, closed};

/// −0.0, the exact additive identity (0.0 + x changes −0.0), so that the compiler can omit the first addition.
const NOTHING: f64 = -0.0;

/// A scalar from outside a loop of the model, with the sum of the contributions of the iterations to its adjoint.
#[derive(Debug)]
pub struct Sum<R> {
    pub(crate) number: R,
    adjoint: Cell<f64>,
}

impl<R: Scalar> Sum<R> {
    #[inline(always)]
    pub(crate) fn new(number: R) -> Self {
        Self { number, adjoint: Cell::new(NOTHING) }
    }

    #[inline(always)]
    pub(crate) fn part(&self) -> Summed<'_, R> {
        Summed { number: self.number, adjoint: &self.adjoint }
    }

    /// Adds the sum to the adjoint of the scalar.
    #[inline(always)]
    pub fn deposit(&self) {
        self.number.deposit(self.adjoint.get());
    }
}

/// Scalar in a formula, with a separate sum for its adjoint. `SHARED`: whether the scalar is the same in all
/// iterations.
#[derive(Clone, Copy, Debug)]
pub struct Summed<'a, R, const SHARED: bool = true> {
    number: R,
    adjoint: &'a Cell<f64>,
}

impl<S: Scalar, const SHARED: bool> Formula for Summed<'_, Real<S>, SHARED> {
    type Number = Real<S>;

    #[inline(always)]
    fn result(self) -> f64 {
        self.number.value()
    }
}

impl<S: Scalar, const SHARED: bool> Datum<Real<S>> for Summed<'_, Real<S>, SHARED> {
    const SHARED: bool = SHARED;
    const NUMBERS: usize = 1;

    #[inline(always)]
    fn lift(&self) -> Real<S> {
        self.number
    }

    #[inline(always)]
    fn spread(&self, weight: f64, f: &mut impl FnMut(Real<S>, f64)) {
        f(self.number, weight);
    }

    #[inline(always)]
    fn settle(&self, weight: f64, _: &mut impl FnMut(Real<S>, f64)) {
        self.adjoint.set(self.adjoint.get() + weight);
    }
}

/// A formula whose adjoint is summed over the iterations of a loop of the model before it is propagated to the
/// scalars in the formula.
#[derive(Debug)]
pub struct Open<A> {
    pub(crate) formula: Expression<A>,
    adjoint: Cell<f64>,
}

impl<A: Formula> Open<A> {
    #[inline(always)]
    pub(crate) fn new(formula: Expression<A>) -> Self {
        Self { formula, adjoint: Cell::new(NOTHING) }
    }

    #[inline(always)]
    pub(crate) fn part(&self) -> OpenSummed<'_, A> {
        OpenSummed(self)
    }

    /// Propagates the sum of the adjoint to the scalars in the formula.
    #[inline(always)]
    pub fn deposit(&self) {
        let settle = &mut |number: A::Number, adjoint| number.deposit(adjoint);
        self.formula.0.settle(self.adjoint.get(), settle);
    }
}

/// Reference to an [`Open`] formula inside another formula. Contributions to the adjoint of the reference are added
/// to the sum of the `Open` formula.
#[derive(Debug)]
pub struct OpenSummed<'a, A>(&'a Open<A>);

impl<A> Clone for OpenSummed<'_, A> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<A> Copy for OpenSummed<'_, A> {}

impl<A: Formula> Formula for OpenSummed<'_, A> {
    type Number = A::Number;

    #[inline(always)]
    fn result(self) -> f64 {
        self.0.formula.value()
    }
}

impl<A: Formula> Datum<A::Number> for OpenSummed<'_, A> {
    const NUMBERS: usize = A::NUMBERS;

    #[inline(always)]
    fn lift(&self) -> A::Number {
        closed(*self)
    }

    #[inline(always)]
    fn spread(&self, weight: f64, f: &mut impl FnMut(A::Number, f64)) {
        self.0.formula.0.spread(weight, f);
    }

    #[inline(always)]
    fn settle(&self, weight: f64, _: &mut impl FnMut(A::Number, f64)) {
        self.0.adjoint.set(self.0.adjoint.get() + weight);
    }
}

/// An array of scalars from outside a loop of the model, with the sums of the contributions of the iterations to
/// their adjoints.
#[derive(Debug)]
pub struct Sums<S, const N: usize> {
    pub(crate) scalars: [Real<S>; N],
    adjoints: [Cell<f64>; N],
}

impl<S: Scalar, const N: usize> Sums<S, N> {
    #[inline(always)]
    pub(crate) fn new(scalars: [Real<S>; N]) -> Self {
        Self { scalars, adjoints: [const { Cell::new(NOTHING) }; N] }
    }

    /// Element `i` in a formula, where `i` is the same in every iteration.
    #[inline(always)]
    pub fn __element(&self, i: usize) -> Expression<Summed<'_, Real<S>>> {
        self.part(i)
    }

    /// Element `i` in a formula, where `i` differs between iterations. The sum of the adjoint is not stored on
    /// the tape. The compiler therefore knows that an addition to the sum does not change the data of the loop.
    #[inline(always)]
    pub fn __own(&self, i: usize) -> Expression<Summed<'_, Real<S>, false>> {
        self.part(i)
    }

    #[inline(always)]
    fn part<const SHARED: bool>(&self, i: usize) -> Expression<Summed<'_, Real<S>, SHARED>> {
        Expression(Summed { number: self.scalars[i], adjoint: &self.adjoints[i] })
    }

    /// Adds the sums to the adjoints of the scalars.
    #[inline(always)]
    pub fn deposit(&self) {
        for (number, adjoint) in self.scalars.iter().zip(&self.adjoints) {
            number.deposit(adjoint.get());
        }
    }
}

impl<S: Scalar, const N: usize> Numbers for Sums<S, N> {
    type Scalar = S;

    #[inline(always)]
    fn numbers(&self) -> &[Real<S>] {
        &self.scalars
    }

    #[inline(always)]
    fn element(&self, i: usize) -> impl Datum<Real<S>> {
        self.part::<true>(i).0
    }
}

/// A value from outside a loop of the model that has no adjoint to be summed, such as data.
#[derive(Debug)]
pub struct Kept<'a, T: ?Sized>(pub(crate) &'a T);

impl<T: ?Sized> Kept<'_, T> {
    /// Does nothing, because there are no adjoints.
    #[inline(always)]
    pub fn deposit(&self) {}
}

impl<T: ?Sized> Deref for Kept<'_, T> {
    type Target = T;

    #[inline(always)]
    fn deref(&self) -> &T {
        self.0
    }
}

/// Indexing that clones the element.
pub trait At<I> {
    /// Type of the element.
    type Element;

    /// Clone of element `i`.
    fn __element(&self, i: I) -> Self::Element;

    /// Clone of element `i`.
    fn __own(&self, i: I) -> Self::Element;
}

impl<I, T: Index<I, Output: Clone> + ?Sized> At<I> for T {
    type Element = T::Output;

    #[inline(always)]
    fn __element(&self, i: I) -> T::Output {
        self[i].clone()
    }

    #[inline(always)]
    fn __own(&self, i: I) -> T::Output {
        self[i].clone()
    }
}

impl<T: Numbers + ?Sized> Numbers for Kept<'_, T> {
    type Scalar = T::Scalar;

    #[inline(always)]
    fn numbers(&self) -> &[Real<T::Scalar>] {
        self.0.numbers()
    }

    #[inline(always)]
    fn element(&self, i: usize) -> impl Datum<Real<T::Scalar>> {
        self.0.element(i)
    }
}
