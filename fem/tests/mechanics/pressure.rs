//! Pressure on surfaces, dead and normal to the deformed surface: closed forms of homogeneous states.

use crate::support::block::{block, even};
use fem::{
    Axis, Conditions, End, FemError, LinearScheme, Material, MaterialParameter, Order, Outcome,
    Problem, Schedule, SolverOptions, TetMesh, Unsupported,
};

const YOUNG: f64 = 100.0;
const POISSON: f64 = 0.3;
const BULK: f64 = YOUNG / (3.0 * (1.0 - 2.0 * POISSON));
const SHEAR: f64 = YOUNG / (2.0 * (1.0 + POISSON));
const ORDERS: [Order; 2] = [Order::Linear, Order::Quadratic];
const LINEAR: [LinearScheme; 2] = [LinearScheme::Direct, LinearScheme::Multigrid];

/// Mesh of a block of 2 × 3 × 4 mm.
fn body() -> TetMesh {
    block([&[0.0, 0.5, 1.3, 2.0], &[0.0, 1.2, 3.0], &even(0.0, 4.0, 3)])
}

fn problem(order: Order, linear: LinearScheme, conditions: Conditions, steps: u32) -> Problem {
    let options = SolverOptions { tolerance: 1e-11, linear, ..SolverOptions::default() };
    Problem::builder(body())
        .order(order)
        .materials([Material::hencky(YOUNG, POISSON)])
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, steps))
        .options(options)
        .build()
        .expect("valid")
}

fn run(order: Order, linear: LinearScheme, conditions: Conditions, steps: u32) -> Outcome {
    let outcome = problem(order, linear, conditions, steps).run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{order:?} {linear:?}: {:?}", outcome.end);
    outcome
}

/// Root of a function that increases from `low` to `high`.
fn root(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (low, high);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if f(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Stretch of a body under a pressure normal to the deformed surface: the Kirchhoff stress K ln J is −p J.
fn stretch_of_fluid(p: f64) -> f64 {
    root(0.5, 2.0, |x| 3.0 * BULK * x.ln() + p * x.powi(3))
}

/// Stretch under a dead pressure: the first Piola–Kirchhoff stress K ln J/λ is −p.
fn stretch_of_dead(p: f64) -> f64 {
    root(0.5, 2.0, |x| 3.0 * BULK * x.ln() / x + p)
}

/// Largest distance of the deformed nodes from the positions `map`, mm.
fn off(outcome: &Outcome, nodes: &[[f64; 3]], map: impl Fn([f64; 3]) -> [f64; 3]) -> f64 {
    let at = |n: usize| {
        let u = outcome.fields.displacement[n];
        [0, 1, 2].map(|k| nodes[n][k] + u[k])
    };
    let distance = |n: usize| {
        let (x, mapped) = (at(n), map(nodes[n]));
        (0..3).map(|k| (x[k] - mapped[k]).abs()).fold(0.0, f64::max)
    };
    (0..nodes.len()).map(distance).fold(0.0, f64::max)
}

#[test]
fn pressure_compresses_the_body_by_its_bulk_modulus() {
    let largest = 30.0;
    for order in ORDERS {
        for linear in LINEAR {
            for follows in [true, false] {
                let mut conditions =
                    Conditions::new().symmetry("left").symmetry("front").symmetry("bottom");
                for face in ["right", "back", "top"] {
                    conditions = if follows {
                        conditions.follower_pressure(face, move |_, t| largest * t)
                    } else {
                        conditions.pressure(face, move |_, t| largest * t)
                    };
                }
                let conditions = conditions.measure("top", [0.0, 0.0, -1.0]);
                let problem = problem(order, linear, conditions, 4);
                let outcome = problem.run(&mut ());
                let case = format!("{order:?} {linear:?} follower: {follows}");
                assert!(matches!(outcome.end, End::Displacement), "{case}: {:?}", outcome.end);
                let exact =
                    if follows { stretch_of_fluid(largest) } else { stretch_of_dead(largest) };
                let error = off(&outcome, problem.nodes(), |x| x.map(|x| exact * x));
                assert!(error < 1e-8, "{case}: {error} mm, stretch {exact}");
                // the force on the top is p times its deformed or its reference area
                let area = 6.0 * if follows { exact * exact } else { 1.0 };
                let force = outcome.curve.last().expect("points").force_n;
                assert!((force - largest * area).abs() < 1e-7 * force, "{case}: {force} N");
                // the work of the pressure is the elastic energy; the trapezoidal rule in four steps has an error
                let last = outcome.curve.last().expect("points");
                let energy = last.elastic_n_mm;
                assert!((last.work_n_mm - energy).abs() < 0.01 * energy, "{case}: {last:?}");
                println!("{case}: {:?}", outcome.effort);
            }
        }
    }
    assert!((stretch_of_fluid(largest) - stretch_of_dead(largest)).abs() > 1e-3);
}

/// A body under constant pressure turns with its lower end by 90 degrees; the pressure turns with it, so that the stress
/// does not change. A dead pressure would not.
#[test]
fn pressure_turns_with_the_body() {
    let p = 20.0;
    let stretch = stretch_of_fluid(p);
    let turned = move |x: [f64; 3], t: f64| {
        let (sin, cos) = (std::f64::consts::FRAC_PI_2 * t).sin_cos();
        [x[0], cos * x[1] - sin * x[2], sin * x[1] + cos * x[2]].map(|x| stretch * x)
    };
    for order in ORDERS {
        let mut conditions = Conditions::new().prescribe("bottom", Axis::ALL, move |x, t| {
            let to = turned(x, t);
            [0, 1, 2].map(|k| to[k] - x[k])
        });
        for face in ["left", "right", "front", "back", "top"] {
            conditions = conditions.follower_pressure(face, move |_, _| p);
        }
        let conditions = conditions.measure("bottom", [0.0, 0.0, 1.0]).first_guess(move |x, t| {
            let to = turned(x, t);
            [0, 1, 2].map(|k| to[k] - x[k])
        });
        let problem = problem(order, LinearScheme::Direct, conditions, 9);
        let outcome = problem.run(&mut ());
        assert!(matches!(outcome.end, End::Displacement), "{order:?}: {:?}", outcome.end);
        let error = off(&outcome, problem.nodes(), |x| turned(x, 1.0));
        assert!(error < 1e-7, "{order:?}: {error} mm");
        // the bottom, whose normal is now along y, balances the pressure on the top
        let force = outcome.reactions["bottom"].last().expect("points");
        let exact = p * 6.0 * stretch * stretch;
        assert!((force[1].abs() - exact).abs() < 1e-6 * exact, "{order:?}: {force:?} {exact}");
        let state = problem.evaluate(&outcome.fields).expect("fields");
        for element in state.elements().expect("sound") {
            let mean = -element.stress_mpa[..3].iter().sum::<f64>() / 3.0;
            assert!((mean - p).abs() < 1e-6 * p, "{order:?}: {:?}", element.stress_mpa);
        }
    }
}

/// Triaxial compression: a constant confining pressure on the sides, and axial compression.
#[test]
fn confined_compression_has_the_stress_of_the_homogeneous_state() {
    let p = 5.0;
    for order in ORDERS {
        for linear in LINEAR {
            let mut conditions =
                Conditions::new()
                    .fix("bottom", [Axis::Z])
                    .prescribe("top", [Axis::Z], |_, t| [0.0, 0.0, -0.8 * t]);
            for face in ["left", "right", "front", "back"] {
                conditions = conditions.follower_pressure(face, move |_, _| p);
            }
            let conditions = conditions.remove_rigid_motions().measure("top", [0.0, 0.0, -1.0]);
            let outcome = run(order, linear, conditions, 4);
            for point in &outcome.curve {
                let axial = (1.0 - point.displacement_mm / 4.0).ln();
                let lame = BULK - 2.0 / 3.0 * SHEAR;
                let kirchhoff =
                    |lateral: f64, e: f64| lame * (axial + 2.0 * lateral) + 2.0 * SHEAR * e;
                let lateral = root(-1.0, 1.0, |lateral| {
                    kirchhoff(lateral, lateral) + p * (axial + 2.0 * lateral).exp()
                });
                // the force is the Kirchhoff stress times the reference volume over the length
                let exact = -kirchhoff(lateral, axial) * 6.0 / axial.exp();
                assert!(
                    (point.force_n - exact).abs() < 1e-7 * exact,
                    "{order:?} {linear:?}: {point:?} {exact}"
                );
            }
        }
    }
}

#[test]
fn combinations_that_are_not_supported_are_refused() {
    let conditions = || {
        Conditions::new()
            .fix("bottom", Axis::ALL)
            .follower_pressure("top", |_, t| t)
            .measure("bottom", [0.0, 0.0, 1.0])
    };
    let refusal_of = |conditions: Conditions| {
        let young = MaterialParameter::new("young", YOUNG, |x| vec![Material::hencky(x, POISSON)]);
        let plain = problem(Order::Linear, LinearScheme::Direct, conditions, 1);
        match plain.with_sensitivities(vec![young]) {
            Err(FemError::Unsupported { reason, .. }) => Some(reason),
            _ => None,
        }
    };
    assert_eq!(refusal_of(conditions()), Some(Unsupported::SensitivitiesOfFollower));

    // the displacement of a loaded surface is a result, so that its derivative is not zero
    let loaded = |surface: &str| {
        Conditions::new()
            .fix("bottom", Axis::ALL)
            .traction("top", |_, t| [0.0, 0.0, t])
            .measure(surface, [0.0, 0.0, 1.0])
    };
    let reason = Some(Unsupported::SensitivitiesOfMeasuredDisplacement);
    assert_eq!(refusal_of(loaded("top")), reason);
    assert_eq!(refusal_of(loaded("bottom")), None);
}
