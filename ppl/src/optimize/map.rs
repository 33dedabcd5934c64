//! Maximum a posteriori estimation by L-BFGS from several starting points.

use std::cell::RefCell;

use argmin::{
    core::{CostFunction, Error, Executor, Gradient, State},
    solver::quasinewton::LBFGS,
};
use rand::{Rng, RngCore, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{
    curvature::negative_hessian, error::OptimizeError, line_search::WeakWolfe, rescaled::Rescaled,
};
use crate::density::{FatalError, LogDensity, Rejection};
use crate::model::bound::{Bound, Workspace};
use crate::model::context::Model;
use crate::model::erased::{ErasedDensity, Evaluator};
use crate::model::start::{NamedValues, NoStart, StartKind, find_start};
use crate::quantity::datum::Recordable;

/// Number of pairs of steps and gradient differences in the memory of L-BFGS.
pub(super) const MEMORY: usize = 10;
/// Largest difference to the best log density at which a search agrees with the best search. A difference of this
/// size is negligible for a posterior.
const AGREEMENT: f64 = 0.01;
/// Largest number of rounds in which the searches continue in rescaled coordinates, if the best search has not
/// converged.
const RESCALINGS: usize = 2;
/// A search has converged if one further Newton step would increase the log density by less than this value.
const GAIN: f64 = 1e-6;

/// Search for the mode of a posterior.
///
/// [`Map::find`] returns the joint mode over the constrained values, that is, without Jacobian. This is the maximum a
/// posteriori estimate, which does not depend on the transforms. [`Map::run`] returns the mode of any log density.
///
/// The search uses L-BFGS in unconstrained coordinates, so that it never leaves the support. The search starts from
/// uniform points on (−2, 2), or from draws of the prior if the density rejects 100 uniform points. A mode on the
/// boundary of the support lies at infinity in unconstrained coordinates. The search then stops when further steps
/// gain nothing, and [`Mode::at_bound`] lists the coordinates.
///
/// # Example
/// ```
/// use ppl::prelude::*;
/// use ppl::rand::SeedableRng;
///
/// ppl::model! {
///     fn coin(flips: &[bool]) {
///         let heads ~ Beta(2.0, 2.0);
///         for flip in flips {
///             flip ~ Bernoulli(heads);
///         }
///     }
/// }
///
/// let model = coin(&[true, true, false, true]);
/// let mode = Map::default().starts(5).seed(7).find(&model)?;
/// assert!(mode.converged && mode.agreeing == 5);
///
/// // `mode.point` is unconstrained; the model gives it names (the generator draws predictions)
/// let mut rng = rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(0);
/// let values = model.constrain(&mode.point, &mut rng)?;
/// let heads = values.values("heads").expect("an unknown of the model")[0];
/// assert!((heads - 4.0 / 6.0).abs() < 1e-5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Reference: Nocedal & Wright, *Numerical Optimization* (2006), algorithm 7.5.
#[derive(Clone, Debug)]
pub struct Map {
    starts: usize,
    seed: u64,
    iterations: u64,
    values: NamedValues,
}

impl Default for Map {
    fn default() -> Self {
        Self { starts: 10, seed: 0, iterations: 1000, values: Vec::new() }
    }
}

/// Result of a search for the mode.
#[derive(Clone, Debug, PartialEq)]
pub struct Mode {
    /// The mode in unconstrained coordinates.
    pub point: Vec<f64>,
    /// Log density at the mode; without Jacobian if it comes from [`Map::find`].
    pub log_density: f64,
    /// Number of searches.
    pub starts: usize,
    /// Number of searches that started at a draw from the prior, because the density rejected every uniform point.
    pub prior_starts: usize,
    /// Number of searches that ended within 0.01 of the best log density. If only few of many searches agree, there
    /// are several modes, or the density is too difficult for the method.
    pub agreeing: usize,
    /// Gain of log density by one further Newton step.
    pub gain: f64,
    /// Whether the search converged: the gain is below 10⁻⁶, and the log density is concave at the mode.
    pub converged: bool,
    /// Indices of the coordinates of `point` that diverge to infinity, because the mode lies on the boundary of the
    /// support, for example at a prior bound.
    pub at_bound: Vec<usize>,
}

impl Map {
    /// Sets the number of searches, each from a different random start. The default is 10.
    pub fn starts(mut self, starts: usize) -> Self {
        self.starts = starts;
        self
    }

    /// Sets the seed of the random starts.
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// Sets the largest number of iterations of each search. The default is 1000.
    pub fn iterations(mut self, iterations: u64) -> Self {
        self.iterations = iterations;
        self
    }

    /// Starts every search with the given value of the named quantity; quantities without a value start at random. The
    /// value is a number, or an array or vector with as many numbers as the quantity has.
    pub fn init_value(mut self, name: &str, value: impl Recordable) -> Self {
        let mut elements = Vec::new();
        value.flatten(&mut elements);
        self.values.push((name.to_owned(), elements));
        self
    }

    /// Finds the joint mode of a model over its constrained values.
    ///
    /// # Errors
    /// [`OptimizeError`] if the model is invalid, no starting point is accepted, or the model reports a fatal error.
    pub fn find<M: Model>(&self, model: &Bound<M>) -> Result<Mode, OptimizeError> {
        model.layout()?;
        self.run(&WithoutJacobian(model))
    }

    /// Finds the mode of any log density.
    ///
    /// # Errors
    /// [`OptimizeError`] if no starting point is accepted, or the density reports a fatal error.
    pub fn run<D: LogDensity>(&self, density: &D) -> Result<Mode, OptimizeError> {
        self.run_any(density)
    }

    pub(super) fn run_any(&self, density: &dyn ErasedDensity) -> Result<Mode, OptimizeError> {
        if self.starts == 0 || self.iterations == 0 {
            let setting = if self.starts == 0 { "starts" } else { "iterations" };
            let value = "0".to_owned();
            return Err(OptimizeError::Setting { setting, value, help: "give at least 1" });
        }
        if density.dim() == 0 {
            return Err(OptimizeError::NoUnknowns);
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let mut ends = Vec::with_capacity(self.starts);
        let mut prior_starts = 0;
        for _ in 0..self.starts {
            let (kind, start) = start(density, &self.values, &mut rng)?;
            prior_starts += usize::from(kind == StartKind::PriorDraw);
            ends.push(self.climb(density, start)?);
        }
        let mut evaluator = density.evaluator();
        let mut round = 0;
        let (agreeing, point, log_density, gain, concave) = loop {
            let (agreeing, point, log_density) = best(&ends)?;
            let (gain, concave) = newton_gain(&mut *evaluator, &point)?;
            if gain < GAIN || round == RESCALINGS {
                break (agreeing, point, log_density, gain, concave);
            }
            round += 1;
            ends = ends
                .into_iter()
                .map(|end| self.climb_rescaled(density, end))
                .collect::<Result<_, OptimizeError>>()?;
        };
        let mut at_bound = Vec::new();
        for i in 0..point.len() {
            if runs_away(&mut *evaluator, &point, i)? {
                at_bound.push(i);
            }
        }
        let converged = gain < GAIN && concave;
        Ok(Mode {
            point,
            log_density,
            starts: self.starts,
            prior_starts,
            agreeing,
            gain,
            converged,
            at_bound,
        })
    }

    /// Continues a search from its `end`, in coordinates whose units are the widths of the density at this point. If
    /// the original units differ much from these widths, such as pascals for an elastic modulus, the tolerances stop
    /// a search immediately.
    fn climb_rescaled(
        &self,
        density: &dyn ErasedDensity,
        (end, value): (Vec<f64>, f64),
    ) -> Result<(Vec<f64>, f64), OptimizeError> {
        let Ok(hessian) = negative_hessian(&mut *density.evaluator(), &end) else {
            return Ok((end, value));
        };
        let rescaled = Rescaled::new(density, end.clone(), hessian.diagonal().iter().copied());
        let (z, higher) = self.climb(&rescaled, vec![0.0; end.len()])?;
        Ok(if higher > value { (rescaled.point(&z), higher) } else { (end, value) })
    }

    /// Runs one search from `start`. Returns the best point and its log density.
    fn climb(
        &self,
        density: &dyn ErasedDensity,
        start: Vec<f64>,
    ) -> Result<(Vec<f64>, f64), OptimizeError> {
        let solver: LBFGS<_, Vec<f64>, Vec<f64>, f64> = LBFGS::new(WeakWolfe::new(), MEMORY);
        let result = Executor::new(Descent::new(density), solver)
            .configure(|state| state.param(start).max_iters(self.iterations))
            .run()
            .map_err(|error| OptimizeError::Optimiser(error.to_string()))?;
        if let Some(fatal) = result.problem.problem.and_then(Descent::into_fatal) {
            return Err(OptimizeError::Density(Box::new(fatal.into())));
        }
        let state = result.state;
        match state.get_best_param() {
            Some(point) => Ok((point.clone(), -state.get_best_cost())),
            None => Err(OptimizeError::Optimiser("no finite log density".into())),
        }
    }
}

/// Returns the number of searches that agree with the best search, and the end point and the log density of the best
/// search.
fn best(ends: &[(Vec<f64>, f64)]) -> Result<(usize, Vec<f64>, f64), OptimizeError> {
    let best = ends.iter().map(|(_, value)| *value).fold(f64::NEG_INFINITY, f64::max);
    let agreeing = ends.iter().filter(|(_, value)| best - value < AGREEMENT).count();
    let best_end = ends.iter().find(|(_, value)| *value == best);
    let (point, value) =
        best_end.ok_or_else(|| OptimizeError::Optimiser("no finite log density".into()))?;
    Ok((agreeing, point.clone(), *value))
}

/// Finds a starting point that the density accepts.
fn start(
    density: &dyn ErasedDensity,
    values: &NamedValues,
    rng: &mut Xoshiro256PlusPlus,
) -> Result<(StartKind, Vec<f64>), OptimizeError> {
    let mut evaluator = density.evaluator();
    let mut uniform = |rng: &mut Xoshiro256PlusPlus| -> Vec<f64> {
        (0..density.dim()).map(|_| 4.0 * rng.random::<f64>() - 2.0).collect()
    };
    let mut accept = |y: &[f64]| evaluator.log_density(y).map(|_| ());
    find_start(density, values, rng, &mut uniform, &mut accept).map_err(|problem| match problem {
        NoStart::Values(problem) => OptimizeError::Values(problem),
        NoStart::Fatal(error, _) => Box::new(Rejection::Fatal(error)).into(),
        NoStart::Rejected { uniform, prior, last, point } => OptimizeError::Start {
            tries: uniform,
            prior_draws: prior,
            last: Box::new(last),
            detail: density.evaluator().explain(&point),
        },
    })
}

/// Returns the estimated gain `½ gᵀ|H|⁻¹g` of log density by a Newton step, and whether H has no negative eigenvalue.
/// g is the gradient of ln p, and H is the Hessian of −ln p.
fn newton_gain(density: &mut dyn Evaluator, y: &[f64]) -> Result<(f64, bool), OptimizeError> {
    let mut gradient = nalgebra::DVector::zeros(y.len());
    density.gradient(y, gradient.as_mut_slice()).map_err(Box::new)?;
    let eigen = negative_hessian(density, y).map_err(Box::new)?.symmetric_eigen();
    let largest = eigen.eigenvalues.amax();
    let along = eigen.eigenvectors.transpose() * gradient;
    // a curvature that is smaller than the resolution of the finite differences is replaced by this
    // resolution
    let floor = 1e-8 * largest;
    let terms = along.iter().zip(&eigen.eigenvalues);
    let gain = terms.map(|(g, h)| 0.5 * g * g / h.abs().max(floor).max(f64::MIN_POSITIVE)).sum();
    Ok((gain, eigen.eigenvalues.iter().all(|&h| h >= -floor)))
}

/// Whether coordinate `i` diverges to infinity. Near a bound, the constrained values and therefore the density change
/// as e^(−k|y|) with k ≥ 1. The slope then points outwards on both sides of y, and it decreases by a factor of at
/// least e per unit of y. At an interior mode, the slope changes its sign.
fn runs_away(density: &mut dyn Evaluator, y: &[f64], i: usize) -> Result<bool, OptimizeError> {
    let outwards = y[i].signum();
    let mut gradient = vec![0.0; y.len()];
    let mut slope = |offset: f64| {
        let mut point = y.to_vec();
        point[i] += outwards * offset;
        match density.gradient(&point, &mut gradient) {
            Ok(_) => Ok(outwards * gradient[i]),
            Err(fatal @ Rejection::Fatal(_)) => Err(Box::new(fatal)),
            Err(_) => Ok(f64::NAN),
        }
    };
    let (inner, near, outer) = (slope(-2.0)?, slope(-1.0)?, slope(1.0)?);
    Ok(near > 0.0 && inner > 2.0 * near && outer.abs() < 0.5 * near)
}

/// Negative log density as the cost function of argmin; rejected points have the cost +∞.
pub(super) struct Descent<'a> {
    density: RefCell<Box<dyn Evaluator + 'a>>,
    /// Fatal error, stored until argmin returns.
    fatal: RefCell<Option<Box<FatalError>>>,
}

impl<'a> Descent<'a> {
    pub(super) fn new(density: &'a dyn ErasedDensity) -> Self {
        Self { density: RefCell::new(density.evaluator()), fatal: RefCell::default() }
    }

    pub(super) fn into_fatal(self) -> Option<Box<FatalError>> {
        self.fatal.into_inner()
    }

    fn note(&self, rejection: Rejection) {
        if let Rejection::Fatal(error) = rejection {
            self.fatal.replace(Some(error));
        }
    }
}

impl CostFunction for Descent<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, y: &Vec<f64>) -> Result<f64, Error> {
        match self.density.borrow_mut().log_density(y) {
            Ok(value) => Ok(-value),
            Err(rejection) => {
                self.note(rejection);
                Ok(f64::INFINITY)
            }
        }
    }
}

impl Gradient for Descent<'_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, y: &Vec<f64>) -> Result<Vec<f64>, Error> {
        let mut gradient = vec![0.0; y.len()];
        match self.density.borrow_mut().gradient(y, &mut gradient) {
            Ok(_) => gradient.iter_mut().for_each(|g| *g = -*g),
            Err(rejection) => {
                self.note(rejection);
                gradient.fill(f64::NAN);
            }
        }
        Ok(gradient)
    }
}

/// Log density of a model over its constrained values, that is, without log-Jacobians.
struct WithoutJacobian<'a, M>(&'a Bound<M>);

impl<M: Model> LogDensity for WithoutJacobian<'_, M> {
    type Workspace = Workspace;

    fn dim(&self) -> usize {
        LogDensity::dim(self.0)
    }

    fn log_density(&self, y: &[f64], workspace: &mut Workspace) -> Result<f64, Rejection> {
        self.0.log_density_without_jacobian(y, workspace)
    }

    fn gradient(
        &self,
        y: &[f64],
        gradient: &mut [f64],
        workspace: &mut Workspace,
    ) -> Result<f64, Rejection> {
        self.0.gradient_without_jacobian(y, gradient, workspace)
    }

    fn prior_point(&self, rng: &mut dyn RngCore) -> Option<Vec<f64>> {
        LogDensity::prior_point(self.0, rng)
    }

    fn with_values(&self, y: &[f64], values: &[(String, Vec<f64>)]) -> Result<Vec<f64>, String> {
        LogDensity::with_values(self.0, y, values)
    }

    fn explain(&self, y: &[f64]) -> Option<String> {
        self.0.explain(y)
    }
}
