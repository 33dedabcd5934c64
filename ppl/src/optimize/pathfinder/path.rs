//! One path: an optimisation, and the best normal approximation along it.

use std::sync::{Arc, Mutex, PoisonError};

use argmin::{
    core::{
        Error, Executor, IterState, KV, State,
        observers::{Observe, ObserverMode},
    },
    solver::quasinewton::LBFGS,
};
use nalgebra::{DMatrix, DVector};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::approximation::{Approximation, History};
use crate::{
    any::{AnyDensity, Evaluator},
    density::Rejection,
    optimize::{
        OptimizeError,
        line_search::WeakWolfe,
        map::{Descent, MEMORY, start},
    },
};

/// One path of [`Pathfinder`](super::Pathfinder).
#[derive(Clone, Debug)]
pub struct PathfinderPath {
    /// Estimate of `E ln p − E ln q` of the approximation chosen; for a normalised density a lower
    /// bound of the log evidence.
    pub elbo: f64,
    /// Iterate of the optimisation (from 0) at which it was made.
    pub iterate: usize,
    /// Iterates of the optimisation.
    pub iterates: usize,
    pub(super) approximation: Approximation,
    pub(super) draws: Vec<Draw>,
}

/// A draw of an approximation.
#[derive(Clone, Debug)]
pub(super) struct Draw {
    pub(super) y: Vec<f64>,
    /// ln p, −∞ where it rejects.
    pub(super) log_density: f64,
    /// ln q.
    pub(super) log_approximation: f64,
}

impl PathfinderPath {
    /// Mean of the normal approximation, in unconstrained space.
    pub fn mean(&self) -> &[f64] {
        self.approximation.mean.as_slice()
    }

    /// Covariance of the normal approximation, in unconstrained space.
    pub fn covariance(&self) -> DMatrix<f64> {
        self.approximation.covariance()
    }
}

type Iteration = IterState<Vec<f64>, Vec<f64>, (), (), (), f64>;
type Iterates = Vec<(DVector<f64>, DVector<f64>)>;

/// Writes down points and scores of an optimisation.
struct Recorder(Arc<Mutex<Iterates>>);

impl Recorder {
    fn note(&self, state: &Iteration) {
        if let (Some(y), Some(g)) = (state.get_param(), state.get_gradient()) {
            let (y, g) = (DVector::from_column_slice(y), -DVector::from_column_slice(g));
            let mut iterates = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            if g.iter().all(|g| g.is_finite()) && iterates.last().is_none_or(|last| last.0 != y) {
                iterates.push((y, g));
            }
        }
    }
}

impl Observe<Iteration> for Recorder {
    fn observe_init(&mut self, _: &str, state: &Iteration, _: &KV) -> Result<(), Error> {
        self.note(state);
        Ok(())
    }

    fn observe_iter(&mut self, state: &Iteration, _: &KV) -> Result<(), Error> {
        self.note(state);
        Ok(())
    }
}

/// Climbs from a random start, and draws `draws` times from the approximation with the largest
/// ELBO, estimated from `elbo_draws`. `None` if no approximation has a finite one.
pub(super) fn find(
    density: &dyn AnyDensity,
    iterations: u64,
    elbo_draws: usize,
    draws: usize,
    mut rng: Xoshiro256PlusPlus,
) -> Result<Option<PathfinderPath>, OptimizeError> {
    let from = start(density, &mut rng)?;
    let iterates = climb(density, from, iterations)?;
    let mut evaluator = density.evaluator();
    let mut history = History::new(density.dim());
    let mut best: Option<(f64, usize, Approximation)> = None;
    for (k, (y, g)) in iterates.iter().enumerate() {
        if let Some((y0, g0)) = k.checked_sub(1).and_then(|before| iterates.get(before)) {
            history.add(y - y0, g0 - g);
        } else if iterates.len() > 1 {
            // the start has no curvature yet
            continue;
        }
        let Some(approximation) = Approximation::new(y, g, &history) else { continue };
        let sample = sample(&mut *evaluator, &approximation, elbo_draws, &mut rng)?;
        let elbo = sample.iter().map(|d| d.log_density - d.log_approximation).sum::<f64>()
            / elbo_draws as f64;
        if elbo.is_finite() && best.as_ref().is_none_or(|(most, ..)| elbo > *most) {
            best = Some((elbo, k, approximation));
        }
    }
    let Some((elbo, iterate, approximation)) = best else { return Ok(None) };
    let draws = sample(&mut *evaluator, &approximation, draws, &mut rng)?;
    Ok(Some(PathfinderPath { elbo, iterate, iterates: iterates.len(), approximation, draws }))
}

/// The iterates of L-BFGS.
fn climb(
    density: &dyn AnyDensity,
    from: Vec<f64>,
    iterations: u64,
) -> Result<Iterates, OptimizeError> {
    let iterates = Arc::new(Mutex::new(Vec::new()));
    let solver: LBFGS<_, Vec<f64>, Vec<f64>, f64> = LBFGS::new(WeakWolfe::new(), MEMORY);
    let result = Executor::new(Descent::new(density), solver)
        .configure(|state| state.param(from).max_iters(iterations))
        .add_observer(Recorder(Arc::clone(&iterates)), ObserverMode::Always)
        .run()
        .map_err(|error| OptimizeError::Optimiser(error.to_string()))?;
    if let Some(fatal) = result.problem.problem.and_then(Descent::into_fatal) {
        return Err(OptimizeError::Density(Box::new(fatal)));
    }
    let mut iterates = iterates.lock().unwrap_or_else(PoisonError::into_inner);
    Ok(std::mem::take(&mut *iterates))
}

fn sample(
    density: &mut dyn Evaluator,
    approximation: &Approximation,
    draws: usize,
    rng: &mut Xoshiro256PlusPlus,
) -> Result<Vec<Draw>, OptimizeError> {
    (0..draws)
        .map(|_| {
            let (y, log_approximation) = approximation.draw(rng);
            let log_density = match density.log_density(&y) {
                Ok(value) if value < f64::INFINITY => value,
                Err(fatal @ Rejection::Fatal { .. }) => return Err(Box::new(fatal).into()),
                Ok(_) | Err(_) => f64::NEG_INFINITY,
            };
            Ok(Draw { y, log_density, log_approximation })
        })
        .collect()
}
