//! Operators of scalar types with derivatives.

use std::ops::{Add, Div, Mul, Sub};

/// Arithmetic of a [`Scalar`](crate::Scalar) with a right-hand side of its own type, `f64` or `&f64`.
pub trait Arithmetic<Rhs = Self>:
    Sized
    + Add<Rhs, Output = Self>
    + Sub<Rhs, Output = Self>
    + Mul<Rhs, Output = Self>
    + Div<Rhs, Output = Self>
{
}

impl<S, Rhs> Arithmetic<Rhs> for S where
    S: Add<Rhs, Output = S> + Sub<Rhs, Output = S> + Mul<Rhs, Output = S> + Div<Rhs, Output = S>
{
}

/// Implements the operators of a scalar type with derivatives by `fuse`: with `f64` on either side, and with
/// references.
macro_rules! impl_arithmetic {
    ([$($generics:tt)*] $Number:ty) => {
        impl_arithmetic!(@op [$($generics)*] $Number, Add, add, AddAssign, add_assign,
            |a, b| (a + b, 1.0, 1.0));
        impl_arithmetic!(@op [$($generics)*] $Number, Sub, sub, SubAssign, sub_assign,
            |a, b| (a - b, 1.0, -1.0));
        impl_arithmetic!(@op [$($generics)*] $Number, Mul, mul, MulAssign, mul_assign,
            |a, b| (a * b, b, a));
        impl_arithmetic!(@op [$($generics)*] $Number, Div, div, DivAssign, div_assign,
            |a, b| (a / b, 1.0 / b, -a / (b * b)));

        impl<$($generics)*> std::ops::Neg for $Number {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                self.unary(-self.value(), -1.0)
            }
        }
        impl<$($generics)*> std::ops::Neg for &$Number {
            type Output = $Number;
            #[inline(always)]
            fn neg(self) -> $Number {
                -*self
            }
        }
        impl<$($generics)*> std::iter::Sum for $Number {
            fn sum<I: Iterator<Item = Self>>(terms: I) -> Self {
                terms.fold(Self::from(0.0), |total, term| total + term)
            }
        }
        impl<'a, $($generics)*> std::iter::Sum<&'a $Number> for $Number {
            fn sum<I: Iterator<Item = &'a Self>>(terms: I) -> Self {
                terms.copied().sum()
            }
        }
        impl<$($generics)*> PartialEq for $Number {
            #[inline(always)]
            fn eq(&self, other: &Self) -> bool {
                self.value() == other.value()
            }
        }
        impl<$($generics)*> PartialOrd for $Number {
            #[inline(always)]
            fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
                self.value().partial_cmp(&other.value())
            }
        }
        impl<$($generics)*> PartialEq<f64> for $Number {
            #[inline(always)]
            fn eq(&self, other: &f64) -> bool {
                self.value() == *other
            }
        }
        impl<$($generics)*> PartialOrd<f64> for $Number {
            #[inline(always)]
            fn partial_cmp(&self, other: &f64) -> Option<std::cmp::Ordering> {
                self.value().partial_cmp(other)
            }
        }
        impl<$($generics)*> $crate::quantity::datum::Datum<$Number> for $Number {
            const NUMBERS: usize = 1;

            #[inline(always)]
            fn lift(&self) -> $Number {
                *self
            }
        }
    };
    (@op [$($generics:tt)*] $Number:ty, $Op:ident, $op:ident, $Assign:ident, $assign:ident,
     |$a:ident, $b:ident| $rule:expr) => {
        impl<$($generics)*> std::ops::$Op for $Number {
            type Output = Self;
            #[inline(always)]
            fn $op(self, other: Self) -> Self {
                let ($a, $b) = (self.value(), other.value());
                let (value, da, db) = $rule;
                Self::gather(value, ((self, da), (other, db)))
            }
        }
        impl<$($generics)*> std::ops::$Op<f64> for $Number {
            type Output = Self;
            #[inline(always)]
            fn $op(self, other: f64) -> Self {
                let ($a, $b) = (self.value(), other);
                let (value, da, _) = $rule;
                self.unary(value, da)
            }
        }
        impl_arithmetic!(@by_reference [$($generics)*] $Number, $Op, $op, $Number, &f64, |a, b| (a, *b));
        impl_arithmetic!(@by_reference [$($generics)*] $Number, $Op, $op, $Number, &$Number, |a, b| (a, *b));
        impl_arithmetic!(@by_reference [$($generics)*] $Number, $Op, $op, f64, &$Number, |a, b| (a, *b));
        impl_arithmetic!(@by_reference [$($generics)*] $Number, $Op, $op, &f64, $Number, |a, b| (*a, b));
        impl_arithmetic!(@by_reference [$($generics)*] $Number, $Op, $op, &f64, &$Number, |a, b| (*a, *b));
        impl_arithmetic!(@by_reference [$($generics)*] $Number, $Op, $op, &$Number, f64, |a, b| (*a, b));
        impl_arithmetic!(@by_reference [$($generics)*] $Number, $Op, $op, &$Number, &f64, |a, b| (*a, *b));
        impl_arithmetic!(@by_reference [$($generics)*] $Number, $Op, $op, &$Number, $Number, |a, b| (*a, b));
        impl_arithmetic!(@by_reference [$($generics)*] $Number, $Op, $op, &$Number, &$Number, |a, b| (*a, *b));
        impl<$($generics)*> std::ops::$Op<$Number> for f64 {
            type Output = $Number;
            #[inline(always)]
            fn $op(self, other: $Number) -> $Number {
                let ($a, $b) = (self, other.value());
                let (value, _, db) = $rule;
                other.unary(value, db)
            }
        }
        impl<$($generics)*> std::ops::$Assign for $Number {
            #[inline(always)]
            fn $assign(&mut self, other: Self) {
                *self = std::ops::$Op::$op(*self, other);
            }
        }
        impl<$($generics)*> std::ops::$Assign<f64> for $Number {
            #[inline(always)]
            fn $assign(&mut self, other: f64) {
                *self = std::ops::$Op::$op(*self, other);
            }
        }
        impl<$($generics)*> std::ops::$Assign<&$Number> for $Number {
            #[inline(always)]
            fn $assign(&mut self, other: &$Number) {
                *self = std::ops::$Op::$op(*self, *other);
            }
        }
    };
    (@by_reference [$($generics:tt)*] $Number:ty, $Op:ident, $op:ident, $A:ty, $B:ty,
     |$a:ident, $b:ident| ($left:expr, $right:expr)) => {
        impl<$($generics)*> std::ops::$Op<$B> for $A {
            type Output = $Number;
            #[inline(always)]
            fn $op(self, $b: $B) -> $Number {
                let $a = self;
                std::ops::$Op::$op($left, $right)
            }
        }
    };
}
pub(crate) use impl_arithmetic;
