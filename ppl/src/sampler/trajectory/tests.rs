//! Trajectories against exact draws, and their memory.

use rand::SeedableRng;
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use statrs::distribution::{ContinuousCDF, Normal};

use super::{
    super::metric::{Diagonal, Metric},
    *,
};
use crate::density::{LogDensity, Rejection};

/// u ~ Normal(0, 1), v | u ~ Normal(0, eᵘ): curved, and drawn exactly.
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

/// Distance of Kolmogorov and Smirnov to the standard normal, times √n.
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

/// Exact draws stay exact: transitions from independent draws of the target leave independent
/// draws of the target, for any step and depth. √n D > 1.95 has probability 0.001.
#[test]
fn transitions_leave_the_target_invariant() {
    const CHAINS: usize = 20_000;
    for (max_depth, step) in [(1, 0.9), (3, 0.7), (10, 0.3), (10, 1.1)] {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
        let mut hamiltonian = Hamiltonian::new(&Funnel);
        hamiltonian.metric = Metric::Diagonal(Diagonal::new(vec![0.7, 1.8]));
        let mut trajectory = Trajectory::new(2, max_depth);
        let mut point = Point::new(2);
        let (mut us, mut vs) = (Vec::new(), Vec::new());
        for _ in 0..CHAINS {
            let (u, z): (f64, f64) = (rng.sample(StandardNormal), rng.sample(StandardNormal));
            point.y.copy_from_slice(&[u, z * (0.5 * u).exp()]);
            hamiltonian.evaluate(&mut point).expect("finite");
            for _ in 0..4 {
                let stats = trajectory
                    .transition(&mut hamiltonian, &mut point, step, &mut rng)
                    .expect("no fatal error");
                assert!(stats.depth <= max_depth && stats.leapfrogs < 1 << max_depth);
            }
            us.push(point.y[0]);
            vs.push(point.y[1] * (-0.5 * point.y[0]).exp());
        }
        for (name, values) in [("u", us), ("v", vs)] {
            let statistic = kolmogorov(values);
            assert!(statistic < 1.95, "{name}: {statistic} at depth {max_depth}, step {step}");
        }
    }
}

/// A flat density has straight paths: no turn in any number of doublings, all weights equal.
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
    let mut point = Point::new(1);
    hamiltonian.evaluate(&mut point).expect("finite");
    let stats =
        trajectory.transition(&mut hamiltonian, &mut point, 0.1, &mut rng).expect("no fatal error");
    assert_eq!((stats.depth, stats.leapfrogs, stats.acceptance), (6, 63, 1.0));
}
