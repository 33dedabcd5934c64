//! Densities and models whose types are forgotten: samplers, optimisers and posteriors are compiled
//! once, here, and not anew for every model of a user.

use rand::RngCore;

use crate::bound::Bound;
use crate::density::{LogDensity, Rejection};
use crate::inspect::{self, ModelError};
use crate::layout::Layout;
use crate::model::Model;
use crate::record::Record;

/// A [`LogDensity`] whose type is forgotten.
pub(crate) trait ErasedDensity: Sync {
    /// Number of coordinates.
    fn dim(&self) -> usize;

    /// As [`LogDensity::prior_point`].
    fn prior_point(&self, rng: &mut dyn RngCore) -> Option<Vec<f64>>;

    /// As [`LogDensity::with_values`].
    fn with_values(&self, y: &[f64], values: &[(String, Vec<f64>)]) -> Result<Vec<f64>, String>;

    /// The density with a workspace of its own: one a chain.
    fn evaluator(&self) -> Box<dyn Evaluator + '_>;
}

/// A log density with its workspace.
pub(crate) trait Evaluator: Send {
    /// As [`LogDensity::log_density`].
    fn log_density(&mut self, y: &[f64]) -> Result<f64, Rejection>;

    /// As [`LogDensity::gradient`].
    fn gradient(&mut self, y: &[f64], gradient: &mut [f64]) -> Result<f64, Rejection>;

    /// As [`LogDensity::explain`].
    fn explain(&self, y: &[f64]) -> Option<String>;
}

impl<D: LogDensity> ErasedDensity for D {
    fn dim(&self) -> usize {
        LogDensity::dim(self)
    }

    fn prior_point(&self, rng: &mut dyn RngCore) -> Option<Vec<f64>> {
        LogDensity::prior_point(self, rng)
    }

    fn with_values(&self, y: &[f64], values: &[(String, Vec<f64>)]) -> Result<Vec<f64>, String> {
        LogDensity::with_values(self, y, values)
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(WithWorkspace { density: self, workspace: D::Workspace::default() })
    }
}

struct WithWorkspace<'a, D: LogDensity> {
    density: &'a D,
    workspace: D::Workspace,
}

impl<D: LogDensity> Evaluator for WithWorkspace<'_, D> {
    fn log_density(&mut self, y: &[f64]) -> Result<f64, Rejection> {
        self.density.log_density(y, &mut self.workspace)
    }

    fn gradient(&mut self, y: &[f64], gradient: &mut [f64]) -> Result<f64, Rejection> {
        self.density.gradient(y, gradient, &mut self.workspace)
    }

    fn explain(&self, y: &[f64]) -> Option<String> {
        self.density.explain(y)
    }
}

/// A [`Bound`] model, as far as it names quantities.
pub(crate) trait ErasedModel: ErasedDensity {
    /// As [`Bound::layout`].
    fn layout(&self) -> Result<&Layout, ModelError>;

    /// As [`Bound::draw_prior`]; `rejected` hears of draws that a statement rejected before.
    fn draw_prior(
        &self,
        rng: &mut dyn RngCore,
        rejected: &mut dyn FnMut(&Rejection),
    ) -> Result<Record, ModelError>;

    /// What the model names at `y`, up to a rejection.
    fn record_at(&self, y: &[f64], rng: &mut dyn RngCore) -> (Record, Result<(), Rejection>);
}

impl<M: Model> ErasedModel for Bound<M> {
    fn layout(&self) -> Result<&Layout, ModelError> {
        Bound::layout(self)
    }

    fn draw_prior(
        &self,
        rng: &mut dyn RngCore,
        rejected: &mut dyn FnMut(&Rejection),
    ) -> Result<Record, ModelError> {
        inspect::draw_counting(self.model(), rng, rejected)
    }

    fn record_at(&self, y: &[f64], rng: &mut dyn RngCore) -> (Record, Result<(), Rejection>) {
        inspect::record_at(self.model(), y, rng)
    }
}
