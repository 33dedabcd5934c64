//! Elementary functions, compared with the functions of Rust.

use std::f64::consts::FRAC_2_SQRT_PI;

use super::*;
use crate::number::dual::Dual;

/// Compares the derivative of every elementary function with a central difference.
#[test]
fn elementary_derivatives() {
    type F = (fn(Dual<1>) -> Dual<1>, fn(f64) -> f64, f64);
    let cases: [F; 46] = [
        (Scalar::exp, f64::exp, 0.7),
        (Scalar::exp_m1, f64::exp_m1, 0.7),
        (Scalar::ln, f64::ln, 0.7),
        (Scalar::ln_1p, f64::ln_1p, 0.7),
        (Scalar::sqrt, f64::sqrt, 0.7),
        (Scalar::square, |x| x * x, 0.7),
        (Scalar::recip, f64::recip, 0.7),
        (|x| x.powi(3), |x| x.powi(3), 0.7),
        (|x| x.powf(2.5), |x| x.powf(2.5), 0.7),
        (Scalar::sin, f64::sin, 0.7),
        (Scalar::cos, f64::cos, 0.7),
        (Scalar::tan, f64::tan, 0.7),
        (Scalar::atan, f64::atan, 0.7),
        (Scalar::normal_cdf, special::normal_cdf, -0.7),
        (Scalar::ln_normal_cdf, |x| special::normal_cdf(x).ln(), -0.7),
        (Scalar::ln_gamma, special::ln_gamma, 0.7),
        (Scalar::tanh, f64::tanh, 0.7),
        (Scalar::abs, f64::abs, -0.7),
        (|x| Scalar::max(x, 0.5), |x| x.max(0.5), 0.7),
        (|x| Scalar::max(x, x * 2.0), |x| x.max(2.0 * x), 0.7),
        (|x| Scalar::min(x, 0.5), |x| x.min(0.5), 0.7),
        (|x| Scalar::min(x, x * 2.0), |x| x.min(2.0 * x), -0.7),
        (Scalar::logistic, |x| 1.0 / (1.0 + (-x).exp()), -0.7),
        (Scalar::softplus, |x| x.exp().ln_1p(), -0.7),
        (Scalar::asin, f64::asin, 0.7),
        (Scalar::acos, f64::acos, 0.7),
        (Scalar::sinh, f64::sinh, 0.7),
        (Scalar::cosh, f64::cosh, -0.7),
        (Scalar::asinh, f64::asinh, -0.7),
        (Scalar::acosh, f64::acosh, 1.7),
        (Scalar::atanh, f64::atanh, -0.7),
        (Scalar::log10, f64::log10, 0.7),
        (Scalar::log2, f64::log2, 0.7),
        (Scalar::cbrt, f64::cbrt, -0.7),
        (Scalar::logit, |x| (x / (1.0 - x)).ln(), 0.6),
        (Scalar::ln_one_minus_exp, |x| (1.0 - (-x).exp()).ln(), 0.7),
        (Scalar::erf, |x| 2.0 * special::normal_cdf(SQRT_2 * x) - 1.0, -0.7),
        (Scalar::erfc, |x| 2.0 * special::normal_cdf(-SQRT_2 * x), 1.7),
        (Scalar::normal_quantile, special::normal_quantile, 0.4),
        (|x| x.atan2(x.square()), |x| x.atan2(x * x), -0.7),
        (|x| Scalar::atan2(2.0.into(), x), |x| 2f64.atan2(x), -0.7),
        (|x| x.hypot(x.square()), |x| x.hypot(x * x), -0.7),
        (|x| x.clamp(0.0, 0.5), |x| x.clamp(0.0, 0.5), -0.7),
        (|x| x.clamp(0.0, 0.5), |x| x.clamp(0.0, 0.5), 0.7),
        (|x| x.clamp(0.0, x * 2.0), |x| x.clamp(0.0, 2.0 * x), 0.7),
        (|x| x.clamp(x.square(), 2.0), |x| x.clamp(x * x, 2.0), 0.7),
    ];
    for (number, (dual, plain, x)) in cases.into_iter().enumerate() {
        let h = 1e-5;
        let difference = (plain(x + h) - plain(x - h)) / (2.0 * h);
        let [v] = Dual::variables([x]);
        let got = dual(v);
        approx::assert_relative_eq!(got.value(), plain(x), max_relative = 1e-14);
        assert!(
            (got.gradient()[0] - difference).abs() < 1e-9,
            "function {number}: {} against {difference}",
            got.gradient()[0]
        );
    }
}

/// (0/s)ᵏ is 0 for all s and k, with derivatives 0.
#[test]
fn powers_of_zero_do_not_move() {
    let [x, s] = Dual::variables([0.0, 2.0]);
    for k in [0.3, 1.0, 2.5] {
        let [zero, p] = Dual::variables([0.0, k]);
        assert_eq!(zero.pow(p).value(), 0.0);
        assert_eq!(zero.pow(p).gradient(), [if k == 1.0 { 1.0 } else { 0.0 }, 0.0]);
        assert_eq!((Dual::from(0.0) / s).pow(Dual::from(k)).gradient(), [0.0, 0.0]);
    }
    assert!(x.pow(Dual::from(-1.0)).value().is_infinite());
}

#[test]
fn no_number_stays_none() {
    let (nan, one) = (f64::NAN, 1.0);
    let all = [(nan, one), (one, nan)];
    assert!(all.iter().all(|(a, b)| Scalar::max(*a, *b).is_nan()));
    assert!(all.iter().all(|(a, b)| Scalar::min(*a, *b).is_nan()));
}

/// Arguments at which sums cancel, compared with series: ln((½ + d)/(½ − d)) = 4d + …, erf x = 2x/√π − ….
#[test]
fn digits_survive_near_zeros() {
    approx::assert_relative_eq!(0.5.logit(), 0.0);
    let tiny = f64::powi(2.0, -40);
    approx::assert_relative_eq!(Scalar::logit(0.5 + tiny), 4.0 * tiny, max_relative = 1e-15);
    approx::assert_relative_eq!(Scalar::logit(1e-20), 1e-20f64.ln(), max_relative = 1e-15);
    approx::assert_relative_eq!(1e-9.erf(), 1e-9 * FRAC_2_SQRT_PI, max_relative = 1e-15);
    // computed with mpmath, 25 digits
    approx::assert_relative_eq!(0.7.erf(), 0.6778011938374184, max_relative = 1e-15);
    approx::assert_relative_eq!(1.7.erfc(), 0.01620954140922544, max_relative = 1e-14);
    approx::assert_relative_eq!(20.0.erfc(), 5.395865611607901e-176, max_relative = 1e-13);
}

#[test]
fn logistic_keeps_digits_in_both_tails() {
    assert_eq!(logistic(-800.0), (0.0, 1.0));
    approx::assert_relative_eq!(logistic(40.0).1, (-40.0f64).exp(), max_relative = 1e-15);
    assert_eq!(softplus(1000.0), 1000.0);
    approx::assert_relative_eq!(softplus(-40.0), (-40.0f64).exp(), max_relative = 1e-15);
}
