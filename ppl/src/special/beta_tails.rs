//! Log tail probabilities of the beta distribution, with their derivatives with respect to both shapes.

use super::beta::{ln_beta, ln_beta_power};
use super::forward::{Forward, MOST_TERMS};
use super::gamma::{digamma, ln_minus_digamma};
use super::ln_probability::{CLOSE_TO_ONE, LnProbability, LnTails};
use super::{Tail, ln_ratio};

/// A number x in (0, 1) and its complement 1 − x, both accurate near 0, with their logarithms. The logarithms stay
/// finite if x or 1 − x underflows to 0.
#[derive(Clone, Copy, Debug)]
pub struct Share {
    /// x.
    pub x: f64,
    /// 1 − x.
    pub complement: f64,
    /// ln x.
    pub ln_x: f64,
    /// ln(1 − x).
    pub ln_complement: f64,
}

impl Share {
    /// Creates the pair from x and its complement 1 − x.
    pub fn new(x: f64, complement: f64) -> Self {
        let ln = |x: f64, complement: f64| if x > 0.5 { (-complement).ln_1p() } else { x.ln() };
        Self { x, complement, ln_x: ln(x, complement), ln_complement: ln(complement, x) }
    }

    /// ln [xᵃ (1 − x)ᵇ/B(a, b)].
    pub fn ln_beta_power(self, a: f64, b: f64) -> f64 {
        // if a shape is below 1, the terms do not cancel, and the logarithms are more accurate than x
        if a.min(b) < 1.0 || self.x.min(self.complement) < f64::MIN_POSITIVE {
            return a * self.ln_x + b * self.ln_complement - ln_beta(a, b);
        }
        ln_beta_power(a, b, self.x, self.complement)
    }

    /// The pair with x and 1 − x exchanged.
    fn reversed(self) -> Self {
        let Self { x, complement, ln_x, ln_complement } = self;
        Self { x: complement, complement: x, ln_x: ln_complement, ln_complement: ln_x }
    }
}

/// Log tail probabilities of the beta distribution with shapes `a` and `b` at x = `at`, with their derivatives with
/// respect to both shapes.
///
/// # References
/// NIST Digital Library of Mathematical Functions, 8.17.22, differentiated term by term.
pub fn ln_beta_tails(a: f64, b: f64, at: Share) -> LnTails<2> {
    if !(a > 0.0 && b > 0.0) || at.x.is_nan() {
        return LnTails::UNDEFINED;
    }
    if at.ln_x == f64::NEG_INFINITY {
        return LnTails::BELOW;
    }
    if at.ln_complement == f64::NEG_INFINITY {
        return LnTails::ABOVE;
    }
    let upper = |mirrored: LnProbability<2>| {
        let [in_b, in_a] = mirrored.slopes;
        LnProbability { slopes: [in_a, in_b], ..mirrored }
    };
    let by_lower = at.x * (a + b + 2.0) < a + 1.0;
    let tail = |by_lower: bool| match by_lower {
        true => beta_lower(a, b, at),
        false => upper(beta_lower(b, a, at.reversed())),
    };
    let first = tail(by_lower);
    let far = if by_lower { at.complement } else { at.x };
    // below this limit, the continued fraction of the other tail converges within some hundreds of terms
    let second = match first.ln > CLOSE_TO_ONE && far < 0.95 {
        true => tail(!by_lower),
        false => first.complement(),
    };
    LnTails::new(if by_lower { Tail::Lower } else { Tail::Upper }, first, second)
}

/// Computes ln Iₓ(a, b) from the continued fraction of the incomplete beta function, with its derivatives with
/// respect to a and b.
fn beta_lower(a: f64, b: f64, at: Share) -> LnProbability<2> {
    let x = at.x;
    let one = Forward::constant(1.0);
    let (mut ratio, mut increment, mut sum) = (one, one, one);
    let mut step = |d: Forward<2>| {
        ratio = d.times(ratio).shifted(1.0).recip();
        increment = increment.times(ratio.shifted(-1.0));
        sum = sum.plus(increment);
        (increment.is_negligible_in(sum), sum)
    };
    let mut m = 0.0;
    let sum = loop {
        // odd coefficient of the continued fraction, −(a + m)(a + b + m) x/((a + 2m)(a + 2m + 1)), with its derivatives
        let factors = [a + m, a + b + m, a + 2.0 * m, a + 2.0 * m + 1.0];
        let odd = -factors[0] / factors[2] * (factors[1] / factors[3]) * x;
        let [p, q, r, s] = factors.map(f64::recip);
        step(Forward::new(odd, [odd * (p + q - r - s), odd * q]));
        m += 1.0;
        // even coefficient of the continued fraction, m (b − m) x/((a + 2m − 1)(a + 2m)), with its derivatives
        let lower = [a + 2.0 * m - 1.0, a + 2.0 * m];
        let scale = m / lower[0] * (x / lower[1]);
        let even = scale * (b - m);
        let slopes = [-even * (lower[0].recip() + lower[1].recip()), scale];
        let (is_done, total) = step(Forward::new(even, slopes));
        if (is_done && m > 1.0) || m > MOST_TERMS {
            break total;
        }
    };
    let [in_a, in_b] = factor_slopes(a, b, at);
    let ln = ln_factor(a, b, at) + sum.value.ln();
    let slopes = [in_a + sum.slopes[0] / sum.value, in_b + sum.slopes[1] / sum.value];
    LnProbability::new(ln, slopes)
}

/// ln [xᵃ (1 − x)ᵇ/(a B(a, b))].
fn ln_factor(a: f64, b: f64, at: Share) -> f64 {
    at.ln_beta_power(a, b) - a.ln()
}

/// Derivatives of [`ln_factor`] with respect to a and b: ln x + ψ(a + b) − ψ(a + 1) and ln(1 − x) + ψ(a + b) − ψ(b).
fn factor_slopes(a: f64, b: f64, at: Share) -> [f64; 2] {
    let n = a + b;
    let both = ln_minus_digamma(n);
    // ln(n x/a) without cancellation of large logarithms
    let ln_excess = |ln_x: f64, shape: f64| ln_x + ln_ratio(n, shape);
    let in_a = match a < 1.0 {
        true => at.ln_x + (n.ln() - both) - digamma(a + 1.0),
        false => ln_excess(at.ln_x, a) + ln_minus_digamma(a) - a.recip() - both,
    };
    [in_a, ln_excess(at.ln_complement, b) + ln_minus_digamma(b) - both]
}
