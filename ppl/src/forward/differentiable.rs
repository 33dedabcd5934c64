//! User-defined functions with derivatives.

use crate::density::DomainError;
use crate::number::scalar::Scalar;

/// A function ℝᴰ → ℝᴹ with an exact Jacobian; inside `model!` it is a single operation.
///
/// # Example
/// ```
/// use ppl::{Differentiable, DomainError};
///
/// /// Spring force and stored energy at stiffness k and stretch s.
/// struct Spring;
/// impl Differentiable<2, 2> for Spring {
///     fn value_and_jacobian(
///         &self,
///         &[k, s]: &[f64; 2],
///     ) -> Result<([f64; 2], [[f64; 2]; 2]), DomainError> {
///         if s < 0.0 {
///             return Err(DomainError::new(format!("stretch must be ≥ 0, got {s}")));
///         }
///         Ok(([k * s, 0.5 * k * s * s], [[s, k], [0.5 * s * s, k * s]]))
///     }
/// }
/// assert_eq!(Spring.at([2.0, 3.0]), [6.0, 9.0]);
/// assert!(Spring.at([2.0, -3.0])[0].is_nan());
/// ```
pub trait Differentiable<const D: usize, const M: usize>: Sync {
    /// Value and Jacobian `jacobian[m][d]` = ∂fₘ/∂x_d.
    ///
    /// # Errors
    /// [`DomainError`] if the function is undefined at `x`.
    fn value_and_jacobian(&self, x: &[f64; D]) -> Result<([f64; M], [[f64; D]; M]), DomainError>;

    /// Value only; override this method if the value is cheaper than value and Jacobian together.
    ///
    /// # Errors
    /// [`DomainError`] if the function is undefined at `x`.
    fn value(&self, x: &[f64; D]) -> Result<[f64; M], DomainError> {
        self.value_and_jacobian(x).map(|(value, _)| value)
    }

    /// Evaluates the function for any [`Scalar`] type.
    ///
    /// # Errors
    /// [`DomainError`] if the function is undefined at `x`. Inside `model!`, `f.try_at(x)?` converts the error into a
    /// rejection of the point with the same message.
    #[inline(always)]
    fn try_at<S: Scalar>(&self, x: [S; D]) -> Result<[S; M], DomainError>
    where
        Self: Sized,
    {
        let point = x.map(Scalar::value);
        if !S::DIFFERENTIABLE {
            return Ok(self.value(&point)?.map(S::from));
        }
        let (value, jacobian) = self.value_and_jacobian(&point)?;
        Ok(S::fuse_all(value, x, jacobian))
    }

    /// Version of [`try_at`](Differentiable::try_at) that returns NaN if the function is undefined at `x`; a model
    /// that uses the NaN rejects the point.
    #[inline(always)]
    fn at<S: Scalar>(&self, x: [S; D]) -> [S; M]
    where
        Self: Sized,
    {
        let point = x.map(Scalar::value);
        if !S::DIFFERENTIABLE {
            return self.value(&point).unwrap_or([f64::NAN; M]).map(S::from);
        }
        // use `fuse_all` also if the function is undefined: the result is then always on the tape, and later
        // operations need no check
        let outside = ([f64::NAN; M], [[0.0; D]; M]);
        let (value, jacobian) = self.value_and_jacobian(&point).unwrap_or(outside);
        S::fuse_all(value, x, jacobian)
    }
}

impl<F: Differentiable<D, M>, const D: usize, const M: usize> Differentiable<D, M> for &F {
    fn value_and_jacobian(&self, x: &[f64; D]) -> Result<([f64; M], [[f64; D]; M]), DomainError> {
        (**self).value_and_jacobian(x)
    }

    fn value(&self, x: &[f64; D]) -> Result<[f64; M], DomainError> {
        (**self).value(x)
    }
}

/// A function ℝᵈ → ℝᵐ with an exact Jacobian and with sizes known only at run time, for example if a file lists the
/// parameters and quantities. [`Differentiable`] is several times faster.
///
/// # Example
/// ```
/// use ppl::{DomainError, DynDifferentiable, Dual, Scalar};
///
/// /// Sum and product of the arguments.
/// struct SumAndProduct;
/// impl DynDifferentiable for SumAndProduct {
///     fn outputs(&self) -> usize {
///         2
///     }
///     fn value_and_jacobian(&self, x: &[f64]) -> Result<(Vec<f64>, Vec<Vec<f64>>), DomainError> {
///         let product: f64 = x.iter().product();
///         let slopes = x.iter().map(|x| product / x).collect();
///         Ok((vec![x.iter().sum(), product], vec![vec![1.0; x.len()], slopes]))
///     }
/// }
/// let [sum, product] = SumAndProduct.at(&Dual::variables([2.0, 3.0, 4.0]))[..] else { panic!() };
/// assert_eq!((sum.value(), sum.gradient()), (9.0, [1.0, 1.0, 1.0]));
/// assert_eq!((product.value(), product.gradient()), (24.0, [12.0, 8.0, 6.0]));
/// ```
pub trait DynDifferentiable: Sync {
    /// Number m of outputs.
    fn outputs(&self) -> usize;

    /// Value and Jacobian `jacobian[m][d]` = ∂fₘ/∂x_d.
    ///
    /// # Errors
    /// [`DomainError`] if the function is undefined at `x`, or if the number of arguments is wrong.
    fn value_and_jacobian(&self, x: &[f64]) -> Result<(Vec<f64>, Vec<Vec<f64>>), DomainError>;

    /// Value only; override this method if the value is cheaper than value and Jacobian together.
    ///
    /// # Errors
    /// [`DomainError`] as in [`value_and_jacobian`](Self::value_and_jacobian).
    fn value(&self, x: &[f64]) -> Result<Vec<f64>, DomainError> {
        self.value_and_jacobian(x).map(|(value, _)| value)
    }

    /// Evaluates the function for any [`Scalar`] type.
    ///
    /// # Errors
    /// [`DomainError`] if the function is undefined at `x`. Inside `model!`, `f.try_at(&x)?` converts the error into
    /// a rejection of the point with the same message.
    fn try_at<S: Scalar>(&self, x: &[S]) -> Result<Vec<S>, DomainError>
    where
        Self: Sized,
    {
        let point: Vec<f64> = x.iter().map(|x| x.value()).collect();
        if !S::DIFFERENTIABLE {
            return Ok(self.value(&point)?.into_iter().map(S::from).collect());
        }
        let (value, jacobian) = self.value_and_jacobian(&point)?;
        let outputs = value.into_iter().zip(jacobian);
        Ok(outputs.map(|(v, row)| S::fuse_iter(v, x.iter().copied().zip(row))).collect())
    }

    /// Version of [`try_at`](Self::try_at) that returns NaN if the function is undefined at `x`; a model that uses
    /// the NaN rejects the point.
    fn at<S: Scalar>(&self, x: &[S]) -> Vec<S>
    where
        Self: Sized,
    {
        self.try_at(x).unwrap_or_else(|_| vec![S::from(f64::NAN); self.outputs()])
    }
}
