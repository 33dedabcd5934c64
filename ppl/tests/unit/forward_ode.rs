//! The solver of differential equations: closed forms, conserved quantities, errors.

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

/// A start that is not finite is an error for every list of output times: no comparison with NaN is true.
#[test]
fn a_start_that_is_not_finite_is_an_error() {
    for start in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for times in [&[][..], &[1.0, 2.0], &[f64::INFINITY]] {
            let solution = OdeSolution::new(Fading, start, times, [1e-8; 2]);
            let error = solution.states([1.5, 0.8]).expect_err("no start").to_string();
            assert!(error.contains("start must be finite"), "{error}");
        }
    }
}

#[test]
fn tolerances_that_no_step_meets_are_an_error() {
    for tolerances in [[0.0, 0.0], [-1e-8, 1e-8], [f64::NAN, 1e-8], [1e-8, f64::INFINITY]] {
        let solution = OdeSolution::new(Fading, 0.4, &[2.0], tolerances);
        let error = solution.states([1.5, 0.8]).expect_err("no tolerance").to_string();
        assert!(error.contains("tolerance must be finite, at least 0"), "{error}");
    }
}

/// An initial state that is not finite is an error also at an output time equal to the start, which needs no step.
#[test]
fn an_initial_state_that_is_not_finite_is_an_error() {
    for state in [f64::NAN, f64::INFINITY] {
        let solution = OdeSolution::new(Fading, 0.4, &[0.4], [1e-8; 2]);
        let error = solution.states([state, 0.8]).expect_err("no state").to_string();
        assert!(error.contains("initial state 0 must be finite"), "{error}");
    }
}

#[test]
fn an_explosion_is_an_error() {
    let solution = OdeSolution::new(Explosive, 0.0, &[0.5, 2.0], [1e-8; 2]);
    let error = solution.states([1.0]).expect_err("infinite at 1").to_string();
    assert!(error.contains("at t = 0.99") || error.contains("at t = 1"), "{error}");
}
