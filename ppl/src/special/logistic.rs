//! Logistic function and softplus function.

/// Returns σ(x) and σ(−x) = 1 − σ(x) of the logistic function σ, each with full relative accuracy.
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
