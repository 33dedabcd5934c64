//! Normal approximation at the mode.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rand::Rng;
use rand_distr::StandardNormal;

use super::{
    curvature::negative_hessian,
    error::OptimizeError,
    map::{Map, Mode},
};
use crate::density::LogDensity;
use crate::model::erased::ErasedDensity;

/// Normal approximation of a density at its mode in unconstrained space (Laplace approximation).
///
/// The approximation is `Normal(ŷ, H⁻¹)`, where H is the Hessian of −ln p at the mode ŷ, computed by central
/// differences of the gradient. The density includes the log-Jacobians, so that ŷ differs from the point of
/// [`Map::find`].
///
/// # Example
/// ```
/// # struct Parabola;
/// # impl ppl::LogDensity for Parabola {
/// #     type Workspace = ();
/// #     fn dim(&self) -> usize { 1 }
/// #     fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, ppl::Rejection> { Ok(-2.0 * y[0] * y[0]) }
/// #     fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, ppl::Rejection> { g[0] = -4.0 * y[0]; self.log_density(y, w) }
/// # }
/// let laplace = ppl::Laplace::new(&Parabola, &ppl::Map::default())?;   // ln p = −2 y²
/// assert!((laplace.covariance[(0, 0)] - 0.25).abs() < 1e-6);
/// # Ok::<(), ppl::OptimizeError>(())
/// ```
///
/// Reference: Tierney & Kadane, JASA 81 (1986) 82, doi:10.1080/01621459.1986.10478240.
#[derive(Clone, Debug)]
pub struct Laplace {
    /// Mode of the density with Jacobians.
    pub mode: Mode,
    /// Covariance `H⁻¹`, d × d.
    pub covariance: DMatrix<f64>,
    /// Approximation `ln p(ŷ) + (d/2) ln 2π − ½ ln det H` of ln ∫ p. This is the log evidence if the joint density of
    /// data and unknowns is normalised, as for a model without `factor` terms.
    pub log_evidence: f64,
    precision: Cholesky<f64, Dyn>,
}

impl Laplace {
    /// Finds the mode with `search` and computes the normal approximation there.
    ///
    /// # Errors
    /// [`OptimizeError`], in particular if the density is not concave at the mode.
    pub fn new<D: LogDensity>(density: &D, search: &Map) -> Result<Self, OptimizeError> {
        Self::at_mode(density, search.run(density)?)
    }

    fn at_mode(density: &dyn ErasedDensity, mode: Mode) -> Result<Self, OptimizeError> {
        let hessian = negative_hessian(&mut *density.evaluator(), &mode.point).map_err(Box::new)?;
        let Some(precision) = Cholesky::new(hessian).filter(|_| mode.at_bound.is_empty()) else {
            return Err(OptimizeError::NotConcave { at_bound: mode.at_bound });
        };
        let d = mode.point.len() as f64;
        let log_evidence = mode.log_density + 0.5 * d * std::f64::consts::TAU.ln()
            - precision.l_dirty().diagonal().map(f64::ln).sum();
        Ok(Self { covariance: precision.inverse(), log_evidence, precision, mode })
    }

    /// Draws from the normal approximation, in unconstrained space.
    pub fn draw<R: Rng + ?Sized>(&self, rng: &mut R) -> Vec<f64> {
        let mut z = DVector::from_fn(self.mode.point.len(), |_, _| rng.sample(StandardNormal));
        // H = L Lᵀ, so that L⁻ᵀ z has covariance H⁻¹; the solve cannot fail, because the diagonal of L is positive
        self.precision.l_dirty().tr_solve_lower_triangular_mut(&mut z);
        z.iter().zip(&self.mode.point).map(|(z, y)| y + z).collect()
    }
}
