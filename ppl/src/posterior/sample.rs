//! Sampling of a model and construction of its posterior.

use super::{Posterior, SampleError};
use crate::model::bound::Bound;
use crate::model::context::Model;
use crate::quantity::layout::Layout;
use crate::quantity::record::Role;
use crate::sampler::{DelayedAcceptance, Mcmc, OneDensity};

#[expect(private_bounds, reason = "sealed: the trait of transition kernels is not public")]
impl<K: OneDensity> Mcmc<'_, K> {
    /// Samples a model with [`run`](Mcmc::run), and returns its posterior, computed by [`Posterior::from_chains`]
    /// with the seed of the sampler.
    ///
    /// # Errors
    /// [`SampleError`] if the model cannot be evaluated, a setting is out of range, a chain finds no starting point, or
    /// a chain stops before its first draw.
    pub fn sample<M: Model>(&self, model: &Bound<M>) -> Result<Posterior, SampleError> {
        model.layout()?;
        let chains = self.method.run(&self.settings, model)?;
        Ok(Posterior::of_erased(model, chains, self.settings.seed)?)
    }
}

impl DelayedAcceptance<'_> {
    /// Samples the model `expensive` with screening by the model `cheap`. The posterior contains all named quantities
    /// of `expensive`.
    ///
    /// Both models must declare the same unknowns with the same supports and in the same order, so that they have the
    /// same unconstrained coordinates.
    ///
    /// # Errors
    /// [`SampleError`] if the unknowns differ, a model cannot be evaluated, a setting is out of range, a chain finds no
    /// starting point, or a chain stops before its first draw.
    pub fn sample<C: Model, M: Model>(
        &self,
        cheap: &Bound<C>,
        expensive: &Bound<M>,
    ) -> Result<Posterior, SampleError> {
        let (screening, deciding) = (unknowns(cheap.layout()?), unknowns(expensive.layout()?));
        if screening != deciding {
            return Err(SampleError::Screening { screening, deciding });
        }
        let chains = self.run(cheap, expensive)?;
        Ok(Posterior::of_erased(expensive, chains, self.settings.seed)?)
    }
}

/// Returns the names of the unknowns of a model with their shapes, as a text such as `mu, sd[3]`.
fn unknowns(layout: &Layout) -> String {
    let named = layout.with_role(Role::Parameter).map(|v| match v.shape.as_slice() {
        [] => v.name.clone(),
        shape => format!("{}{shape:?}", v.name),
    });
    named.collect::<Vec<_>>().join(", ")
}
