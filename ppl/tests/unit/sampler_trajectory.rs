//! Trajectories: invariance under exact draws, and memory.

use rand::SeedableRng;
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use statrs::distribution::{ContinuousCDF, Normal};

use super::{
    super::metric::{Diagonal, Metric},
    *,
};
use crate::density::{LogDensity, Rejection};
use crate::model::erased::ErasedDensity;

/// Funnel: u ~ Normal(0, 1), v | u ~ Normal(0, eᵘ). The density is curved, and exact draws are possible.
struct Funnel;

impl LogDensity for Funnel {
    type Workspace = ();

    fn dim(&self) -> usize {
        2
    }

    fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
        Ok(-0.5 * y[0] * y[0] - 0.5 * y[0] - 0.5 * y[1] * y[1] * (-y[0]).exp())
    }

    fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
        let precision = (-y[0]).exp();
        g[0] = -y[0] - 0.5 + 0.5 * y[1] * y[1] * precision;
        g[1] = -y[1] * precision;
        self.log_density(y, w)
    }
}

/// Ridge: Normal(0, 1) along the ridge and Normal(0, 0.1) across it.
struct Ridge;

impl LogDensity for Ridge {
    type Workspace = ();

    fn dim(&self) -> usize {
        2
    }

    fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
        Ok(-0.5 * y[0] * y[0] - 50.0 * y[1] * y[1])
    }

    fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
        (g[0], g[1]) = (-y[0], -100.0 * y[1]);
        self.log_density(y, w)
    }
}

/// Kolmogorov–Smirnov distance to the standard normal, times √n.
fn kolmogorov(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let normal = Normal::standard();
    let n = values.len() as f64;
    let distance = values.iter().enumerate().fold(0.0, |worst: f64, (i, x)| {
        let cdf = normal.cdf(*x);
        worst.max(cdf - i as f64 / n).max((i + 1) as f64 / n - cdf)
    });
    distance * n.sqrt()
}

/// Checks that transitions leave the density invariant, for any step and depth: the end points of transitions from
/// independent draws of the density are independent draws of the density. `exact` computes a draw from two standard
/// normals, and `standard` computes the standard normals from a draw. √n D exceeds 1.95 with probability 0.001.
fn assert_invariant(
    density: &dyn ErasedDensity,
    metric: [f64; 2],
    (max_depth, step): (u32, f64),
    exact: fn([f64; 2]) -> [f64; 2],
    standard: fn([f64; 2]) -> [f64; 2],
) {
    const CHAINS: usize = 20_000;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut hamiltonian = Hamiltonian::new(density);
    hamiltonian.metric = Metric::Diagonal(Diagonal::new(metric.to_vec()));
    let mut trajectory = Trajectory::new(2, max_depth);
    let mut point = Position::new(2);
    let mut draws = [Vec::new(), Vec::new()];
    for _ in 0..CHAINS {
        point.y.copy_from_slice(&exact([rng.sample(StandardNormal), rng.sample(StandardNormal)]));
        hamiltonian.evaluate(&mut point).expect("finite");
        for _ in 0..4 {
            let stats = trajectory
                .transition(&mut hamiltonian, &mut point, step, &mut rng)
                .expect("no fatal error");
            assert!(stats.depth <= max_depth && stats.leapfrogs < 1 << max_depth);
        }
        let values = standard([point.y[0], point.y[1]]);
        draws.iter_mut().zip(values).for_each(|(draws, value)| draws.push(value));
    }
    for (name, values) in ["first", "second"].into_iter().zip(draws) {
        let statistic = kolmogorov(values);
        assert!(statistic < 1.95, "{name}: {statistic} at depth {max_depth}, step {step}");
    }
}

#[test]
fn transitions_leave_a_funnel_invariant() {
    for case in [(1, 0.9), (3, 0.7), (10, 0.3), (10, 1.1)] {
        let exact = |[u, z]: [f64; 2]| [u, z * (0.5 * u).exp()];
        let standard = |[u, v]: [f64; 2]| [u, v * (-0.5 * u).exp()];
        assert_invariant(&Funnel, [0.7, 1.8], case, exact, standard);
    }
}

/// The step is near the limit of stability across the ridge, where the states of a long tree have very different
/// weights.
#[test]
fn transitions_leave_a_ridge_invariant() {
    for case in [(10, 0.18), (3, 0.19)] {
        assert_invariant(&Ridge, [1.0, 1.0], case, |[a, b]| [a, 0.1 * b], |[a, b]| [a, 10.0 * b]);
    }
}

/// On a flat density, paths are straight: no doubling ends with a U-turn, and all weights are equal.
#[test]
fn a_straight_path_grows_to_the_greatest_depth() {
    struct Flat;
    impl LogDensity for Flat {
        type Workspace = ();
        fn dim(&self) -> usize {
            1
        }
        fn log_density(&self, _: &[f64], _: &mut ()) -> Result<f64, Rejection> {
            Ok(0.0)
        }
        fn gradient(&self, _: &[f64], g: &mut [f64], _: &mut ()) -> Result<f64, Rejection> {
            g[0] = 0.0;
            Ok(0.0)
        }
    }
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut hamiltonian = Hamiltonian::new(&Flat);
    let mut trajectory = Trajectory::new(1, 6);
    let mut point = Position::new(1);
    hamiltonian.evaluate(&mut point).expect("finite");
    let stats =
        trajectory.transition(&mut hamiltonian, &mut point, 0.1, &mut rng).expect("no fatal error");
    assert_eq!((stats.depth, stats.leapfrogs, stats.acceptance), (6, 63, 1.0));
}
