//! Type-erased densities and models. Samplers, optimisers and posteriors use these types, so that they are compiled
//! once in this crate and not for every user model.

use rand::RngCore;

use crate::density::{LogDensity, Rejection};
use crate::model::bound::Bound;
use crate::model::context::Model;
use crate::model::inspect::{self, ModelError};
use crate::quantity::layout::Layout;
use crate::quantity::record::Record;

/// Type-erased [`LogDensity`].
pub(crate) trait ErasedDensity: Sync {
    /// Number of coordinates.
    fn dim(&self) -> usize;

    /// See [`LogDensity::prior_point`].
    fn prior_point(&self, rng: &mut dyn RngCore) -> Option<Vec<f64>>;

    /// See [`LogDensity::with_values`].
    fn with_values(&self, y: &[f64], values: &[(String, Vec<f64>)]) -> Result<Vec<f64>, String>;

    /// Creates an evaluator of the density with a separate workspace; each chain has one evaluator.
    fn evaluator(&self) -> Box<dyn Evaluator + '_>;
}

/// A log density with its workspace.
pub(crate) trait Evaluator: Send {
    /// See [`LogDensity::log_density`].
    fn log_density(&mut self, y: &[f64]) -> Result<f64, Rejection>;

    /// See [`LogDensity::gradient`].
    fn gradient(&mut self, y: &[f64], gradient: &mut [f64]) -> Result<f64, Rejection>;

    /// See [`LogDensity::explain`].
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

/// Type-erased [`Bound`] model, with the methods for named quantities.
pub(crate) trait ErasedModel: ErasedDensity {
    /// See [`Bound::layout`].
    fn layout(&self) -> Result<&Layout, ModelError>;

    /// See [`Bound::draw_prior`]; calls `rejected` with the rejection of every draw that a statement rejects.
    fn draw_prior(
        &self,
        rng: &mut dyn RngCore,
        rejected: &mut dyn FnMut(&Rejection),
    ) -> Result<Record, ModelError>;

    /// Returns the named quantities at `y`. The record is incomplete if a statement rejects the point.
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
