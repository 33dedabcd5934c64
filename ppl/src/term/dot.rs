//! Linear predictors.

use std::fmt::Debug;

use crate::number::real::Real;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::term::formula::{Expression, Formula, closed};

/// Second argument of [`dot`]: a slice, array or vector of scalars.
pub trait Numbers: Debug {
    /// Scalar type of the evaluation context, without the wrapper [`Real`].
    type Scalar: Scalar;

    /// The scalars.
    fn numbers(&self) -> &[Real<Self::Scalar>];

    /// Scalar `i`, which can sum its adjoint itself.
    ///
    /// # Panics
    /// If there is no such scalar.
    #[inline(always)]
    fn element(&self, i: usize) -> impl Datum<Real<Self::Scalar>> {
        self.numbers()[i]
    }
}

impl<S: Scalar> Numbers for [Real<S>] {
    type Scalar = S;

    #[inline(always)]
    fn numbers(&self) -> &[Real<S>] {
        self
    }
}

impl<S: Scalar, const N: usize> Numbers for [Real<S>; N] {
    type Scalar = S;

    #[inline(always)]
    fn numbers(&self) -> &[Real<S>] {
        self
    }
}

impl<S: Scalar> Numbers for Vec<Real<S>> {
    type Scalar = S;

    #[inline(always)]
    fn numbers(&self) -> &[Real<S>] {
        self
    }
}

impl<T: Numbers + ?Sized> Numbers for &T {
    type Scalar = T::Scalar;

    #[inline(always)]
    fn numbers(&self) -> &[Real<T::Scalar>] {
        (**self).numbers()
    }

    #[inline(always)]
    fn element(&self, i: usize) -> impl Datum<Real<T::Scalar>> {
        (**self).element(i)
    }
}

/// The sum Σ dᵢ xᵢ over data dᵢ and scalars xᵢ; see [`dot`].
#[derive(Debug)]
pub struct Dot<'a, N: ?Sized> {
    value: f64,
    data: &'a [f64],
    scalars: &'a N,
}

impl<N: ?Sized> Clone for Dot<'_, N> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<N: ?Sized> Copy for Dot<'_, N> {}

impl<N: Numbers + ?Sized> Formula for Dot<'_, N> {
    type Number = Real<N::Scalar>;

    #[inline(always)]
    fn result(self) -> f64 {
        self.value
    }

    #[inline(always)]
    fn lengths(self) -> Option<[usize; 2]> {
        Some([self.data.len(), self.scalars.numbers().len()])
    }
}

impl<N: Numbers + ?Sized> Datum<Real<N::Scalar>> for Dot<'_, N> {
    #[inline(always)]
    fn lift(&self) -> Real<N::Scalar> {
        closed(*self)
    }

    #[inline(always)]
    fn spread(&self, weight: f64, f: &mut impl FnMut(Real<N::Scalar>, f64)) {
        for (d, x) in self.data.iter().zip(self.scalars.numbers()) {
            f(*x, weight * d);
        }
    }

    #[inline(always)]
    fn settle(&self, weight: f64, f: &mut impl FnMut(Real<N::Scalar>, f64)) {
        let length = self.scalars.numbers().len();
        for (i, d) in self.data.iter().enumerate().take(length) {
            self.scalars.element(i).settle(weight * d, f);
        }
    }
}

/// Linear predictor Σ dᵢ xᵢ of data dᵢ and unknowns xᵢ, as a single operation. NaN if their lengths differ.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     fn regression(rows: &[[f64; 3]], y: &[f64]) {
///         let intercept ~ Normal(0.0, 10.0);
///         let slope ~ Normal(0.0, 2.5).array::<3>();
///         let sd ~ HalfNormal(1.0);
///         for (row, y) in rows.iter().zip(y) {
///             y ~ Normal(intercept + dot(row, &slope), sd);
///         }
///     }
/// }
/// assert_eq!(regression(&[[1.0, 0.5, -1.0]], &[0.3]).layout()?.dim, 5);
/// # Ok::<(), ppl::ModelError>(())
/// ```
#[inline(always)]
pub fn dot<'a, N>(data: &'a [f64], scalars: &'a N) -> Expression<Dot<'a, N>>
where
    N: Numbers + ?Sized,
{
    let unknowns = scalars.numbers();
    let mut value = f64::NAN;
    if data.len() == unknowns.len() {
        value = 0.0;
        for i in 0..unknowns.len() {
            value += data[i] * unknowns[i].value();
        }
    }
    Expression(Dot { value, data, scalars })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::dual::Dual;

    #[test]
    fn dot_has_its_gradient_and_refuses_lengths() {
        let x = Dual::variables([0.7, 1.9]).map(Real);
        let product = dot(&[2.0, -1.0], &x);
        assert_eq!(product.close().0.gradient(), [2.0, -1.0]);
        assert!(dot(&[1.0], &x).value().is_nan());
    }
}
