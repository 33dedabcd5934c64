//! Arithmetic expressions that are differentiated as a whole.
//!
//! `model!` treats `a + b * x` in a statement as one expression. The type of the expression represents the structure
//! of the formula. The value and the derivative of every operation are computed when the expression is built. Closing
//! an expression (`close`) converts it to one scalar, which is stored on the tape as a single operation. An
//! expression in a distribution argument is not closed: the partial derivatives of the density are propagated
//! directly to the scalars in the expression.

use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

use crate::number::dual::Dual;
use crate::number::real::Real;
use crate::number::scalar::Scalar;
use crate::quantity::datum::{Datum, Recordable};
use crate::term::parameter::Parameter;

/// A formula over the scalars of a model.
///
/// An expression can be a parameter of a distribution; [`close`](Expression::close) converts it to a scalar.
#[derive(Clone, Copy, Debug)]
pub struct Expression<E>(pub(crate) E);

/// A formula or a part of a formula. As a [`Datum`], it propagates a derivative to the scalars in the formula.
pub trait Formula: Datum<<Self as Formula>::Number> + Copy + Debug {
    /// Type of the scalars in the formula.
    type Number: Scalar;

    /// Value of the formula.
    fn result(self) -> f64;

    /// Lengths of the two vectors if the formula is a dot product; otherwise `None`.
    #[inline(always)]
    fn lengths(self) -> Option<[usize; 2]> {
        None
    }
}

/// Converts a formula to one scalar, which is stored on the tape as a single operation.
#[inline(always)]
pub(crate) fn closed<A: Formula>(formula: A) -> A::Number {
    A::Number::gather(formula.result(), ((formula, 1.0),))
}

impl<S: Scalar> Formula for Real<S> {
    type Number = Self;

    #[inline(always)]
    fn result(self) -> f64 {
        self.value()
    }
}

/// A function of one formula.
#[derive(Clone, Copy, Debug)]
pub struct Unary<A> {
    value: f64,
    slope: f64,
    argument: A,
}

impl<A: Formula> Formula for Unary<A> {
    type Number = A::Number;

    #[inline(always)]
    fn result(self) -> f64 {
        self.value
    }
}

impl<A: Formula> Datum<A::Number> for Unary<A> {
    const NUMBERS: usize = A::NUMBERS;

    #[inline(always)]
    fn lift(&self) -> A::Number {
        closed(*self)
    }

    #[inline(always)]
    fn spread(&self, weight: f64, f: &mut impl FnMut(A::Number, f64)) {
        self.argument.spread(weight * self.slope, f);
    }

    #[inline(always)]
    fn settle(&self, weight: f64, f: &mut impl FnMut(A::Number, f64)) {
        self.argument.settle(weight * self.slope, f);
    }
}

/// A function of two formulas.
#[derive(Clone, Copy, Debug)]
pub struct Binary<A, B> {
    value: f64,
    slopes: (f64, f64),
    arguments: (A, B),
}

impl<A: Formula, B: Formula<Number = A::Number>> Formula for Binary<A, B> {
    type Number = A::Number;

    #[inline(always)]
    fn result(self) -> f64 {
        self.value
    }
}

impl<A: Formula, B: Formula<Number = A::Number>> Datum<A::Number> for Binary<A, B> {
    const NUMBERS: usize = A::NUMBERS.saturating_add(B::NUMBERS);

    #[inline(always)]
    fn lift(&self) -> A::Number {
        closed(*self)
    }

    #[inline(always)]
    fn spread(&self, weight: f64, f: &mut impl FnMut(A::Number, f64)) {
        self.arguments.0.spread(weight * self.slopes.0, f);
        self.arguments.1.spread(weight * self.slopes.1, f);
    }

    #[inline(always)]
    fn settle(&self, weight: f64, f: &mut impl FnMut(A::Number, f64)) {
        self.arguments.0.settle(weight * self.slopes.0, f);
        self.arguments.1.settle(weight * self.slopes.1, f);
    }
}

impl<A: Formula> Expression<A> {
    /// Value of the formula.
    #[inline(always)]
    pub fn value(self) -> f64 {
        self.0.result()
    }

    /// Converts the formula to one scalar.
    #[inline(always)]
    pub fn close(self) -> A::Number {
        closed(self.0)
    }

    #[inline(always)]
    fn unary(self, value: f64, slope: f64) -> Expression<Unary<A>> {
        Expression(Unary { value, slope, argument: self.0 })
    }

    /// Applies a function of [`Scalar`] to the formula. The derivative is computed with a dual number.
    #[inline(always)]
    fn apply(self, f: impl FnOnce(Dual<1>) -> Dual<1>) -> Expression<Unary<A>> {
        let y = f(Dual::new(self.value(), [1.0]));
        self.unary(y.value(), y.gradient()[0])
    }

    /// See [`Scalar::powi`].
    #[inline(always)]
    pub fn powi(self, n: i32) -> Expression<Unary<A>> {
        self.apply(|x| x.powi(n))
    }

    /// See [`Scalar::powf`].
    #[inline(always)]
    pub fn powf(self, p: f64) -> Expression<Unary<A>> {
        self.apply(|x| x.powf(p))
    }

    /// See [`Scalar::pow`].
    #[inline(always)]
    pub fn pow<B: Formula<Number = A::Number>>(self, p: Expression<B>) -> Expression<Binary<A, B>> {
        let [x, e] = Dual::variables([self.value(), p.value()]);
        let y = x.pow(e);
        let [in_x, in_p] = y.gradient();
        Expression(Binary { value: y.value(), slopes: (in_x, in_p), arguments: (self.0, p.0) })
    }
}

macro_rules! elementary {
    ($($name:ident),*) => {
        impl<A: Formula> Expression<A> {
            $(
                #[doc = concat!("See [`Scalar::", stringify!($name), "`].")]
                #[inline(always)]
                pub fn $name(self) -> Expression<Unary<A>> {
                    self.apply(Scalar::$name)
                }
            )*
        }
    };
}
elementary!(exp, exp_m1, ln, ln_1p, sqrt, square, recip, sin, cos, tanh, abs, logistic, softplus);

impl<A: Formula> Parameter for Expression<A> {
    #[inline(always)]
    fn number(self) -> f64 {
        self.value()
    }
}

impl<S: Scalar, A: Formula<Number = Real<S>>> Datum<Real<S>> for Expression<A> {
    const SHARED: bool = A::SHARED;
    const NUMBERS: usize = A::NUMBERS;

    #[inline(always)]
    fn lift(&self) -> Real<S> {
        self.close()
    }

    #[inline(always)]
    fn spread(&self, weight: f64, f: &mut impl FnMut(Real<S>, f64)) {
        self.0.spread(weight, f);
    }

    #[inline(always)]
    fn settle(&self, weight: f64, f: &mut impl FnMut(Real<S>, f64)) {
        self.0.settle(weight, f);
    }
}

impl<A: Formula> Recordable for Expression<A> {
    fn shape(&self) -> Vec<usize> {
        Vec::new()
    }

    fn flatten(&self, out: &mut Vec<f64>) {
        out.push(self.value());
    }
}

impl<A: Formula> Neg for Expression<A> {
    type Output = Expression<Unary<A>>;

    #[inline(always)]
    fn neg(self) -> Self::Output {
        self.unary(-self.value(), -1.0)
    }
}

/// Implements an operator between formulas, and between a formula and a datum, a scalar, or a reference to a
/// scalar.
macro_rules! arithmetic {
    ($Op:ident, $op:ident, |$a:ident, $b:ident| $rule:expr) => {
        impl<A: Formula, B: Formula<Number = A::Number>> $Op<Expression<B>> for Expression<A> {
            type Output = Expression<Binary<A, B>>;
            #[inline(always)]
            fn $op(self, other: Expression<B>) -> Self::Output {
                let ($a, $b) = (self.value(), other.value());
                let (value, da, db) = $rule;
                Expression(Binary { value, slopes: (da, db), arguments: (self.0, other.0) })
            }
        }
        impl<A: Formula> $Op<f64> for Expression<A> {
            type Output = Expression<Unary<A>>;
            #[inline(always)]
            fn $op(self, other: f64) -> Self::Output {
                let ($a, $b) = (self.value(), other);
                let (value, da, _) = $rule;
                self.unary(value, da)
            }
        }
        impl<A: Formula> $Op<Expression<A>> for f64 {
            type Output = Expression<Unary<A>>;
            #[inline(always)]
            fn $op(self, other: Expression<A>) -> Self::Output {
                let ($a, $b) = (self, other.value());
                let (value, _, db) = $rule;
                other.unary(value, db)
            }
        }
        arithmetic!(@as $Op, $op, [A: Formula], Expression<A>, &f64, Unary<A>, |a, b| (a, *b));
        arithmetic!(@as $Op, $op, [A: Formula], &f64, Expression<A>, Unary<A>, |a, b| (*a, b));
        arithmetic!(@as $Op, $op, [S: Scalar, A: Formula<Number = Real<S>>], Expression<A>, Real<S>,
            Binary<A, Real<S>>, |a, b| (a, Expression(b)));
        arithmetic!(@as $Op, $op, [S: Scalar, A: Formula<Number = Real<S>>], Expression<A>, &Real<S>,
            Binary<A, Real<S>>, |a, b| (a, Expression(*b)));
        arithmetic!(@as $Op, $op, [S: Scalar, A: Formula<Number = Real<S>>], Real<S>, Expression<A>,
            Binary<Real<S>, A>, |a, b| (Expression(a), b));
        arithmetic!(@as $Op, $op, [S: Scalar, A: Formula<Number = Real<S>>], &Real<S>, Expression<A>,
            Binary<Real<S>, A>, |a, b| (Expression(*a), b));
    };
    (@as $Op:ident, $op:ident, [$($generics:tt)*], $Left:ty, $Right:ty, $Formula:ty,
     |$a:ident, $b:ident| ($left:expr, $right:expr)) => {
        impl<$($generics)*> $Op<$Right> for $Left {
            type Output = Expression<$Formula>;
            #[inline(always)]
            fn $op(self, $b: $Right) -> Self::Output {
                let $a = self;
                $Op::$op($left, $right)
            }
        }
    };
}
arithmetic!(Add, add, |a, b| (a + b, 1.0, 1.0));
arithmetic!(Sub, sub, |a, b| (a - b, 1.0, -1.0));
arithmetic!(Mul, mul, |a, b| (a * b, b, a));
arithmetic!(Div, div, |a, b| (a / b, 1.0 / b, -a / (b * b)));

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares a formula that contains every operation with the same computation on dual numbers.
    #[test]
    fn formulas_are_differentiated_exactly() {
        type R = Real<Dual<3>>;
        const HALF: &f64 = &0.5;
        fn plain([x, y, z]: [R; 3]) -> R {
            (x * 2.0 - 1.0 / y + HALF * z).exp() / (3.0 + y.pow(x)) - (-z).powi(3).logistic()
                + (x + y) * (y - z).sqrt()
        }
        fn formula([a, b, c]: [R; 3]) -> R {
            let [x, y, z] = [a, b, c].map(Expression);
            let f = (x * 2.0 - 1.0 / y + HALF * z).exp() / (3.0 + y.pow(x))
                - (-z).powi(3).logistic()
                + (x + y) * (b - z).sqrt();
            f.close()
        }
        let point = Dual::variables([0.7, 1.9, -0.4]).map(Real);
        let (expected, computed) = (plain(point), formula(point));
        approx::assert_relative_eq!(computed.value(), expected.value(), max_relative = 1e-15);
        for (e, f) in expected.0.gradient().iter().zip(computed.0.gradient()) {
            approx::assert_relative_eq!(*e, f, max_relative = 1e-13);
        }
    }
}
