//! Models bound to their data.

use rand::{Rng, RngCore};

use crate::density::{FatalError, LogDensity, Rejection};
use crate::model::backend::{Backend, Forward, FullTape, Primal, Reverse};
use crate::model::context::Model;
use crate::model::evaluation::{Density, Statistics};
use crate::model::inspect::{self, Inspection, ModelError, Statements};
use crate::model::trace::Trace;
use crate::number::dual::Dual;
use crate::number::tape::Tape;
use crate::quantity::layout::Layout;
use crate::quantity::record::Record;

/// A model bound to its data; the return type of functions declared by `model!`.
///
/// When the model is bound, it is run once on a prior draw. This run determines the names, the shapes and the number
/// of the unknowns. An error of this run is returned by [`layout`](Bound::layout) and by every sampler.
///
/// # Example
/// ```
/// use ppl::prelude::*;
/// use ppl::rand::SeedableRng;
///
/// ppl::model! {
///     fn spring(stretch_mm: f64, force_n: &[f64]) {
///         let stiffness ~ LogNormal(0.0, 1.0); // N/mm
///         #[track] let expected = stiffness * stretch_mm;
///         for f in force_n {
///             f ~ Normal(expected, 0.5);
///         }
///     }
/// }
///
/// let model = spring(2.0, &[3.9, 4.2]);
/// assert_eq!(model.layout()?.dim, 1);
///
/// // a draw from the prior: the unknown, the tracked quantity, and simulated data
/// let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(7);
/// let prior = model.draw_prior(&mut rng)?;
/// let stiffness = prior.values("stiffness").expect("an unknown")[0];
/// assert_eq!(prior.values("expected").expect("tracked"), [2.0 * stiffness]);
/// assert_eq!(prior.replicate("f").expect("observed").len(), 2);
///
/// // density and gradient at a point of unconstrained space, whose only coordinate is ln stiffness
/// let (mut gradient, mut workspace) = ([0.0], ppl::Workspace::default());
/// let value = model.gradient(&[0.7], &mut gradient, &mut workspace)?;
/// assert_eq!(value, model.log_density(&[0.7], &mut workspace)?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Bound<M> {
    model: M,
    inspection: Inspection,
}

/// Scratch memory for evaluations of a [`Bound`] model.
#[derive(Debug, Default)]
pub struct Workspace {
    tape: Tape,
    sums: Vec<f64>,
}

impl<M: Model> Bound<M> {
    /// Binds a model to its data.
    pub fn new(model: M) -> Self {
        let inspection = inspect::inspect(&model, M::STATIC);
        Self { model, inspection }
    }

    /// The model.
    pub fn model(&self) -> &M {
        &self.model
    }

    /// Returns the names, shapes and roles of all quantities, and the number of unconstrained coordinates.
    ///
    /// # Errors
    /// [`ModelError`] with the invalid statement or data.
    pub fn layout(&self) -> Result<&Layout, ModelError> {
        self.inspection.layout()
    }

    /// Draws the unknowns from the prior. The record contains the unknowns, tracked quantities, predictions, and a
    /// simulated replicate of every observed quantity.
    ///
    /// # Errors
    /// [`ModelError`] if the model is invalid or rejects all its prior draws.
    pub fn draw_prior<G: Rng>(&self, rng: &mut G) -> Result<Record, ModelError> {
        inspect::draw(&self.model, rng)
    }

    /// Evaluates all named quantities at the unconstrained point `y`. Predictions and replicates are drawn with `rng`.
    ///
    /// # Errors
    /// [`Rejection`] if a statement rejects the point.
    pub fn constrain<G: Rng>(&self, y: &[f64], rng: &mut G) -> Result<Record, Rejection> {
        let (record, outcome) = inspect::record_at(&self.model, y, rng);
        outcome.map(|()| record)
    }

    /// Log density at the unconstrained point `y`, without the log-Jacobians of the maps from coordinates to values.
    /// This is the density of the constrained values.
    ///
    /// # Errors
    /// [`Rejection`] if the density is zero or undefined.
    pub fn log_density_without_jacobian(
        &self,
        y: &[f64],
        workspace: &mut Workspace,
    ) -> Result<f64, Rejection> {
        let statistics = self.inspection.statistics(&mut workspace.sums);
        value::<_, _, false>(&self.model, Primal::new(y, false), statistics)
    }

    /// Value of [`log_density_without_jacobian`](Bound::log_density_without_jacobian) and its gradient with respect to
    /// the unconstrained coordinates.
    ///
    /// # Errors
    /// [`Rejection`] if the density is zero or undefined.
    pub fn gradient_without_jacobian(
        &self,
        y: &[f64],
        gradient: &mut [f64],
        workspace: &mut Workspace,
    ) -> Result<f64, Rejection> {
        self.reverse::<false>(y, gradient, workspace)
    }

    /// Computes the gradient in forward mode, one coordinate at a time. This is slow, but independent of the tape,
    /// and of the sufficient statistics that were computed when the data were bound.
    ///
    /// # Errors
    /// [`Rejection`] if the density is zero or undefined, or if a derivative is not finite; the rejection names
    /// the first statement for which this is true.
    pub fn forward_gradient(&self, y: &[f64], gradient: &mut [f64]) -> Result<f64, Rejection> {
        let (mut value, mut sums) = (0.0, Vec::new());
        for (i, g) in gradient.iter_mut().enumerate() {
            let point: Vec<Dual<1>> = y
                .iter()
                .enumerate()
                .map(|(j, &y)| Dual::new(y, [if i == j { 1.0 } else { 0.0 }]))
                .collect();
            let backend = Forward::new(&point);
            let mut density = Density::<_, true>::new(backend, Statistics::Recomputed(&mut sums));
            density.read(&self.model)?;
            value = crate::Scalar::value(density.backend.total);
            *g = density.backend.total.gradient()[0];
        }
        Ok(value)
    }

    /// Computes the gradient with a tape that stores every operation. This is slow, but independent of the
    /// optimisations in [`gradient`](LogDensity::gradient): omitted constants, terms that are not stored on the tape,
    /// and precomputed sufficient statistics.
    ///
    /// # Errors
    /// [`Rejection`] if the density is zero or undefined.
    pub fn tape_gradient(
        &self,
        y: &[f64],
        gradient: &mut [f64],
        workspace: &mut Workspace,
    ) -> Result<f64, Rejection> {
        if gradient.len() != y.len() {
            return Err(other_length(gradient.len(), y.len()));
        }
        loop {
            workspace.tape.clear();
            let tape = &workspace.tape;
            let backend = FullTape::new(tape, y);
            if tape.is_full() {
                continue;
            }
            let statistics = Statistics::Recomputed(&mut workspace.sums);
            let mut density = Density::<_, true>::new(backend, statistics);
            density.read(&self.model)?;
            if !tape.is_full() {
                tape.sweep(gradient);
                return Ok(density.backend.total());
            }
        }
    }

    /// Describes the first statement whose derivative is not finite at `y`; `None` if all derivatives are finite, or
    /// if the density is not finite at `y`.
    #[cold]
    fn explain_gradient(&self, y: &[f64]) -> Option<String> {
        self.log_density(y, &mut Workspace::default()).ok()?;
        let rejection = self.forward_gradient(y, &mut vec![0.0; y.len()]).err()?;
        Some(format!(
            "the first statement whose derivative is not finite is {}: look for a function that is \
             not differentiable at this point, such as the square root at 0, and check the \
             derivatives that user-defined functions return",
            rejection.location()?
        ))
    }

    /// Computes the log density and its gradient in reverse mode. The evaluation is repeated with a longer tape if
    /// the tape was too short.
    fn reverse<const JACOBIAN: bool>(
        &self,
        y: &[f64],
        gradient: &mut [f64],
        workspace: &mut Workspace,
    ) -> Result<f64, Rejection> {
        if gradient.len() != y.len() {
            return Err(other_length(gradient.len(), y.len()));
        }
        loop {
            workspace.tape.clear();
            let tape = &workspace.tape;
            let constant = if JACOBIAN && M::STATIC { self.inspection.constant } else { None };
            let reverse = Reverse::new(tape, y, constant.is_some());
            if tape.is_full() {
                continue;
            }
            let statistics = self.inspection.statistics(&mut workspace.sums);
            let total = value::<_, _, JACOBIAN>(&self.model, reverse, statistics)?;
            if !tape.is_full() {
                tape.sweep(gradient);
                return Ok(constant.unwrap_or(0.0) + total);
            }
        }
    }
}

#[cold]
fn other_length(gradient: usize, point: usize) -> Rejection {
    Box::new(FatalError::GradientLength { gradient, point }).into()
}

/// Returns the sum of all terms of the log density.
#[inline]
fn value<M: Model, L: Backend, const JACOBIAN: bool>(
    model: &M,
    backend: L,
    statistics: Statistics<'_>,
) -> Result<f64, Rejection> {
    let mut density = Density::<_, JACOBIAN>::new(backend, statistics);
    density.read(model)?;
    Ok(density.backend.total())
}

impl<M: Model> Statements for M {
    fn trace(&self, trace: &mut Trace<'_>) -> Result<(), Rejection> {
        self.run(trace)
    }

    fn value(
        &self,
        y: &[f64],
        drop_constants: bool,
        statistics: Statistics<'_>,
    ) -> Result<f64, Rejection> {
        value::<_, _, true>(self, Primal::new(y, drop_constants), statistics)
    }
}

impl<M: Model> LogDensity for Bound<M> {
    type Workspace = Workspace;

    fn dim(&self) -> usize {
        self.inspection.dim()
    }

    fn log_density(&self, y: &[f64], workspace: &mut Workspace) -> Result<f64, Rejection> {
        let constant = if M::STATIC { self.inspection.constant } else { None };
        let statistics = self.inspection.statistics(&mut workspace.sums);
        let values = Primal::new(y, constant.is_some());
        Ok(constant.unwrap_or(0.0) + value::<_, _, true>(&self.model, values, statistics)?)
    }

    fn gradient(
        &self,
        y: &[f64],
        gradient: &mut [f64],
        workspace: &mut Workspace,
    ) -> Result<f64, Rejection> {
        self.reverse::<true>(y, gradient, workspace)
    }

    fn prior_point(&self, rng: &mut dyn RngCore) -> Option<Vec<f64>> {
        inspect::draw(&self.model, rng).ok().map(|record| record.unconstrained)
    }

    fn with_values(&self, y: &[f64], values: &[(String, Vec<f64>)]) -> Result<Vec<f64>, String> {
        inspect::with_values(&self.model, y, values)
    }

    fn explain(&self, y: &[f64]) -> Option<String> {
        match self.layout() {
            Ok(_) => inspect::explain(&self.model, y).or_else(|| self.explain_gradient(y)),
            Err(error) => Some(error.to_string()),
        }
    }
}
