//! Beta function and regularised incomplete beta function.

use super::gamma::stirling_error;
use super::logistic::logistic;
use super::root::tail_quantile;
use super::{HALF_LN_2PI, Tail, deviance};

/// The sum δ(a) + δ(b) − δ(a + b) of Stirling errors δ, see [`stirling_error`].
fn stirling_part(a: f64, b: f64) -> f64 {
    stirling_error(a) + stirling_error(b) - stirling_error(a + b)
}

/// ln B(a, b) = ln Γ(a) + ln Γ(b) − ln Γ(a + b) for a, b > 0, without cancellation of large terms.
pub fn ln_beta(a: f64, b: f64) -> f64 {
    let powers = a * (b / a).ln_1p() + b * (a / b).ln_1p();
    // the term ½ ln((a + b)/(a b)) is computed as ½ ln(1/a + 1/b)
    stirling_part(a, b) - powers + 0.5 * (a.recip() + b.recip()).ln() + HALF_LN_2PI
}

/// ln [xᵃ yᵇ/B(a, b)] with y = 1 − x.
pub fn ln_beta_power(a: f64, b: f64, x: f64, y: f64) -> f64 {
    let n = a + b;
    -stirling_part(a, b)
        - deviance(a, n * x)
        - deviance(b, n * y)
        - 0.5 * (a.recip() + b.recip()).ln()
        - HALF_LN_2PI
}

/// Regularised incomplete beta function Iₓ(a, b) and its complement 1 − Iₓ(a, b). Each of the two is accurate where
/// it is small. The argument y = 1 − x is passed separately, to avoid rounding errors in 1 − x.
///
/// # References
/// NIST Digital Library of Mathematical Functions, 8.17.22.
pub fn regularised_beta(a: f64, b: f64, x: f64, y: f64) -> (f64, f64) {
    if !(a > 0.0 && b > 0.0) || x.is_nan() {
        return (f64::NAN, f64::NAN);
    }
    if x <= 0.0 {
        return (0.0, 1.0);
    }
    if y <= 0.0 {
        return (1.0, 0.0);
    }
    let factor = ln_beta_power(a, b, x, y).exp();
    if x * (a + b + 2.0) < a + 1.0 {
        let lower = (factor / a * continued_fraction(a, b, x)).min(1.0);
        (lower, 1.0 - lower)
    } else {
        let upper = (factor / b * continued_fraction(b, a, y)).min(1.0);
        (1.0 - upper, upper)
    }
}

/// Continued fraction 1/(1 + d₁/(1 + d₂/(1 + …))) of the incomplete beta function for x below the mean. The fraction
/// is evaluated by a forward recurrence of the differences between successive approximants.
fn continued_fraction(a: f64, b: f64, x: f64) -> f64 {
    let (mut ratio, mut increment, mut sum) = (1.0, 1.0, 1.0);
    let mut step = |d: f64| {
        ratio = (1.0 + d * ratio).recip();
        increment *= ratio - 1.0;
        sum += increment;
        (increment.abs(), sum)
    };
    let mut m = 0.0;
    loop {
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        step(odd);
        m += 1.0;
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let (last, total) = step(even);
        if last <= 0.1 * f64::EPSILON * total.abs() || m > 1e7 {
            return total;
        }
    }
}

/// Returns ln(x/(1 − x)), where x is the quantile of the beta distribution at which the given tail has probability
/// `p`.
pub fn beta_logit_quantile(a: f64, b: f64, p: f64, tail: Tail) -> f64 {
    tail_quantile((a / b).ln(), p, tail, |logit| {
        let (x, y) = logistic(logit);
        let (lower, upper) = regularised_beta(a, b, x, y);
        (lower, upper, ln_beta_power(a, b, x, y).exp())
    })
}
