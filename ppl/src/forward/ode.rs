//! Ordinary differential equations whose parameters are unknowns.

use crate::density::DomainError;
use crate::number::dual::Dual;
use crate::number::scalar::Scalar;

/// An initial value problem dy/dt = f(t, y, θ), y(t₀) = y₀(θ), with N states and D parameters, written once over any
/// [`Scalar`].
pub trait Ode<const N: usize, const D: usize>: Sync {
    /// Initial states y₀(θ).
    fn initial<S: Scalar>(&self, theta: &[S; D]) -> [S; N];

    /// Rates f(t, y, θ).
    fn rate<S: Scalar>(&self, t: f64, y: &[S; N], theta: &[S; D]) -> [S; N];
}

/// The solution of an [`Ode`] at given times, as a function of its D parameters; for problems that are not stiff.
///
/// The explicit method of Dormand and Prince has order 5 and an error estimate of order 4. It chooses steps with errors
/// below `absolute + relative · |y|` per step, and ends a step at every output time. Derivatives with respect to θ are
/// computed with dual numbers through the same steps. The steps depend on the values only, so that a value does not
/// depend on whether derivatives are computed. If data are compared with the logarithm of a state, the absolute
/// tolerance must be 0, because a state below the absolute tolerance has no correct digit.
///
/// # Example
/// ```
/// use ppl::prelude::*;
/// use ppl::{Ode, OdeSolution};
///
/// /// First-order decay from 10 at the rate k.
/// struct Decay;
///
/// impl Ode<1, 1> for Decay {
///     fn initial<S: Scalar>(&self, _: &[S; 1]) -> [S; 1] {
///         [S::from(10.0)]
///     }
///     fn rate<S: Scalar>(&self, _: f64, y: &[S; 1], k: &[S; 1]) -> [S; 1] {
///         [-k[0] * y[0]]
///     }
/// }
///
/// ppl::model! {
///     fn decay(solution: &OdeSolution<Decay, 1>, measured: &[f64]) {
///         let k ~ LogNormal(0.0, 1.0);
///         let states = solution.states([k])?;
///         for (state, y) in states.iter().zip(measured) {
///             y ~ Normal(state[0], 0.1);
///         }
///     }
/// }
/// let solution = OdeSolution::new(Decay, 0.0, &[1.0, 2.0], [1e-13, 1e-13]);
/// let states = solution.states([0.5])?;
/// assert!((states[1][0] - 10.0 * (-1.0f64).exp()).abs() < 1e-6);
/// ppl::check::gradient(&decay(&solution, &[6.1, 3.6]), 1);
/// # Ok::<(), ppl::DomainError>(())
/// ```
///
/// # References
/// Dormand & Prince (1980), *A Family of Embedded Runge–Kutta Formulae*, doi:10.1016/0771-050X(80)90013-3; Hairer,
/// Nørsett & Wanner (1993), *Solving Ordinary Differential Equations I*, II.4 (step size control).
#[derive(Clone, Debug)]
pub struct OdeSolution<F, const N: usize> {
    system: F,
    start: f64,
    times: Vec<f64>,
    relative: f64,
    absolute: f64,
}

impl<F, const N: usize> OdeSolution<F, N> {
    /// Creates the solution from the time `start` at the ascending `times`, with a relative and an absolute tolerance.
    pub fn new(system: F, start: f64, times: &[f64], [relative, absolute]: [f64; 2]) -> Self {
        Self { system, start, times: times.to_vec(), relative, absolute }
    }

    /// States at every output time. In a model, each state is one operation on the tape.
    ///
    /// # Errors
    /// [`DomainError`] if an output time precedes the start or the output time before it, or if the steps become too
    /// small or too many.
    pub fn states<S: Scalar, const D: usize>(
        &self,
        theta: [S; D],
    ) -> Result<Vec<[S; N]>, DomainError>
    where
        F: Ode<N, D>,
    {
        let point = theta.map(Scalar::value);
        let mut states = Vec::with_capacity(self.times.len());
        if S::DIFFERENTIABLE {
            self.integrate(Dual::variables(point), |y: &[Dual<D>; N]| {
                states.push(y.map(|y| S::fuse(y.value(), theta, y.gradient())));
            })?;
        } else {
            self.integrate(point, |y: &[f64; N]| states.push(y.map(S::from)))?;
        }
        Ok(states)
    }

    /// Calls `output` with the states at every output time.
    fn integrate<S: Scalar, const D: usize>(
        &self,
        theta: [S; D],
        mut output: impl FnMut(&[S; N]),
    ) -> Result<(), DomainError>
    where
        F: Ode<N, D>,
    {
        let rate = |t: f64, y: &[S; N]| self.system.rate(t, y, &theta);
        let mut t = self.start;
        let mut y = self.system.initial(&theta);
        let mut first = rate(t, &y);
        let mut step = self.first_step(&y, &first, |y| rate(t, y));
        let mut steps = 0;
        for &time in &self.times {
            if time.is_nan() || time < t {
                return Err(DomainError::new(format!(
                    "OdeSolution: the output time {time} follows the time {t}: give times in ascending order, none of them before the start"
                )));
            }
            while t < time {
                if steps == MOST_STEPS {
                    return Err(failure(&format!("needs more than {steps} steps"), t));
                }
                steps += 1;
                // a step that would end just before the output time is extended to the output time
                let lands = t + step * (1.0 + 1e-10) >= time;
                let length = if lands { time - t } else { step };
                let (next, last, error) = self.attempt(&rate, t, length, &y, &first);
                // a NaN state counts as an error that is too large
                let accepted = error <= 1.0;
                if accepted {
                    t = if lands { time } else { t + length };
                    (y, first) = (next, last);
                }
                let factor = if error.is_nan() { 0.2 } else { 0.9 * error.powf(-0.2) };
                let proposed = length * factor.clamp(0.2, if accepted { 5.0 } else { 1.0 });
                // a step that the output time shortened does not limit the next step
                step = if accepted && lands { proposed.max(step) } else { proposed };
                // the step is NaN if a rate at the start is NaN
                let advances = t + step * 1e-3 > t;
                if !advances && t < time {
                    return Err(failure("fails even for the smallest step", t));
                }
            }
            output(&y);
        }
        Ok(())
    }

    /// Root mean square of the errors, in units of the tolerance.
    fn norm<S: Scalar>(&self, error: &[f64; N], y: &[S; N], other: &[S; N]) -> f64 {
        let scaled = |i: usize| {
            let size = y[i].value().abs().max(other[i].value().abs());
            let tolerance = self.absolute + self.relative * size;
            // a state that remains 0 has no error, also if its tolerance is 0
            if error[i] == 0.0 { 0.0 } else { (error[i] / tolerance).powi(2) }
        };
        ((0..N).map(scaled).sum::<f64>() / N as f64).sqrt()
    }

    /// Length of the first step: the error of an explicit Euler step of this length is about a hundredth of the states
    /// (Hairer et al.). A state that begins at 0 is ignored if the absolute tolerance is 0.
    fn first_step<S: Scalar>(
        &self,
        y: &[S; N],
        first: &[S; N],
        rate: impl Fn(&[S; N]) -> [S; N],
    ) -> f64 {
        let has_unit = |i: usize| self.absolute > 0.0 || y[i].value() != 0.0;
        let values = |y: &[S; N]| -> [f64; N] {
            std::array::from_fn(|i| if has_unit(i) { y[i].value() } else { 0.0 })
        };
        let (size, slope) = (self.norm(&values(y), y, y), self.norm(&values(first), y, y));
        let trial = if size < 1e-5 || slope < 1e-5 { 1e-6 } else { 0.01 * size / slope };
        let moved = std::array::from_fn(|i| y[i] + first[i] * trial);
        let (before, after) = (values(first), values(&rate(&moved)));
        let bend: [f64; N] = std::array::from_fn(|i| after[i] - before[i]);
        let bend = self.norm(&bend, y, y) / trial;
        let largest = slope.max(bend);
        let step =
            if largest <= 1e-15 { (trial * 1e-3).max(1e-6) } else { (0.01 / largest).powf(0.2) };
        step.min(100.0 * trial)
    }

    /// States after a step, rates at the end of the step, and the error in units of the tolerance.
    fn attempt<S: Scalar>(
        &self,
        rate: &impl Fn(f64, &[S; N]) -> [S; N],
        t: f64,
        h: f64,
        y: &[S; N],
        first: &[S; N],
    ) -> ([S; N], [S; N], f64) {
        let mut rates = [*first; 7];
        let mut end = *y;
        for (stage, weights) in STAGES.iter().enumerate() {
            let used = &rates[..=stage];
            end = std::array::from_fn(|i| {
                let terms = || used.iter().zip(weights).map(|(k, w)| (k[i], h * w));
                let value = y[i].value() + terms().map(|(k, w)| k.value() * w).sum::<f64>();
                S::fuse_iter(value, terms().chain([(y[i], 1.0)]))
            });
            rates[stage + 1] = rate(t + h * TIMES[stage], &end);
        }
        let error = std::array::from_fn(|i| {
            h * rates.iter().zip(ERROR).map(|(k, w)| k[i].value() * w).sum::<f64>()
        });
        (end, rates[6], self.norm(&error, y, &end))
    }
}

fn failure(what: &str, t: f64) -> DomainError {
    DomainError::new(format!(
        "OdeSolution: the solver {what} at t = {t}: the equation may be stiff or singular there"
    ))
}

/// Limit of the number of steps, beyond which the problem is assumed to be stiff.
const MOST_STEPS: usize = 100_000;

/// Times of the stages after the first, as fractions of the step.
const TIMES: [f64; 6] = [1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0];

/// Weights of the earlier rates in each stage; the last stage is the solution of order 5.
const STAGES: [[f64; 6]; 6] = [
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];

/// Weights of the difference between the solutions of order 5 and 4.
const ERROR: [f64; 7] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339_200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

#[cfg(test)]
mod tests {
    use super::*;

    /// The equation dy/dt = −2 a t y, whose rate depends explicitly on time. The solution is y = y₀ exp(−a (t² − t₀²)).
    struct Fading;

    impl Ode<1, 2> for Fading {
        fn initial<S: Scalar>(&self, &[start, _]: &[S; 2]) -> [S; 1] {
            [start]
        }

        fn rate<S: Scalar>(&self, t: f64, &[y]: &[S; 1], &[_, a]: &[S; 2]) -> [S; 1] {
            [y * a * (-2.0 * t)]
        }
    }

    /// Predator–prey equations u' = u (1.1 − v) and v' = v (u − 0.9).
    struct Predation;

    impl Ode<2, 2> for Predation {
        fn initial<S: Scalar>(&self, theta: &[S; 2]) -> [S; 2] {
            *theta
        }

        fn rate<S: Scalar>(&self, _: f64, &[u, v]: &[S; 2], _: &[S; 2]) -> [S; 2] {
            [u * (-v + 1.1), v * (u - 0.9)]
        }
    }

    /// The equation y' = y², whose solution diverges at t = 1/y₀.
    struct Explosive;

    impl Ode<1, 1> for Explosive {
        fn initial<S: Scalar>(&self, &[start]: &[S; 1]) -> [S; 1] {
            [start]
        }

        fn rate<S: Scalar>(&self, _: f64, &[y]: &[S; 1], _: &[S; 1]) -> [S; 1] {
            [y * y]
        }
    }

    /// Compares with the closed form of an equation whose rate depends on time. Wrong stage times would cause an error
    /// of first order for every tolerance.
    #[test]
    fn rates_that_depend_on_time_have_their_closed_form() {
        let (start, a) = (1.5, 0.8);
        let solution = OdeSolution::new(Fading, 0.4, &[0.9, 2.0], [1e-11, 1e-13]);
        let states = solution.states(Dual::variables([start, a])).expect("solvable");
        for ([state], t) in states.into_iter().zip([0.9f64, 2.0]) {
            let elapsed = t * t - 0.16;
            let exact = start * (-a * elapsed).exp();
            let [in_start, in_a] = state.gradient();
            approx::assert_relative_eq!(state.value(), exact, max_relative = 1e-9);
            approx::assert_relative_eq!(in_start, exact / start, max_relative = 1e-9);
            approx::assert_relative_eq!(in_a, -elapsed * exact, max_relative = 1e-9);
        }
    }

    /// Checks the order 5 of the method: the global error decreases with the tolerance.
    #[test]
    fn order_of_convergence() {
        let exact = 1.5 * (-0.8f64 * (4.0 - 0.16)).exp();
        let error = |tolerance: f64| {
            let solution = OdeSolution::new(Fading, 0.4, &[2.0], [tolerance; 2]);
            (solution.states([1.5, 0.8]).expect("solvable")[0][0] - exact).abs()
        };
        let decades = (error(1e-5) / error(1e-9)).log10();
        assert!(
            (2.5..5.5).contains(&decades),
            "the error decreased by {decades} decades, the tolerance by four"
        );
    }

    /// Returns the largest change of the conserved quantity u − 0.9 ln u + v − 1.1 ln v, and the smallest prey
    /// population.
    fn drift(start: [f64; 2], tolerances: [f64; 2]) -> (f64, f64) {
        let conserved = |[u, v]: [f64; 2]| u - 0.9 * u.ln() + v - 1.1 * v.ln();
        let solution = OdeSolution::new(Predation, 0.0, &[2.0, 10.0], tolerances);
        let states = solution.states(start).expect("solvable");
        let change = |state: &[f64; 2]| (conserved(*state) - conserved(start)).abs();
        let least = states.iter().map(|[u, _]| *u).fold(f64::INFINITY, f64::min);
        (states.iter().map(change).fold(0.0, f64::max), least)
    }

    #[test]
    fn a_cycle_is_closed() {
        assert!(drift([1.4, 0.7], [1e-12; 2]).0 < 1e-9);
    }

    /// Checks a prey population that nearly vanishes: the logarithm of the population is accurate if the solver
    /// has no absolute tolerance, and inaccurate if it has an absolute tolerance.
    #[test]
    fn states_that_nearly_vanish() {
        let (change, least) = drift([1.0, 30.0], [1e-9, 0.0]);
        assert!(least < 1e-10 && change < 1e-4, "{least:e}, off by {change:e}");
        let (change, _) = drift([1.0, 30.0], [1e-8; 2]);
        assert!(change > 1e-2, "off by {change:e}");
    }

    #[test]
    fn times_that_descend_are_an_error() {
        for times in [[2.0, 1.0], [0.3, 1.0], [f64::NAN, 1.0]] {
            let solution = OdeSolution::new(Fading, 0.4, &times, [1e-8; 2]);
            let error = solution.states([1.5, 0.8]).expect_err("not ascending").to_string();
            assert!(error.contains("ascending"), "{error}");
        }
    }

    /// A rate that is NaN at the start is an error after one step, not after the limit of steps.
    #[test]
    fn a_rate_that_is_nan_is_an_error() {
        let solution = OdeSolution::new(Fading, 0.4, &[2.0], [1e-8; 2]);
        let error = solution.states([1.5, f64::NAN]).expect_err("NaN").to_string();
        assert!(error.contains("smallest step"), "{error}");
    }

    #[test]
    fn an_explosion_is_an_error() {
        let solution = OdeSolution::new(Explosive, 0.0, &[0.5, 2.0], [1e-8; 2]);
        let error = solution.states([1.0]).expect_err("infinite at 1").to_string();
        assert!(error.contains("at t = 0.99") || error.contains("at t = 1"), "{error}");
    }
}
