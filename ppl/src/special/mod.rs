//! Special functions that are accurate in the tails, for large arguments and near cancellation.
//!
//! The module contains only functions that `statrs` lacks or computes less accurately than log densities require. Log
//! gamma functions enter densities through the Stirling error δ(x), so that large terms cancel analytically and not
//! numerically (Loader 2000, *Fast and Accurate Computation of Binomial Probabilities*).
//!
//! # Example
//! ```
//! use ppl::special::{NormalInterval, ln_beta, regularised_gamma};
//!
//! // P(50 < Z < 51), far below the smallest positive `f64`
//! assert!((NormalInterval::new(50.0, 51.0).ln_mass + 1254.8314).abs() < 1e-4);
//! // ln B(1, b) = −ln b, although ln Γ(b) is about 10¹¹
//! assert!((ln_beta(1.0, 1e10) + 1e10f64.ln()).abs() < 1e-13);
//! let (p, q) = regularised_gamma(1.0, 2.0);
//! assert!((q - (-2.0f64).exp()).abs() < 1e-15 && (p + q - 1.0).abs() < 1e-15);
//! ```

mod adaptive;
mod beta;
mod beta_tails;
mod forward;
mod gamma;
mod gamma_tails;
mod ln_probability;
mod logistic;
mod memoised;
mod normal;
mod quadrature;
mod root;

pub(crate) use adaptive::{Node, density_nodes};
pub use beta::{beta_logit_quantile, ln_beta, ln_beta_power, regularised_beta};
pub use beta_tails::{Share, ln_beta_tails};
pub use gamma::{
    digamma, gamma_ln_quantile, ln_gamma, ln_minus_digamma, regularised_gamma, stirling_error,
};
pub use gamma_tails::ln_gamma_tails;
pub use ln_probability::{LnProbability, LnTails};
pub(crate) use logistic::{logistic, softplus};
pub(crate) use memoised::memoised;
pub use normal::{
    NormalInterval, half_normal_quantile, ln_normal_cdf, mills_ratio, normal_cdf, normal_from_zero,
    normal_quantile, normal_upper_quantile,
};
pub(crate) use quadrature::integral_from_zero;

/// The constant ½ ln 2π.
pub const HALF_LN_2PI: f64 = 0.918_938_533_204_672_7;

/// Tail of a distribution.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tail {
    /// Lower tail, P(X ≤ x).
    Lower,
    /// Upper tail, P(X > x).
    Upper,
}

/// ln(1 + x) − x without cancellation near 0, for x > −1.
pub fn ln_1p_minus(x: f64) -> f64 {
    if !(-0.4..=0.6).contains(&x) {
        return x.ln_1p() - x;
    }
    // ln(1 + x) = 2 artanh r with r = x/(2 + x), and 2r − x = −x r
    let r = x / (2.0 + x);
    let square = r * r;
    let mut sum = 0.0;
    for k in (1..=12).rev() {
        sum = 1.0 / f64::from(2 * k + 1) + square * sum;
    }
    r * (2.0 * square * sum - x)
}

/// Deviance a ln(a/m) + m − a ≥ 0 of a Poisson count `a` with expectation `m`.
pub fn deviance(a: f64, m: f64) -> f64 {
    if a == 0.0 {
        return m;
    }
    let d = (m - a) / a;
    if d.abs() < 0.4 {
        -a * ln_1p_minus(d)
    } else if m == f64::INFINITY {
        m
    } else {
        a * (a.ln() - m.ln()) + (m - a)
    }
}

/// ln(a/b) of positive numbers; accurate even if a/b overflows or underflows.
#[inline]
pub fn ln_ratio(a: f64, b: f64) -> f64 {
    let ratio = a / b;
    if ratio.is_normal() { ratio.ln() } else { a.ln() - b.ln() }
}

/// ln(1 + z²), z/(1 + z²) and z²/(1 + z²); accurate even if z² overflows.
#[inline]
pub fn ln_1p_square(z: f64) -> (f64, f64, f64) {
    if z.abs() > 1e8 {
        return (2.0 * z.abs().ln(), z.recip(), 1.0);
    }
    let square = z * z;
    let inverse = (1.0 + square).recip();
    (ln_1p_of(square), z * inverse, square * inverse)
}

/// ln(1 + x) for x ≥ 0: the logarithm of the rounded sum, with a correction for the rounding error.
///
/// # References
/// Kahan; theorem 4 in Goldberg (1991), *What every computer scientist should know about
/// floating-point arithmetic*, doi:10.1145/103162.103163.
#[inline]
fn ln_1p_of(x: f64) -> f64 {
    let sum = 1.0 + x;
    if sum == 1.0 { x } else { sum.ln() * (x / (sum - 1.0)) }
}

/// Hyperbolic functions of y: tanh y, sech y, and two numbers from which ln cosh y is computed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hyperbolic {
    pub(crate) tanh: f64,
    pub(crate) sech: f64,
    /// |y|.
    pub(crate) size: f64,
    /// The number (1 + e^{−2|y|})/2, so that ln cosh y = `size` + ln `shrink`.
    pub(crate) shrink: f64,
}

impl Hyperbolic {
    /// Computes the functions at y, with an absolute error of a few units in the last place of 1.
    #[inline(always)]
    pub(crate) fn at(y: f64) -> Self {
        let size = y.abs();
        let e = (-size).exp();
        let shrink = 0.5 + 0.5 * e * e;
        let inverse = shrink.recip();
        let tanh = ((0.5 - 0.5 * e * e) * inverse).copysign(y);
        Self { tanh, sech: e * inverse, size, shrink }
    }
}

/// ln(1 − e^{−x}) for x ≥ 0.
pub fn ln_one_minus_exp(x: f64) -> f64 {
    if x < std::f64::consts::LN_2 { (-(-x).exp_m1()).ln() } else { (-(-x).exp()).ln_1p() }
}

#[cfg(test)]
#[path = "../../tests/unit/special.rs"]
mod tests;
