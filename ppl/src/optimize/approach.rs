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
mod tests {
    use super::*;
    use crate::density::{LogDensity, Rejection};

    /// The log density of `f`, which gives value and gradient.
    struct Of<F>(usize, F);

    impl<F: Fn(&[f64]) -> (f64, Vec<f64>) + Sync> LogDensity for Of<F> {
        type Workspace = ();

        fn dim(&self) -> usize {
            self.0
        }

        fn log_density(&self, y: &[f64], (): &mut ()) -> Result<f64, Rejection> {
            Ok((self.1)(y).0)
        }

        fn gradient(&self, y: &[f64], g: &mut [f64], (): &mut ()) -> Result<f64, Rejection> {
            let (value, gradient) = (self.1)(y);
            g.copy_from_slice(&gradient);
            Ok(value)
        }
    }

    /// A Poisson count of 5 in the logarithm of its rate, y₀ + 40 y₁, from e^82 and from e^400.
    #[test]
    fn comes_down_from_any_height() {
        let density = Of(2, |y: &[f64]| {
            let ln_rate = y[0] + 40.0 * y[1];
            let slope = 5.0 - ln_rate.exp();
            (5.0 * ln_rate - ln_rate.exp(), vec![slope, 40.0 * slope])
        });
        for start in [[2.0, 2.0], [0.0, 10.0]] {
            let near = approach(&density, &start).unwrap().expect("far from the posterior");
            let value = density.log_density(&near, &mut ()).unwrap();
            assert!(value > -1e5, "{value} at {near:?}");
        }
    }

    /// Usual starts are left alone: two from the mode in every coordinate, whose scale is 1/20.
    #[test]
    fn leaves_usual_starts_alone() {
        let density = Of(3, |y: &[f64]| {
            let square: f64 = y.iter().map(|y| y * y).sum();
            (-200.0 * square, y.iter().map(|y| -400.0 * y).collect())
        });
        assert_eq!(approach(&density, &[2.0, -2.0, 1.0]).unwrap(), None);
    }
}
