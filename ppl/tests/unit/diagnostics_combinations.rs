//! Detection of parameters of which the data determine only a combination, for constructed draws.

use super::*;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Returns columns with standard normal prior draws, and with posterior draws computed from standard normal noise.
fn columns(count: usize, noise: usize, posterior: fn(&[f64]) -> Vec<f64>) -> Vec<BeforeAndAfter> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(count as u64);
    let mut normals =
        |n: usize| -> Vec<f64> { (0..n).map(|_| rng.sample(StandardNormal)).collect() };
    let priors: Vec<Vec<f64>> = (0..count).map(|_| normals(2000)).collect();
    let draws: Vec<Vec<f64>> = (0..2000).map(|_| posterior(&normals(noise))).collect();
    let column = |k: usize| draws.iter().map(|d| d[k]).collect();
    let prior = priors.into_iter().enumerate();
    prior.map(|(k, prior)| BeforeAndAfter { prior, posterior: column(k) }).collect()
}

fn members(columns: &[BeforeAndAfter]) -> Vec<Vec<usize>> {
    combinations(columns).into_iter().map(|combination| combination.members).collect()
}

/// The data determine a + b, c + d + e and f, but no other parameter alone.
#[test]
fn sums_are_told_apart() {
    let found = columns(6, 4, |z| {
        let pair = z[0] / 2_f64.sqrt();
        // points on the plane c + d + e = 0, with the variance of the prior
        let (u, v) = (z[1] / 2_f64.sqrt(), z[2] / 6_f64.sqrt());
        vec![pair, 0.02 * z[3] - pair, u + v, v - u, -2.0 * v, 0.05 * z[3]]
    });
    assert_eq!(members(&found), [vec![0, 1], vec![2, 3, 4]]);
    assert!((combinations(&found)[0].correlation + 1.0).abs() < 0.01);
}

/// There is no combination without columns, for one parameter that the data inform, and for one that they do not
/// inform.
#[test]
fn one_parameter_is_no_combination() {
    assert_eq!(members(&[]), Vec::<Vec<usize>>::new());
    assert_eq!(members(&columns(1, 1, |z| vec![0.1 * z[0]])), Vec::<Vec<usize>>::new());
    assert_eq!(members(&columns(1, 1, |z| vec![2.0 * z[0]])), Vec::<Vec<usize>>::new());
}

/// Three cases without a combination: correlated but informed parameters, uninformed but uncorrelated parameters, and
/// weakly informed parameters.
#[test]
fn correlation_alone_is_no_lack_of_data() {
    let known = columns(2, 2, |z| vec![0.3 * z[0], 0.3 * z[0] + 0.01 * z[1]]);
    assert_eq!(members(&known), Vec::<Vec<usize>>::new());
    let unknown = columns(2, 2, |z| z.to_vec());
    assert_eq!(members(&unknown), Vec::<Vec<usize>>::new());
    let half = columns(2, 2, |z| vec![0.7 * (z[0] + 0.7 * z[1]), 0.7 * (0.7 * z[1] - z[0])]);
    assert_eq!(members(&half), Vec::<Vec<usize>>::new());
}

/// A third parameter that is correlated with the direction accounts for the common part of the effects in a hierarchy.
#[test]
fn what_another_parameter_takes_up_is_left_out() {
    let found = columns(3, 3, |z| {
        let common = z[0] / 2_f64.sqrt();
        vec![common, common + 0.02 * z[1], 0.05 * z[2] - 0.1 * common]
    });
    assert_eq!(members(&found), Vec::<Vec<usize>>::new());
}
