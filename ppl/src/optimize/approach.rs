//! The way from a distant start to where a posterior can be sampled.

use argmin::{
    core::{CostFunction, Error, Executor, Gradient, State},
    solver::quasinewton::LBFGS,
};

use super::{
    line_search::WeakWolfe,
    map::{Descent, MEMORY},
};
use crate::{density::FatalError, erased::ErasedDensity};

/// The log density below which a gain counts by its ratio.
const SCALE: f64 = 1e4;
/// An iteration that gains less, in that unit, is the last: there, samplers find their own way.
const LEAST_GAIN: f64 = 0.3;
const ITERATIONS: u64 = 100;

/// arsinh(−ln p/[`SCALE`]), which has the same minimum as −ln p, and the slope of a logarithm far
/// above it: the way down e⁸⁰ is no longer than that down 80.
struct Compressed<'a>(Descent<'a>);

impl CostFunction for Compressed<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, y: &Vec<f64>) -> Result<f64, Error> {
        Ok((self.0.cost(y)? / SCALE).asinh())
    }
}

impl Gradient for Compressed<'_> {
    type Param = Vec<f64>;
    type Gradient = Vec<f64>;

    fn gradient(&self, y: &Vec<f64>) -> Result<Vec<f64>, Error> {
        let slope = self.0.cost(y)?.hypot(SCALE).recip();
        let mut gradient = self.0.gradient(y)?;
        gradient.iter_mut().for_each(|g| *g *= slope);
        Ok(gradient)
    }
}

/// Where L-BFGS comes to from a start so far from the posterior that energies there have no digits
/// for their differences, or that a mass matrix learnt on the way is of no use further on; `None`
/// if `start` is not.
///
/// It ends well before the mode, so that chains stay as far from each other as they were sent.
///
/// # Errors
/// What the density reported as fatal.
pub(crate) fn approach(
    density: &dyn ErasedDensity,
    start: &[f64],
) -> Result<Option<Vec<f64>>, Box<FatalError>> {
    let solver: LBFGS<_, Vec<f64>, Vec<f64>, f64> = LBFGS::new(WeakWolfe::new(), MEMORY);
    let Ok(solver) = solver.with_tolerance_cost(LEAST_GAIN) else { return Ok(None) };
    let result = Executor::new(Compressed(Descent::new(density)), solver)
        .configure(|state| state.param(start.to_vec()).max_iters(ITERATIONS))
        .run();
    // a search that fails leaves the start as it is
    let Ok(result) = result else { return Ok(None) };
    if let Some(fatal) = result.problem.problem.and_then(|problem| problem.0.into_fatal()) {
        return Err(fatal);
    }
    let gained = result.state.get_iter() > 1;
    Ok(result.state.best_param.filter(|_| gained))
}

#[cfg(test)]
#[path = "../../tests/unit/optimize_approach.rs"]
mod tests;
