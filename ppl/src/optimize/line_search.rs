//! Line search for argmin's L-BFGS that handles rejected points.

use argmin::core::{
    CostFunction, Error, Gradient, IterState, KV, LineSearch, Problem, Solver, State,
    TerminationReason,
};

/// State of argmin's gradient-based solvers.
type Iteration = IterState<Vec<f64>, Vec<f64>, (), (), (), f64>;

/// Wolfe parameters: `DECREASE` is the coefficient of the sufficient-decrease condition, `SLOPE` the largest allowed
/// ratio of the final slope to the initial slope.
const DECREASE: f64 = 1e-4;
const SLOPE: f64 = 0.9;
/// Largest number of trial steps, that is, of bisections and doublings.
const TRIES: u32 = 60;

/// Bisection for the weak Wolfe conditions.
///
/// An infinite cost, from a point that the density rejects, counts as a step that is too long. The slope condition
/// keeps the inverse-Hessian approximation of L-BFGS positive definite. If no step satisfies the conditions, the
/// result is the last point with a sufficient decrease, or the start.
///
/// Reference: Lewis & Overton, *Nonsmooth optimization via quasi-Newton methods*, Mathematical
/// Programming 141 (2013), section 3, doi:10.1007/s10107-012-0514-2.
#[derive(Clone, Debug)]
pub(super) struct WeakWolfe {
    direction: Vec<f64>,
    origin: Vec<f64>,
    cost: f64,
    slope: f64,
    step: f64,
    /// Longest step that is too short, and shortest step that is too long.
    bracket: [f64; 2],
    best: (Vec<f64>, f64, Vec<f64>),
    tries: u32,
}

impl WeakWolfe {
    pub(super) fn new() -> Self {
        Self {
            direction: Vec::new(),
            origin: Vec::new(),
            cost: f64::INFINITY,
            slope: 0.0,
            step: 1.0,
            bracket: [0.0, f64::INFINITY],
            best: (Vec::new(), f64::INFINITY, Vec::new()),
            tries: 0,
        }
    }
}

impl LineSearch<Vec<f64>, f64> for WeakWolfe {
    fn search_direction(&mut self, direction: Vec<f64>) {
        self.direction = direction;
    }

    fn initial_step_length(&mut self, step: f64) -> Result<(), Error> {
        self.step = step;
        Ok(())
    }
}

impl<O> Solver<O, Iteration> for WeakWolfe
where
    O: CostFunction<Param = Vec<f64>, Output = f64>
        + Gradient<Param = Vec<f64>, Gradient = Vec<f64>>,
{
    fn name(&self) -> &str {
        "weak Wolfe bisection"
    }

    fn init(
        &mut self,
        problem: &mut Problem<O>,
        mut state: Iteration,
    ) -> Result<(Iteration, Option<KV>), Error> {
        self.origin = state.take_param().unwrap_or_default();
        self.cost = state.get_cost();
        let gradient = match state.take_gradient() {
            Some(gradient) => gradient,
            None => problem.gradient(&self.origin)?,
        };
        self.slope = dot(&gradient, &self.direction);
        self.best = (self.origin.clone(), self.cost, gradient);
        Ok((state, None))
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<O>,
        state: Iteration,
    ) -> Result<(Iteration, Option<KV>), Error> {
        let point: Vec<f64> =
            self.origin.iter().zip(&self.direction).map(|(x, d)| x + self.step * d).collect();
        let cost = problem.cost(&point)?;
        let mut is_accepted = false;
        if cost <= self.cost + DECREASE * self.step * self.slope && self.slope < 0.0 {
            let gradient = problem.gradient(&point)?;
            let slope = dot(&gradient, &self.direction);
            if slope.is_finite() {
                self.bracket[0] = self.step;
                is_accepted = slope >= SLOPE * self.slope;
                self.best = (point, cost, gradient);
            } else {
                self.bracket[1] = self.step;
            }
        } else {
            self.bracket[1] = self.step;
        }
        self.tries += 1;
        let [short, long] = self.bracket;
        self.step = if long.is_finite() { 0.5 * (short + long) } else { 2.0 * short };
        let (point, cost, gradient) = self.best.clone();
        let state = state.param(point).cost(cost).gradient(gradient);
        let end = is_accepted || self.tries == TRIES || self.slope >= 0.0;
        let state =
            if end { state.terminate_with(TerminationReason::SolverConverged) } else { state };
        Ok((state, None))
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
