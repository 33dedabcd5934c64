//! Log tail probabilities of the gamma distribution, with their derivative with respect to the shape.

use super::forward::{Forward, MOST_TERMS};
use super::gamma::{digamma, ln_gamma, ln_gamma_power, ln_minus_digamma};
use super::ln_probability::{CLOSE_TO_ONE, LnProbability, LnTails};
use super::{Tail, ln_ratio};

/// Log tail probabilities of the gamma distribution with shape `a` and unit rate at x, with their derivatives with
/// respect to `a`. `ln_x` is ln x, which is finite even if `x` underflows or overflows.
///
/// # References
/// NIST Digital Library of Mathematical Functions, 8.7.1 (series) and 8.9.2 (continued fraction),
/// each differentiated term by term.
pub fn ln_gamma_tails(a: f64, x: f64, ln_x: f64) -> LnTails<1> {
    if a.is_nan() || a <= 0.0 || x.is_nan() || ln_x.is_nan() {
        return LnTails::UNDEFINED;
    }
    if ln_x == f64::NEG_INFINITY {
        return LnTails::BELOW;
    }
    if x == f64::INFINITY {
        return LnTails::ABOVE;
    }
    if x >= a + 1.0 {
        return LnTails::from_one(Tail::Upper, gamma_upper(a, x));
    }
    let lower = gamma_lower(a, x, ln_x);
    // for x above this limit, the continued fraction converges within some thousands of terms
    let upper = match lower.ln > CLOSE_TO_ONE && x > 0.02 {
        true => gamma_upper(a, x),
        false => lower.complement(),
    };
    LnTails::new(Tail::Lower, lower, upper)
}

/// Computes ln P(a, x) from the series P(a, x) = xᵃ e⁻ˣ/Γ(a + 1) Σ xⁿ/(a + 1)ₙ, with its derivative with respect to
/// a.
fn gamma_lower(a: f64, x: f64, ln_x: f64) -> LnProbability<1> {
    let (mut term, mut sum) = (Forward::constant(1.0), Forward::constant(1.0));
    let mut n = 0.0;
    while n < MOST_TERMS && (n == 0.0 || !term.is_negligible_in(sum)) {
        n += 1.0;
        let factor = x / (a + n);
        term = term.times(Forward::new(factor, [-factor / (a + n)]));
        sum = sum.plus(term);
    }
    let ln_power = match x < f64::MIN_POSITIVE {
        true => a * ln_x - ln_gamma(a + 1.0),
        false => ln_gamma_power(a, x),
    };
    // the logarithm of the factor before the sum has the derivative ln x − ψ(a + 1) with respect to
    // a
    let in_power = match a < 1.0 || x < f64::MIN_POSITIVE {
        true => ln_x - digamma(a + 1.0),
        false => ln_ratio(x, a) + ln_minus_digamma(a) - a.recip(),
    };
    LnProbability::new(ln_power + sum.value.ln(), [in_power + sum.slopes[0] / sum.value])
}

/// Computes ln Q(a, x) from the continued fraction of the incomplete gamma function, with its derivative with respect
/// to a.
fn gamma_upper(a: f64, x: f64) -> LnProbability<1> {
    let mut denominator = Forward::new(x + 1.0 - a, [-1.0]);
    let mut ratio = denominator.recip();
    let (mut increment, mut sum, mut n) = (ratio, ratio, 0.0);
    // Steed's algorithm: each increment is the previous increment times (denominator · ratio − 1)
    while n < MOST_TERMS && (n < 2.0 || !increment.is_negligible_in(sum)) {
        n += 1.0;
        denominator = denominator.shifted(2.0);
        let numerator = Forward::new(n * (a - n), [n]);
        ratio = denominator.plus(numerator.times(ratio)).recip();
        increment = increment.times(denominator.times(ratio).shifted(-1.0));
        sum = sum.plus(increment);
    }
    let ln = ln_gamma_power(a, x) + a.ln() + sum.value.ln();
    let in_power = ln_ratio(x, a) + ln_minus_digamma(a);
    LnProbability::new(ln, [in_power + sum.slopes[0] / sum.value])
}
