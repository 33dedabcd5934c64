//! All univariate families, and their truncations.

use ppl::prelude::*;

use crate::numerics::assert_close;
use ppl::check::assert_distribution;

#[test]
fn normal() {
    assert_distribution!([m, s] Normal(m, s), [0.3, 2.0], [-9.0, -1.0, 0.3, 4.0]);
    assert_distribution!([m, s] Normal(m, s), [-70.0, 0.01], [-70.02, -69.95]);
}

#[test]
fn half_normal() {
    assert_distribution!([s] HalfNormal(s), [0.7], [0.01, 0.5, 3.0]);
}

#[test]
fn log_normal() {
    assert_distribution!([m, s] LogNormal(m, s), [1.2, 0.5], [0.2, 3.0, 20.0]);
}

#[test]
fn exponential() {
    assert_distribution!([l] Exponential(l), [1.7], [0.01, 0.5, 9.0]);
}

#[test]
fn gamma() {
    assert_distribution!([a, b] Gamma(a, b), [2.5, 0.6], [0.1, 4.0, 40.0]);
    assert_distribution!([a, b] Gamma(a, b), [0.4, 3.0], [1e-4, 0.1, 4.0]);
    assert_distribution!([a, b] Gamma(a, b), [900.0, 30.0], [25.0, 30.0, 36.0]);
}

#[test]
fn beta() {
    assert_distribution!([a, b] Beta(a, b), [2.0, 6.5], [0.01, 0.2, 0.9]);
    assert_distribution!([a, b] Beta(a, b), [0.5, 0.7], [1e-3, 0.5, 0.99]);
    assert_distribution!([a, b] Beta(a, b), [300.0, 200.0], [0.5, 0.6, 0.7]);
}

#[test]
fn student_t() {
    assert_distribution!([n, m, s] StudentT(n, m, s), [4.5, 1.0, 0.5], [-3.0, 1.1, 9.0]);
    assert_distribution!([n, m, s] StudentT(n, m, s), [0.8, 0.0, 2.0], [-300.0, 0.1, 9.0]);
    assert_distribution!([n, m, s] StudentT(n, m, s), [200.0, 3.0, 1.0], [0.0, 3.2, 5.0]);
}

#[test]
fn half_cauchy() {
    assert_distribution!([s] HalfCauchy(s), [2.5], [0.01, 2.0, 500.0]);
}

#[test]
fn uniform() {
    assert_distribution!([a, b] Uniform(a, b), [-1.0, 3.5], [-0.9, 1.0, 3.3]);
    assert_distribution!([a, b] Uniform(a, b), [250.0, 300.0], [251.0, 275.0]);
}

#[test]
fn inverse_gamma() {
    assert_distribution!([a, b] InverseGamma(a, b), [3.5, 4.0], [0.4, 1.5, 9.0]);
    assert_distribution!([a, b] InverseGamma(a, b), [0.8, 0.3], [0.1, 0.4, 20.0]);
}

/// P(X ≤ 1)/P(X ≤ 2) = e⁻⁴ (1 + 4 + 8)/(e⁻² (1 + 2 + 2)) for shape 3 and scale 4.
#[test]
fn inverse_gamma_below_a_limit() {
    let distribution = InverseGamma(3.0, 4.0);
    assert_eq!(distribution.cdf(f64::NEG_INFINITY), 0.0);
    assert_eq!(distribution.sf(f64::NEG_INFINITY), 1.0);
    let share = distribution.truncate(..2.0).cdf(1.0);
    assert!((share - (-2.0f64).exp() * 13.0 / 5.0).abs() < 1e-12, "{share}");
}

#[test]
fn triangular_distribution_functions_of_nan() {
    let guess = Triangular(250.0, 270.0, 300.0);
    let values = [guess.cdf(f64::NAN), guess.sf(f64::NAN)];
    let quantiles = [guess.quantile(f64::NAN), guess.upper_quantile(f64::NAN)];
    assert!(values.into_iter().chain(quantiles).all(f64::is_nan));
}

#[test]
fn gumbel() {
    assert_distribution!([m, s] Gumbel(m, s), [10.0, 2.0], [7.0, 10.0, 25.0]);
}

#[test]
fn cauchy() {
    assert_distribution!([m, s] Cauchy(m, s), [1.0, 2.5], [-300.0, 1.2, 9.0]);
}

#[test]
fn triangular() {
    assert_distribution!(
        [a, c, b] Triangular(a, c, b), [250.0, 270.0, 300.0], [255.0, 265.0, 290.0], corner 270.0);
    assert_distribution!(
        [a, c, b] Triangular(a, c, b), [-1.0, 2.0, 3.5], [-0.5, 1.0, 3.0], corner 2.0);
}

#[test]
fn truncated_normal() {
    assert_distribution!([m, s] Normal(m, s).truncate(0.0..), [0.15, 0.25], [0.01, 0.2, 1.1]);
    assert_distribution!([m, s] Normal(m, s).truncate(..1.0), [0.5, 0.8], [-2.0, 0.1, 0.9]);
    assert_distribution!([m, s] Normal(m, s).truncate(-1.0..0.5), [0.2, 0.7], [-0.9, 0.4]);
    // 8 and 30 standard deviations from the mean, where the probability is 6e-16 and 5e-198
    assert_distribution!([m, s] Normal(m, s).truncate(9.0..), [1.0, 1.0], [9.01, 9.3]);
    assert_distribution!([m, s] Normal(m, s).truncate(..-30.0), [0.0, 1.0], [-30.01, -30.2]);
}

#[test]
fn truncated_closed_forms() {
    assert_distribution!([s] HalfNormal(s).truncate(0.2..1.5), [0.7], [0.3, 1.2]);
    assert_distribution!([s] HalfNormal(s).truncate(-1.0..1.5), [0.7], [0.1, 1.2]);
    assert_distribution!([m, s] LogNormal(m, s).truncate(1.0..9.0), [1.2, 0.5], [1.3, 7.0]);
    assert_distribution!([l] Exponential(l).truncate(2.0..5.0), [1.7], [2.3, 4.0]);
    assert_distribution!([l] Exponential(l).truncate(..0.5), [1.7], [0.1, 0.4]);
    assert_distribution!([s] HalfCauchy(s).truncate(1.0..40.0), [2.5], [1.2, 30.0]);
    assert_distribution!([s] HalfCauchy(s).truncate(10.0..), [2.5], [11.0, 300.0]);
    assert_distribution!([a, b] Uniform(a, b).truncate(0.0..), [-1.0, 3.5], [0.4, 3.0]);
    assert_distribution!([a, b] Uniform(a, b).truncate(0.0..9.0), [-1.0, 3.5], [0.4, 3.0]);
    assert_distribution!([a, b] Uniform(a, b).truncate(0.0..2.0), [-1.0, 3.5], [0.4, 1.5]);
}

#[test]
fn truncated_by_quadrature() {
    assert_distribution!([a, b] Gamma(a, b).truncate(1.0..9.0), [2.5, 0.6], [1.3, 8.0]);
    assert_distribution!([a, b] Gamma(a, b).truncate(..0.3), [0.4, 3.0], [0.01, 0.2]);
    assert_distribution!([a, b] Gamma(a, b).truncate(30.0..), [2.5, 0.6], [31.0, 36.0]);
    assert_distribution!([a, b] Beta(a, b).truncate(0.1..0.7), [2.0, 6.5], [0.2, 0.6]);
    assert_distribution!([a, b] Beta(a, b).truncate(0.2..), [0.5, 1.7], [0.3, 0.9]);
    assert_distribution!([a, b] Beta(a, b).truncate(..0.8), [0.5, 0.7], [0.01, 0.7]);
    assert_distribution!(
        [n, m, s] StudentT(n, m, s).truncate(0.0..), [4.5, 1.0, 0.5], [0.2, 1.1, 9.0]);
    assert_distribution!(
        [n, m, s] StudentT(n, m, s).truncate(-2.0..5.0), [3.0, 1.0, 2.0], [-1.0, 4.0]);
}

#[test]
fn positive() {
    assert_distribution!([a, s] Weibull(a, s), [1.7, 3.0], [0.01, 2.0, 9.0]);
    assert_distribution!([a, s] Weibull(a, s), [0.6, 0.5], [1e-4, 0.2, 9.0]);
}

#[test]
fn truncations_of_positive() {
    assert_distribution!([a, s] Weibull(a, s).truncate(1.0..4.0), [1.7, 3.0], [1.2, 3.0]);
    assert_distribution!([a, s] Weibull(a, s).truncate(20.0..), [1.7, 3.0], [20.5, 22.0]);
}

/// Two truncations equal one truncation with the tighter ends.
#[test]
fn truncations_nest() {
    assert_distribution!(
        [m, s] Normal(m, s).truncate(-1.0..).truncate(..0.5), [0.2, 0.7], [-0.9, 0.4]);
    let once: f64 = Normal(0.2, 0.7).truncate(-1.0..0.5).ln_density(&0.1);
    let twice: f64 = Normal(0.2, 0.7).truncate(-1.0..).truncate(-3.0..0.5).ln_density(&0.1);
    assert_close(twice, once, 1e-13, 0.0, "nested truncation");
}

/// The prior of the scale in the paper: 27 % of the normal distribution are truncated.
#[test]
fn the_scale_prior_of_the_paper() {
    let normal = Normal(0.15, 0.25);
    assert_close(ppl::Univariate::cdf(&normal, 0.0), 0.274_253, 1e-6, 0.0, "mass below zero");
    let prior = normal.truncate(0.0..);
    assert_close(ppl::Univariate::mean(&prior), 0.264_786, 1e-5, 0.0, "mean");
    // reference log densities of the calibration
    let golden: [([f64; 3], f64); 3] = [
        ([0.15, 0.13, 0.17], 2.357_329_399_708_21),
        ([0.2, 0.2, 0.2], 2.303_729_399_708_210_2),
        ([0.31, 0.08, 0.4], 1.619_729_399_708_210_3),
    ];
    for (sd, expected) in golden {
        let got: f64 = prior.array::<3>().ln_density(&sd);
        assert_close(got, expected, 1e-13, 0.0, "lp_sd_truncated");
    }
}
