//! Everything vector-valued in models: reverse against forward mode and differences.

use ppl::prelude::*;
use ppl::{Ode, Solution, Workspace, check};

/// Lotka & Volterra: prey and predators.
#[derive(Clone)]
struct Predation;

impl Ode<2, 4> for Predation {
    fn initial<S: Scalar>(&self, &[prey, predators, ..]: &[S; 4]) -> [S; 2] {
        [prey, predators]
    }

    fn rate<S: Scalar>(&self, _: f64, &[u, v]: &[S; 2], &[.., growth, death]: &[S; 4]) -> [S; 2] {
        [u * (growth - v), v * (u - death)]
    }
}

ppl::model! {
    fn vectors(counts: &[[u64; 2]], scale: CholeskyFactor<f64, 2>) {
        let cut ~ Normal(0.0, 3.0).array::<3>().ordered();
        let step ~ Exponential(1.0).iid(2).ordered();
        let within ~ Uniform(0.0, 2.0).array::<2>().ordered();
        let effect ~ Normal(0.0, 1.0).array::<3>();
        for count in counts {
            let (few, many) = (count[0], count[1]);
            few ~ PoissonLog(cut[0] + effect[0]);
            many ~ PoissonLog(cut[1] * within[0] + cut[2] * within[1] + effect[1] * effect[2]);
        }

        let corr ~ LkjCholesky::<2>(1.5);
        let centre ~ MvNormalCholesky([step[0], step[1]], scale);
        let seen = [0.5, -0.2];
        seen ~ MvNormalCholesky(centre, corr.scale_rows([1.0, 2.0]));
        #[predict] let new ~ MvNormalCholesky(centre, scale);
    }
}

#[test]
fn a_model_of_vectors() {
    let scale = CholeskyFactor::new([[1.2, 0.0], [0.4, 0.8]]).unwrap();
    let counts = [[1, 2], [2, 0]];
    let model = vectors(&counts, scale);
    assert_model(&model);
    let shapes: Vec<_> = model
        .layout()
        .unwrap()
        .variables
        .iter()
        .map(|v| (v.name.as_str(), v.shape.clone()))
        .collect();
    for (name, shape) in [("cut", vec![3]), ("step", vec![2]), ("corr", vec![2, 2])] {
        assert!(shapes.contains(&(name, shape.clone())), "{name} {shape:?} in {shapes:?}");
    }
}

/// Differences, then forward against reverse mode to 10⁻¹⁰.
fn assert_model<M: ppl::Model>(model: &ppl::Bound<M>) {
    check::gradient(model, 11);
    let dim = model.layout().unwrap().dim;
    let y: Vec<f64> = (0..dim).map(|i| 0.5 * (1.7 * i as f64).sin()).collect();
    let (mut reverse, mut forward) = (vec![0.0; dim], vec![0.0; dim]);
    let value = model.gradient(&y, &mut reverse, &mut Workspace::default()).unwrap();
    let other = model.forward_gradient(&y, &mut forward).unwrap();
    assert!((other - value).abs() <= 1e-12 * value.abs().max(1.0), "{value} against {other}");
    for (i, (r, f)) in reverse.iter().zip(&forward).enumerate() {
        assert!((r - f).abs() <= 1e-10 * f.abs().max(1.0), "∂{i}: {r} against {f}");
    }
}

ppl::model! {
    fn predation(solution: &Solution<Predation, 2>, observed: &[[f64; 2]]) {
        let start ~ LogNormal(0.0, 0.2).array::<2>();
        let growth ~ LogNormal(0.0, 0.1);
        let death ~ LogNormal(0.0, 0.1);
        let states = solution.states([start[0], start[1], growth, death])?;
        for (state, y) in states.iter().zip(observed) {
            y[0] ~ LogNormal(state[0].ln(), 0.1);
            let predators = y[1];
            predators ~ LogNormal(state[1].ln(), 0.1);
        }
    }
}

#[test]
fn a_model_of_a_differential_equation() {
    let solution = Solution::new(Predation, 0.0, &[0.2, 0.5, 1.0]).unwrap();
    let solution = solution.tolerances(1e-12, 1e-12).unwrap();
    assert_model(&predation(&solution, &[[1.2, 0.9], [1.3, 1.1], [0.8, 1.2]]));
}

/// V = u − d ln u + v − g ln v is conserved; sensitivities equal differences of the states, and
/// both ways to ask for the states agree.
#[test]
fn predation_is_solved() {
    let times = [0.0, 1.0, 5.0, 20.0];
    let theta = [1.4, 0.7, 1.1, 0.9];
    let solution = Solution::new(Predation, 0.0, &times).unwrap();
    let tight = solution.clone().tolerances(1e-12, 1e-12).unwrap();
    let conserved = |[u, v]: [f64; 2]| u - 0.9 * u.ln() + v - 1.1 * v.ln();
    let states = tight.states(theta).unwrap();
    assert_eq!(states[0], [1.4, 0.7]);
    for state in &states {
        assert!((conserved(*state) - conserved([1.4, 0.7])).abs() < 1e-10, "{state:?}");
    }
    // looser tolerances are met, whatever they are
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let loose = solution.clone().tolerances(tolerance, tolerance).unwrap();
        for (a, b) in loose.states(theta).unwrap().iter().zip(&states) {
            let error = (a[0] - b[0]).abs().max((a[1] - b[1]).abs());
            assert!(error < 100.0 * tolerance, "{error:e} at tolerance {tolerance:e}");
        }
    }
    let (value, jacobian): ([f64; 8], _) = tight.value_and_jacobian(&theta).unwrap();
    assert_eq!(value, tight.value(&theta).unwrap());
    assert_eq!(value[..], states.concat()[..]);
    for i in 0..4 {
        for o in 0..8 {
            let moved = |x: f64| {
                let mut theta = theta;
                theta[i] = x;
                let value: [f64; 8] = tight.value(&theta).unwrap();
                value[o]
            };
            let expected = crate::numerics::derivative(moved, theta[i], 0.02);
            let what = format!("∂y[{o}]/∂θ[{i}]");
            crate::numerics::assert_close(jacobian[o][i], expected, 1e-7, 1e-7, &what);
        }
    }
}

/// y' = −k y and y' = y²: closed forms, and an explosion at t = 1/y₀.
#[derive(Clone, Debug)]
struct Power(i32);

impl Ode<1, 2> for Power {
    fn initial<S: Scalar>(&self, &[start, _]: &[S; 2]) -> [S; 1] {
        [start]
    }

    fn rate<S: Scalar>(&self, _: f64, &[y]: &[S; 1], &[_, k]: &[S; 2]) -> [S; 1] {
        [y.powi(self.0) * k]
    }
}

/// A dose that is taken up by the blood, in which there is nothing at first.
struct Dose;

impl Ode<2, 2> for Dose {
    fn initial<S: Scalar>(&self, _: &[S; 2]) -> [S; 2] {
        [S::from(100.0), S::from(0.0)]
    }

    fn rate<S: Scalar>(&self, _: f64, &[gut, blood]: &[S; 2], &[up, out]: &[S; 2]) -> [S; 2] {
        [-up * gut, up * gut - out * blood]
    }
}

#[test]
fn a_state_may_begin_at_zero_without_absolute_tolerance() {
    let (up, out) = (1.0, 0.2);
    let solution = Solution::new(Dose, 0.0, &[0.01, 2.0]).unwrap().tolerances(1e-9, 0.0).unwrap();
    for ([gut, blood], t) in solution.states([up, out]).unwrap().into_iter().zip([0.01, 2.0]) {
        let (left, gone) = (f64::exp(-up * t), f64::exp(-out * t));
        approx::assert_relative_eq!(gut, 100.0 * left, max_relative = 1e-7);
        let expected = 100.0 * up / (up - out) * (gone - left);
        approx::assert_relative_eq!(blood, expected, max_relative = 1e-7);
    }
}

#[test]
fn closed_forms_and_failures() {
    let decay =
        Solution::new(Power(1), 0.0, &[0.5, 3.0]).unwrap().tolerances(1e-11, 1e-11).unwrap();
    let ([a, b], [da, db]): ([f64; 2], [[f64; 2]; 2]) =
        decay.value_and_jacobian(&[2.0, -0.7]).unwrap();
    let e = |t: f64| (-0.7 * t).exp();
    for (got, expected) in [
        (a, 2.0 * e(0.5)),
        (b, 2.0 * e(3.0)),
        (da[0], e(0.5)),
        (da[1], e(0.5)),
        (db[0], e(3.0)),
        (db[1], 6.0 * e(3.0)),
    ] {
        assert!((got - expected).abs() < 1e-9, "{got} against {expected}");
    }

    let explosive = Solution::new(Power(2), 0.0, &[0.5, 2.0]).unwrap();
    let error = explosive.states([1.0, 1.0]).unwrap_err().to_string();
    assert!(error.contains("at t = 0.99") || error.contains("at t = 1"), "{error}");
    let short = decay.clone().max_steps(3).states([2.0, -0.7]).unwrap_err().to_string();
    assert!(short.contains("needs more than 3 steps"), "{short}");
    let wrong: Result<([f64; 3], _), _> =
        Differentiable::<2, 3>::value_and_jacobian(&decay, &[2.0, -0.7]);
    let expected = "Solution: number of outputs must be states × times = 2, got 3";
    assert_eq!(wrong.unwrap_err().to_string(), expected);
    let backwards = Solution::<_, 1>::new(Power(1), 0.0, &[1.0, 0.5]).unwrap_err().to_string();
    assert_eq!(backwards, "Solution: time[1] must be at or after 1, got 0.5");
    assert!(decay.clone().tolerances(0.0, 1.0).is_err());
    assert!(decay.tolerances(1e-8, -1.0).is_err());
}

/// Prey that falls to 10⁻⁷⁸: without an absolute tolerance its logarithm is as exact as that of the
/// predators (V is conserved), and so are the logarithm's derivatives; with one it is lost.
#[test]
fn states_that_nearly_vanish() {
    let theta = [1.0, 30.0, 1.0, 0.1];
    let solution = Solution::new(Predation, 0.0, &[2.0, 10.0]).unwrap();
    let relative = solution.clone().tolerances(1e-8, 0.0).unwrap();
    let conserved = |[u, v]: [f64; 2]| u - 0.1 * u.ln() + v - v.ln();
    let drift = |solution: &Solution<Predation, 2>| {
        let states = solution.states(theta).unwrap();
        assert!(states.iter().all(|[u, v]| *u > 0.0 && *v > 0.0), "{states:?}");
        let drift = states.iter().map(|s| (conserved(*s) - conserved([1.0, 30.0])).abs());
        (states[1][0], drift.fold(0.0, f64::max))
    };
    let (prey, error) = drift(&relative);
    assert!(prey < 1e-70 && error < 1e-5, "{prey:e}, off by {error:e}");
    let (prey, error) = drift(&solution);
    assert!(error > 1.0, "{prey:e}, off by {error:e}");

    let (value, jacobian): ([f64; 4], _) = relative.value_and_jacobian(&theta).unwrap();
    for i in 0..4 {
        let moved = |x: f64| {
            let mut theta = theta;
            theta[i] = x;
            relative.states(theta).unwrap()[1][0].ln()
        };
        let expected = crate::numerics::derivative(moved, theta[i], 0.02 * theta[i]);
        let what = format!("∂ln y/∂θ[{i}]");
        crate::numerics::assert_close(jacobian[2][i] / value[2], expected, 1e-5, 1e-5, &what);
    }
}

/// The global error of order 5 shrinks with the tolerance as ε^(5/5): halving the exponent of the
/// tolerance by two decades takes about two decades off the error.
#[test]
fn order_of_convergence() {
    let exact = 2.0 * (-0.7f64 * 3.0).exp();
    let error = |tolerance: f64| {
        let solution = Solution::new(Power(1), 0.0, &[3.0]).unwrap();
        let solution = solution.tolerances(tolerance, tolerance).unwrap();
        (solution.states([2.0, -0.7]).unwrap()[0][0] - exact).abs()
    };
    let ratio = error(1e-5) / error(1e-9);
    let decades = ratio.log10();
    assert!((2.5..5.5).contains(&decades), "{decades} decades for four of the tolerance");
}
