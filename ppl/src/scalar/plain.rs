//! Functions of plain numbers that those of a [`Scalar`](super::Scalar) are made of.

use std::f64::consts::FRAC_2_SQRT_PI;

/// ln(x/(1 − x)), also near ½, where 2x − 1 and 1 − x are exact.
pub(super) fn logit(x: f64) -> f64 {
    if (0.25..0.75).contains(&x) {
        ((2.0 * x - 1.0) / (1.0 - x)).ln_1p()
    } else {
        (x / (1.0 - x)).ln()
    }
}

/// The derivative of the error function.
pub(super) fn error_density(x: f64) -> f64 {
    FRAC_2_SQRT_PI * (-x * x).exp()
}

/// σ(x) and σ(−x) = 1 − σ(x), each to full relative accuracy.
#[inline]
pub(crate) fn logistic(x: f64) -> (f64, f64) {
    let e = (-x.abs()).exp();
    let (large, small) = (1.0 / (1.0 + e), e / (1.0 + e));
    if x >= 0.0 { (large, small) } else { (small, large) }
}

/// ln(1 + eˣ) = max(x, 0) + log1p(e^{−|x|}).
#[inline]
pub(crate) fn softplus(x: f64) -> f64 {
    x.max(0.0) + (-x.abs()).exp().ln_1p()
}
