//! From a model to its posterior: a run, then everything that the model names at the draws.

use super::{Posterior, SampleError};
use crate::bound::Bound;
use crate::layout::Layout;
use crate::model::Model;
use crate::record::Role;
use crate::sampler::{DelayedAcceptance, Mcmc, OneDensity};

#[expect(private_bounds, reason = "sealed: how chains move is no matter of the interface")]
impl<K: OneDensity> Mcmc<'_, K> {
    /// Samples a model: [`run`](Mcmc::run), then [`Posterior::from_chains`] with the sampler's seed.
    ///
    /// # Errors
    /// [`SampleError`] if the model cannot be evaluated, a setting is out of range, a chain finds no
    /// starting point, or one was stopped before its first draw.
    pub fn sample<M: Model>(&self, model: &Bound<M>) -> Result<Posterior, SampleError> {
        model.layout()?;
        let chains = self.method.run(&self.settings, model)?;
        Ok(Posterior::of_erased(model, chains, self.settings.seed)?)
    }
}

impl DelayedAcceptance<'_> {
    /// Samples the model `expensive`, screened by the model `cheap`: the draws with everything
    /// that `expensive` names. Both must declare the same unknowns in the same order, and with
    /// the same supports, so that their unconstrained coordinates mean the same.
    ///
    /// # Errors
    /// [`SampleError`] if the unknowns differ, a model cannot be evaluated, a setting is out of
    /// range, a chain finds no starting point, or one was stopped before its first draw.
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

/// The unknowns of a model with their shapes, as `mu, sd[3]`.
fn unknowns(layout: &Layout) -> String {
    let named = layout.with_role(Role::Parameter).map(|v| match v.shape.as_slice() {
        [] => v.name.clone(),
        shape => format!("{}{shape:?}", v.name),
    });
    named.collect::<Vec<_>>().join(", ")
}
