//! The interface between models and samplers.

use rand::RngCore;

use crate::density::rejection::Rejection;

/// A log density on unconstrained space ℝᵈ.
///
/// [`Bound`](crate::Bound) implements this trait for every model. Implement it yourself for a density that is not a
/// model.
///
/// # Example
/// ```
/// use ppl::{LogDensity, Nuts, Rejection};
///
/// struct Normal;
/// impl LogDensity for Normal {
///     type Workspace = ();
///     fn dim(&self) -> usize {
///         1
///     }
///     fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
///         Ok(-0.5 * y[0] * y[0])
///     }
///     fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
///         g[0] = -y[0];
///         self.log_density(y, w)
///     }
/// }
///
/// ppl::check::gradient(&Normal, 7);
/// let run = Nuts::default().chains(2).warmup(300).draws(500).seed(7).run(&Normal)?;
/// assert_eq!(run.len(), 500);
/// # Ok::<(), ppl::SampleError>(())
/// ```
pub trait LogDensity: Sync {
    /// Scratch memory that evaluations reuse; one instance per thread.
    type Workspace: Default + Send;

    /// Dimension d of the space.
    fn dim(&self) -> usize;

    /// Log density at `y` (length d), including the log-Jacobians.
    ///
    /// # Errors
    /// [`Rejection`] if the density is zero or undefined at `y`.
    fn log_density(&self, y: &[f64], workspace: &mut Self::Workspace) -> Result<f64, Rejection>;

    /// Log density at `y`; the gradient is written to `gradient` (length d).
    ///
    /// # Errors
    /// [`Rejection`] if the density is zero or undefined at `y`.
    fn gradient(
        &self,
        y: &[f64],
        gradient: &mut [f64],
        workspace: &mut Self::Workspace,
    ) -> Result<f64, Rejection>;

    /// Draws a point from the prior, in unconstrained coordinates; returns `None` if the density has no prior.
    /// Samplers and optimisers start at such a draw if the density rejects all uniform starting points. Random-walk
    /// samplers compute their initial proposal scales from such draws.
    fn prior_point(&self, rng: &mut dyn RngCore) -> Option<Vec<f64>> {
        let _ = rng;
        None
    }

    /// Returns a copy of `y` in which the named quantities have the given values.
    ///
    /// # Errors
    /// A message with the invalid name or value, and the allowed names or values.
    #[doc(hidden)]
    fn with_values(&self, y: &[f64], values: &[(String, Vec<f64>)]) -> Result<Vec<f64>, String> {
        let _ = (y, values);
        Err("a density without a model has no named quantities: give `init_points`".to_owned())
    }

    /// Describes why the point `y` is rejected, for error messages, for example the datum with zero density; `None`
    /// if no description is available.
    fn explain(&self, y: &[f64]) -> Option<String> {
        let _ = y;
        None
    }
}
