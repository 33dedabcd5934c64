//! Derivatives of black-box functions by finite differences.

use crate::density::DomainError;
use crate::forward::differentiable::Differentiable;

/// A black-box function ℝᴰ → ℝᴹ as a [`Differentiable`], with the Jacobian from central differences.
///
/// The derivative with respect to argument i is `(f(x + h eᵢ) − f(x − h eᵢ))/2h`. Each argument has its own step h,
/// in the unit of the argument. Value and Jacobian need 2 D + 1 calls. The truncation error is h²/6 · |f‴|. If the
/// function has an uncertainty δ (a solver tolerance, or 10⁻¹⁶ |f| of rounding), the derivative has a further error
/// of about δ/h. The sum of both errors is smallest near h = ∛(3δ/|f‴|). For a smooth function, this step is about
/// 10⁻⁵ of the length over which the slope changes; for a solver with a loose tolerance, it is larger. If only one of
/// the two points lies in the domain, as at a bound, the difference is one-sided, with an error of h/2 · |f″|.
///
/// Errors of the Jacobian do not bias the draws, because the values are exact. These errors make the energy drift
/// along a trajectory, so that NUTS uses smaller steps. If derivatives are available (analytical, by an adjoint, or
/// from a surrogate), implement [`Differentiable`] instead.
///
/// # Example
/// ```
/// use ppl::prelude::*;
/// use ppl::{DomainError, FiniteDifference};
///
/// /// A black-box simulation: deflection in mm for a stiffness in N/mm and a load in N.
/// fn simulate(&[stiffness, load]: &[f64; 2]) -> Result<[f64; 1], DomainError> {
///     DomainError::require_positive("simulate", "stiffness", stiffness)?;
///     Ok([load / stiffness])
/// }
///
/// ppl::model! {
///     fn deflections<F: Differentiable<2, 1>>(forward: &F, load_n: &[f64], measured_mm: &[f64]) {
///         let stiffness ~ LogNormal(1.0, 0.5);
///         for (load, y) in load_n.iter().zip(measured_mm) {
///             let [mean] = forward.try_at([stiffness, load.into()])?;
///             y ~ Normal(mean, 0.1);
///         }
///     }
/// }
///
/// let forward = FiniteDifference::new(simulate, [1e-5, 1e-5])?;
/// let (value, jacobian) = forward.value_and_jacobian(&[2.0, 3.0])?;
/// assert_eq!(value, [1.5]);
/// assert!((jacobian[0][0] + 0.75).abs() < 1e-9);
/// let model = deflections(&forward, &[1.0, 2.0], &[0.4, 0.7]);
/// assert_eq!(model.layout()?.dim, 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct FiniteDifference<F, const D: usize> {
    function: F,
    steps: [f64; D],
}

impl<F, const D: usize> FiniteDifference<F, D> {
    /// Creates the function with one difference step per argument, in the unit of the argument.
    ///
    /// # Errors
    /// [`DomainError`] if a step is not positive and finite.
    pub fn new(function: F, steps: [f64; D]) -> Result<Self, DomainError> {
        for (i, step) in steps.into_iter().enumerate() {
            let name = format_args!("step[{i}]");
            DomainError::require_positive("FiniteDifference", name, step)?;
        }
        Ok(Self { function, steps })
    }
}

impl<F, const D: usize, const M: usize> Differentiable<D, M> for FiniteDifference<F, D>
where
    F: Fn(&[f64; D]) -> Result<[f64; M], DomainError> + Sync,
{
    fn value_and_jacobian(&self, x: &[f64; D]) -> Result<([f64; M], [[f64; D]; M]), DomainError> {
        let value = (self.function)(x)?;
        let mut jacobian = [[0.0; D]; M];
        for (d, step) in self.steps.into_iter().enumerate() {
            let at = |offset: f64| {
                let mut point = *x;
                point[d] += offset;
                (point[d], (self.function)(&point))
            };
            // divide by the difference of the points after rounding, which can differ from 2h
            let ((high, above), (low, below)) = (at(step), at(-step));
            let (high, above, low, below) = match (above, below) {
                (Ok(above), Ok(below)) => (high, above, low, below),
                (Ok(above), Err(_)) => (high, above, x[d], value),
                (Err(_), Ok(below)) => (x[d], value, low, below),
                (Err(error), Err(_)) => return Err(error),
            };
            for m in 0..M {
                jacobian[m][d] = (above[m] - below[m]) / (high - low);
            }
        }
        Ok((value, jacobian))
    }

    fn value(&self, x: &[f64; D]) -> Result<[f64; M], DomainError> {
        (self.function)(x)
    }
}
