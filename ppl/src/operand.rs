//! What generated code asks of names whose types the macro does not know.

use crate::accumulator::{Kept, Open, OpenSummed, Sum, Summed, Sums};
use crate::expression::{Expression, Node};
use crate::real::Real;
use crate::scalar::Scalar;

/// What generated code asks of an operand or of the result of arithmetic, whose type the macro
/// does not know: numbers of the model become formulas and back, everything else stays as it is.
/// `(&Of(&x)).operand()` finds [`Number`] before [`Other`], since that takes one reference less.
#[derive(Debug)]
pub struct Of<'a, T: ?Sized>(pub &'a T);

/// A number of the model.
pub trait Number {
    /// As the operand of a formula.
    type Operand;
    /// As a value.
    type Value;

    /// The number or formula as an operand.
    fn operand(&self) -> Self::Operand;

    /// The formula as a number.
    fn closed(&self) -> Self::Value;
}

impl<S: Scalar> Number for Of<'_, Real<S>> {
    type Operand = Expression<Real<S>>;
    type Value = Real<S>;

    #[inline(always)]
    fn operand(&self) -> Expression<Real<S>> {
        Expression(*self.0)
    }

    #[inline(always)]
    fn closed(&self) -> Real<S> {
        *self.0
    }
}

impl<A: Node> Number for Of<'_, Expression<A>> {
    type Operand = Expression<A>;
    type Value = A::Number;

    #[inline(always)]
    fn operand(&self) -> Expression<A> {
        *self.0
    }

    #[inline(always)]
    fn closed(&self) -> A::Number {
        self.0.close()
    }
}

impl<'a, S: Scalar> Number for Of<'_, &'a Real<S>> {
    type Operand = Expression<Real<S>>;
    type Value = &'a Real<S>;

    #[inline(always)]
    fn operand(&self) -> Expression<Real<S>> {
        Expression(**self.0)
    }

    #[inline(always)]
    fn closed(&self) -> &'a Real<S> {
        self.0
    }
}

/// Anything else.
pub trait Other {
    /// Its type.
    type Same;

    /// As it is.
    fn operand(&self) -> Self::Same;

    /// As it is.
    fn closed(&self) -> Self::Same;
}

impl<T: Clone> Other for &Of<'_, T> {
    type Same = T;

    #[inline(always)]
    fn operand(&self) -> T {
        self.0.clone()
    }

    #[inline(always)]
    fn closed(&self) -> T {
        self.0.clone()
    }
}

impl<S: Scalar, const N: usize> Number for Of<'_, [Real<S>; N]> {
    type Operand = [Real<S>; N];
    type Value = [Real<S>; N];

    #[inline(always)]
    fn operand(&self) -> [Real<S>; N] {
        *self.0
    }

    #[inline(always)]
    fn closed(&self) -> [Real<S>; N] {
        *self.0
    }
}

impl<'a, S: Scalar> Number for Of<'a, Sum<Real<S>>> {
    type Operand = Expression<Summed<'a, Real<S>>>;
    type Value = Real<S>;

    #[inline(always)]
    fn operand(&self) -> Self::Operand {
        Expression(self.0.part())
    }

    #[inline(always)]
    fn closed(&self) -> Real<S> {
        self.0.number
    }
}

impl<'a, A: Node> Number for Of<'a, Open<A>> {
    type Operand = Expression<OpenSummed<'a, A>>;
    type Value = A::Number;

    #[inline(always)]
    fn operand(&self) -> Self::Operand {
        Expression(self.0.part())
    }

    #[inline(always)]
    fn closed(&self) -> A::Number {
        self.0.formula.close()
    }
}

impl<S: Scalar, const N: usize> Number for Of<'_, Sums<S, N>> {
    type Operand = [Real<S>; N];
    type Value = [Real<S>; N];

    #[inline(always)]
    fn operand(&self) -> [Real<S>; N] {
        self.0.numbers
    }

    #[inline(always)]
    fn closed(&self) -> [Real<S>; N] {
        self.0.numbers
    }
}

/// Numbers from outside a plate, whose adjoints are summed up apart while it runs.
pub trait Apart {
    /// The number with the sum.
    type Sum;

    /// An empty sum.
    fn sum(&self) -> Self::Sum;
}

impl<S: Scalar> Apart for Of<'_, Real<S>> {
    type Sum = Sum<Real<S>>;

    #[inline(always)]
    fn sum(&self) -> Sum<Real<S>> {
        Sum::new(*self.0)
    }
}

impl<A: Node> Apart for Of<'_, Expression<A>> {
    type Sum = Open<A>;

    #[inline(always)]
    fn sum(&self) -> Open<A> {
        Open::new(*self.0)
    }
}

impl<S: Scalar, const N: usize> Apart for Of<'_, [Real<S>; N]> {
    type Sum = Sums<S, N>;

    #[inline(always)]
    fn sum(&self) -> Sums<S, N> {
        Sums::new(*self.0)
    }
}

/// Anything else.
pub trait Together<'a> {
    /// Its type.
    type Kept: ?Sized;

    /// As it is.
    fn sum(&self) -> Kept<'a, Self::Kept>;
}

impl<'a, T: ?Sized> Together<'a> for &Of<'a, T> {
    type Kept = T;

    #[inline(always)]
    fn sum(&self) -> Kept<'a, T> {
        Kept(self.0)
    }
}

impl<T: Clone> Number for Of<'_, Kept<'_, T>> {
    type Operand = T;
    type Value = T;

    #[inline(always)]
    fn operand(&self) -> T {
        self.0.0.clone()
    }

    #[inline(always)]
    fn closed(&self) -> T {
        self.0.0.clone()
    }
}

/// A coefficient of an unknown.
pub trait Coefficient {
    /// Its value.
    fn coefficient(&self) -> f64;
}

/// Where an unknown stands.
pub trait Place {
    /// Its index.
    fn place(&self) -> usize;
}

/// Anything else.
pub trait Unread {
    /// No number.
    fn coefficient(&self) -> f64 {
        f64::NAN
    }

    /// No index.
    fn place(&self) -> usize {
        usize::MAX
    }
}

macro_rules! read {
    ($Trait:ident, $method:ident, $Number:ty) => {
        impl $Trait for Of<'_, $Number> {
            #[inline(always)]
            fn $method(&self) -> $Number {
                *self.0
            }
        }

        impl $Trait for Of<'_, &$Number> {
            #[inline(always)]
            fn $method(&self) -> $Number {
                **self.0
            }
        }
    };
}
read!(Coefficient, coefficient, f64);
read!(Place, place, usize);

impl<T: ?Sized> Unread for &Of<'_, T> {}

#[cfg(test)]
mod tests {
    use super::*;

    // written as the macro writes it, whether or not the borrow is needed
    #[allow(clippy::needless_borrow)]
    #[test]
    fn what_is_no_number_stays_as_it_is() {
        let x = Real(2.0);
        let formula = (&Of(&x)).operand() * 3.0;
        assert_eq!((&Of(&formula)).closed().value(), 6.0);
        assert_eq!((&Of(&7usize)).operand() - 1, 6);
        assert_eq!((&Of(&2.5)).closed(), 2.5);
        assert_eq!(((&Of(&2.5)).coefficient(), (&Of(&&0.5)).coefficient()), (2.5, 0.5));
        assert_eq!(
            ((&Of(&7)).place(), (&Of(&&7)).place(), (&Of(&7u8)).place()),
            (7, 7, usize::MAX)
        );
        assert!((&Of(&x)).coefficient().is_nan());
    }
}
