//! Functions that have no derivatives of their own.

use crate::density::DomainError;
use crate::differentiable::Differentiable;

/// A black box ℝᴰ → ℝᴹ as a [`Differentiable`], its Jacobian by central differences.
///
/// `(f(x + h eᵢ) − f(x − h eᵢ))/2h` for each argument, with a step h of its own in the argument's
/// unit: 2 D + 1 calls for value and Jacobian. The error is h²/6 · |f‴| of truncation and about
/// δ/h of what the function itself is uncertain by, δ (its tolerance, or 10⁻¹⁶ |f| of rounding);
/// both are least near h = ∛(3δ/|f‴|), which is 10⁻⁵ of the scale on which a smooth function bends,
/// and more for a solver with a loose tolerance. Where only one of the two points lies in the domain,
/// as at a bound, the difference is one-sided, with an error of h/2 · |f″|.
///
/// Draws are those of the density whatever the error, since values are exact; a Jacobian that is
/// off lets energies drift, and NUTS takes smaller steps. A function that knows its derivatives
/// (by hand, an adjoint, or a surrogate of it) is better: implement [`Differentiable`] there.
///
/// # Example
/// ```
/// use ppl::prelude::*;
/// use ppl::{DomainError, FiniteDifference};
///
/// /// A simulation that cannot be looked into: deflection in mm at a stiffness in N/mm, a load in N.
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
    /// With a step for each argument, in the argument's unit.
    ///
    /// # Errors
    /// [`DomainError`] unless every step is positive and finite.
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
            // the points as they are after rounding
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
