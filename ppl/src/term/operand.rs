//! Traits by which generated code handles values whose types the macro does not know.

use crate::density::Rejection;
use crate::density::site::Site;
use crate::number::real::Real;
use crate::number::scalar::Scalar;
use crate::term::formula::{Expression, Formula};
use crate::term::plate::{Kept, Open, OpenSummed, Sum, Summed, Sums};

/// Wrapper for an operand or a result of arithmetic whose type the macro does not know.
///
/// Scalars of the model are converted to formulas and back; all other values stay unchanged. In
/// `(&Of(&x)).operand()`, the compiler selects the method of [`Number`] before the method of [`Other`], because the
/// method of `Number` needs one reference less.
#[derive(Debug)]
pub struct Of<'a, T: ?Sized>(pub &'a T);

/// A scalar of the model.
pub trait Number {
    /// Type of the operand in a formula.
    type Operand;
    /// Type of the value.
    type Value;

    /// Converts the scalar or formula to an operand.
    fn operand(&self) -> Self::Operand;

    /// Converts the formula to a scalar.
    fn closed(&self) -> Self::Value;

    /// Converts the value to an operand. Returns an error if the value is a dot product of vectors with different
    /// lengths.
    ///
    /// # Errors
    /// A fatal error with both lengths.
    #[inline(always)]
    fn same_length(&self, site: &Site) -> Result<Self::Operand, Rejection> {
        match self.lengths() {
            Some([data, scalars]) if data != scalars => Err(site.other_lengths(data, scalars)),
            _ => Ok(self.operand()),
        }
    }

    /// Lengths of the two vectors if the value is a dot product; otherwise `None`.
    #[inline(always)]
    fn lengths(&self) -> Option<[usize; 2]> {
        None
    }
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

impl<A: Formula> Number for Of<'_, Expression<A>> {
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

    #[inline(always)]
    fn lengths(&self) -> Option<[usize; 2]> {
        self.0.0.lengths()
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

/// Any value that is not a scalar of the model.
pub trait Other {
    /// Type of the value.
    type Same;

    /// The unchanged value.
    fn operand(&self) -> Self::Same;

    /// The unchanged value.
    fn closed(&self) -> Self::Same;

    /// The unchanged value.
    ///
    /// # Errors
    /// Never returns an error.
    #[inline(always)]
    fn same_length(&self, _: &Site) -> Result<Self::Same, Rejection> {
        Ok(self.operand())
    }
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

impl<'a, A: Formula> Number for Of<'a, Open<A>> {
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
        self.0.scalars
    }

    #[inline(always)]
    fn closed(&self) -> [Real<S>; N] {
        self.0.scalars
    }
}

/// Scalars from outside a plate (a `for` loop of the model), whose adjoints are summed separately over the
/// iterations.
pub trait Apart {
    /// The scalar together with the sum of its adjoint.
    type Sum;

    /// Creates an empty sum for the adjoint of the scalar.
    fn sum(&self) -> Self::Sum;
}

impl<S: Scalar> Apart for Of<'_, Real<S>> {
    type Sum = Sum<Real<S>>;

    #[inline(always)]
    fn sum(&self) -> Sum<Real<S>> {
        Sum::new(*self.0)
    }
}

impl<A: Formula> Apart for Of<'_, Expression<A>> {
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

impl<S: Scalar, const N: usize> Apart for Of<'_, &[Real<S>; N]> {
    type Sum = Sums<S, N>;

    #[inline(always)]
    fn sum(&self) -> Sums<S, N> {
        Sums::new(**self.0)
    }
}

/// Any value from outside a loop of the model whose adjoint is not summed separately, such as data.
pub trait Together<'a> {
    /// Type of the value.
    type Kept: ?Sized;

    /// The unchanged value.
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

#[cfg(test)]
mod tests {
    use super::*;

    // the test has the same form as generated code, which always borrows
    #[allow(clippy::needless_borrow)]
    #[test]
    fn what_is_no_number_stays_as_it_is() {
        let x = Real(2.0);
        let formula = (&Of(&x)).operand() * 3.0;
        assert_eq!((&Of(&formula)).closed().value(), 6.0);
        assert_eq!((&Of(&7usize)).operand() - 1, 6);
        assert_eq!((&Of(&2.5)).closed(), 2.5);
    }
}
