//! Power scaling, compared with a closed form for normal distributions.

use super::*;
use crate::special::{normal_cdf, normal_upper_quantile};

/// If one of two normal factors of N(0, 1) is raised to the power α, the result is normal. The distance of the two
/// normal distributions is computed with a fine midpoint rule over the range of the draws.
#[test]
fn a_normal_part_gives_the_closed_form() {
    let draws = 20_000;
    let x: Vec<f64> = (0..draws)
        .map(|i| -normal_upper_quantile((f64::from(i) + 0.5) / f64::from(draws)))
        .collect();
    // precision 1 of the posterior: 0.3 from the prior, whose mean is 2, and 0.7 from the likelihood
    let log_prior: Vec<f64> = x.iter().map(|x| -0.15 * (x - 2.0).powi(2)).collect();
    let scaled = power_scaled(&[&log_prior], &[&x])[0];
    assert!(scaled.pareto_k < 0.5);

    let range = normal_upper_quantile(0.5 / f64::from(draws));
    let exact = |alpha: f64| {
        let precision = 0.7 + 0.3 * alpha;
        let mean = (0.3 * alpha * 2.0 - 0.6) / precision;
        let steps = 200_000;
        let width = 2.0 * range / f64::from(steps);
        let mut sums = [Integrals::default(), Integrals::default()];
        for i in 0..steps {
            let t = (f64::from(i) + 0.5) * width - range;
            let (p, q) = (normal_cdf(t), normal_cdf((t - mean) * precision.sqrt()));
            sums[0].add(p, q, width);
            sums[1].add(1.0 - p, 1.0 - q, width);
        }
        let [a, b] = sums.map(|s| s.distance());
        a.max(b)
    };
    let expected = (exact(1.01) + exact(1.0 / 1.01)) / (2.0 * 1.01f64.log2());
    // the draws are quantiles, so that the only error is their discreteness, of order 1/draws
    assert!((scaled.sensitivity / expected - 1.0).abs() < 0.01, "{scaled:?}, {expected}");
}

#[test]
fn equal_weights_are_no_distance_and_separate_ones_the_whole() {
    let x: Vec<f64> = (0..100).map(f64::from).collect();
    assert!(cjs_distance(&x, &[0.01; 100]) < 1e-8);
    // all weight on the end: the distributions do not overlap
    let mut first = vec![0.0; 100];
    first[0] = 1.0;
    let mut last = vec![0.0; 100];
    last[99] = 1.0;
    let (a, b) = (cjs_distance(&x, &first), cjs_distance(&x, &last));
    assert!((a - 1.0).abs() < 1e-9 && (b - 1.0).abs() < 1e-9, "{a} {b}");
    assert!(cjs_distance(&[1.0, f64::NAN], &[0.5, 0.5]).is_nan());
}
