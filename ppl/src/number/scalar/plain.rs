//! Functions of `f64` numbers that the methods of [`Scalar`](super::Scalar) use.

use std::f64::consts::FRAC_2_SQRT_PI;

/// ln(x/(1 − x)); accurate near ½, where 2x − 1 and 1 − x are exact.
pub(super) fn logit(x: f64) -> f64 {
    if (0.25..0.75).contains(&x) {
        ((2.0 * x - 1.0) / (1.0 - x)).ln_1p()
    } else {
        (x / (1.0 - x)).ln()
    }
}

/// Derivative of the error function.
pub(super) fn error_density(x: f64) -> f64 {
    FRAC_2_SQRT_PI * (-x * x).exp()
}
