//! Search for a point near the posterior from a distant starting point.

use argmin::{
    core::{CostFunction, Error, Executor, Gradient, State},
    solver::quasinewton::LBFGS,
};

use super::{
    line_search::WeakWolfe,
    map::{Descent, MEMORY},
};
use crate::density::FatalError;
use crate::model::erased::ErasedDensity;

/// Magnitude of the log density above which the search compares relative instead of absolute gains.
const SCALE: f64 = 1e4;
/// Smallest gain of an iteration on the compressed scale of [`Compressed`]. The search stops if the gain is smaller,
/// because samplers converge from such a point without help.
const LEAST_GAIN: f64 = 0.3;
const ITERATIONS: u64 = 100;

/// Compressed cost arsinh(−ln p/[`SCALE`]). The compressed cost has the same minimum as −ln p and grows like ln(−ln
/// p) for large values. A start with the cost e⁸⁰ therefore does not need many more iterations than a start with a
/// small cost.
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

/// Moves a distant starting point towards the posterior by L-BFGS. Returns `None` if `start` is not distant.
///
/// A start is distant if energy differences at the start are smaller than their rounding errors, or if a mass matrix
/// that is adapted far from the posterior would not suit the posterior. The search stops well before the mode, so
/// that the starts of different chains stay dispersed.
///
/// # Errors
/// The fatal error of the density.
pub(crate) fn approach(
    density: &dyn ErasedDensity,
    start: &[f64],
) -> Result<Option<Vec<f64>>, Box<FatalError>> {
    let solver: LBFGS<_, Vec<f64>, Vec<f64>, f64> = LBFGS::new(WeakWolfe::new(), MEMORY);
    let Ok(solver) = solver.with_tolerance_cost(LEAST_GAIN) else { return Ok(None) };
    let result = Executor::new(Compressed(Descent::new(density)), solver)
        .configure(|state| state.param(start.to_vec()).max_iters(ITERATIONS))
        .run();
    // if the search fails, keep the start
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
