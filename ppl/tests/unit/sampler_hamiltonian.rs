//! Hamiltonian dynamics on an anharmonic density.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{super::metric::Diagonal, *};
use crate::density::LogDensity;

/// The density ln p = −Σ yᵢ⁴/4 − y₀y₁/3, which is anharmonic and coupled.
struct Quartic;

impl LogDensity for Quartic {
    type Workspace = ();

    fn dim(&self) -> usize {
        2
    }

    fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
        Ok(-(y[0].powi(4) + y[1].powi(4)) / 4.0 - y[0] * y[1] / 3.0)
    }

    fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
        g[0] = -y[0].powi(3) - y[1] / 3.0;
        g[1] = -y[1].powi(3) - y[0] / 3.0;
        self.log_density(y, w)
    }
}

fn start(hamiltonian: &mut Hamiltonian<'_>) -> Phase {
    hamiltonian.metric = Metric::Diagonal(Diagonal::new(vec![0.5, 2.0]));
    let mut phase = Phase::new(2);
    phase.point.y.copy_from_slice(&[0.8, -1.1]);
    hamiltonian.evaluate(&mut phase.point).expect("finite everywhere");
    hamiltonian.refresh(&mut phase, &mut Xoshiro256PlusPlus::seed_from_u64(3));
    phase
}

/// Returns the largest energy error over a fixed time with the given number of steps.
fn error(steps: usize) -> f64 {
    let mut hamiltonian = Hamiltonian::new(&Quartic);
    let mut phase = start(&mut hamiltonian);
    let energy = phase.energy();
    (0..steps)
        .map(|_| hamiltonian.leapfrog(&mut phase, 2.0 / steps as f64).expect("no fatal error"))
        .fold(0.0, |worst: f64, e| worst.max((e - energy).abs()))
}

#[test]
fn the_energy_error_is_of_second_order() {
    for steps in [100, 200, 400] {
        let order = (error(steps) / error(2 * steps)).log2();
        assert!((order - 2.0).abs() < 0.02, "order {order} at {steps} steps");
    }
}

#[test]
fn a_leapfrog_path_runs_back_to_its_start() {
    let mut hamiltonian = Hamiltonian::new(&Quartic);
    let first = start(&mut hamiltonian);
    let mut phase = first.clone();
    for step in [0.07, -0.07] {
        for _ in 0..50 {
            hamiltonian.leapfrog(&mut phase, step).expect("no fatal error");
        }
    }
    for i in 0..2 {
        approx::assert_abs_diff_eq!(phase.point.y[i], first.point.y[i], epsilon = 1e-12);
        approx::assert_abs_diff_eq!(phase.p[i], first.p[i], epsilon = 1e-12);
    }
}

/// Checks that on average over momenta, the acceptance crosses the threshold between ε and 2ε.
#[test]
fn the_step_search_brackets_the_threshold() {
    let mut hamiltonian = Hamiltonian::new(&Quartic);
    let point = start(&mut hamiltonian).point;
    let mut phase = Phase::new(2);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    for first in [1e-6, 1e6] {
        let step =
            hamiltonian.search_step(&point, &mut phase, first, &mut rng).expect("no fatal error");
        assert!((0.1..4.0).contains(&step), "{step}");
    }
}
