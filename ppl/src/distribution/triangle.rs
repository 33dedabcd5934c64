//! The triangular distribution.

use std::f64::consts::LN_2;

use rand::Rng;

use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::{Scalar, logistic, softplus};
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Triangular distribution on (a, b) with mode c: `Triangular(a, c, b)`.
///
/// ln p(x) = ln 2 − ln(b − a) + ln((x − a)/(c − a)) below the mode, with (b − x)/(b − c) above
/// it, for a ≤ c ≤ b and a < b.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let guess = Triangular(0.0, 2.0, 4.0);
/// assert_eq!(guess.mean(), 2.0);
/// assert_eq!(guess.cdf(1.0), 0.125);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1995), *Continuous Univariate Distributions*, vol. 2,
/// section 26.9.
#[derive(Clone, Copy, Debug)]
pub struct Triangular<A, C, B>(pub A, pub C, pub B);

crate::univariate!([A: Parameter, C: Parameter, B: Parameter] Triangular<A, C, B>);

/// One side of the mode: P from the end to x, with its derivatives in that end, the mode and the
/// other end.
fn side(x: f64, end: f64, mode: f64, other: f64) -> (f64, [f64; 3]) {
    let (width, run, gone) = (other - end, mode - end, x - end);
    let p = gone * gone / (width * run);
    (p, [p * (width.recip() + run.recip()) - 2.0 * gone / (width * run), -p / run, -p / width])
}

impl<A: Parameter, C: Parameter, B: Parameter> Triangular<A, C, B> {
    fn corners(&self) -> (f64, f64, f64) {
        (self.0.number(), self.1.number(), self.2.number())
    }

    /// P(X ≤ x), P(X > x) and the derivatives of the first in a, c and b.
    fn at(&self, x: f64) -> (f64, f64, [f64; 3]) {
        let (a, c, b) = self.corners();
        if x <= a {
            (0.0, 1.0, [0.0; 3])
        } else if x >= b {
            (1.0, 0.0, [0.0; 3])
        } else if x < c {
            let (p, partials) = side(x, a, c, b);
            (p, 1.0 - p, partials)
        } else {
            let (p, [in_b, in_c, in_a]) = side(x, b, c, a);
            (1.0 - p, p, [-in_a, -in_c, -in_b])
        }
    }
}

impl<A: Parameter, C: Parameter, B: Parameter> Univariate for Triangular<A, C, B> {
    fn validate(&self) -> Result<(), DomainError> {
        let (a, c, b) = self.corners();
        DomainError::require_finite("Triangular", "lower end", a)?;
        DomainError::require_finite("Triangular", "upper end", b)?;
        DomainError::require(
            a < b,
            "Triangular",
            "lower end",
            format_args!("below the upper end {b}"),
            a,
        )?;
        let holds = (a..=b).contains(&c);
        DomainError::require(holds, "Triangular", "mode", format_args!("within {a} and {b}"), c)
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.quantile(rng.random())
    }

    fn mean(&self) -> f64 {
        let (a, c, b) = self.corners();
        (a + c + b) / 3.0
    }

    fn variance(&self) -> f64 {
        let (a, c, b) = self.corners();
        ((b - a).powi(2) - (c - a) * (b - c)) / 18.0
    }

    fn cdf(&self, x: f64) -> f64 {
        self.at(x).0
    }

    fn sf(&self, x: f64) -> f64 {
        self.at(x).1
    }

    fn quantile(&self, p: f64) -> f64 {
        let (a, c, b) = self.corners();
        let width = b - a;
        if p * width < c - a {
            a + (p * width * (c - a)).sqrt()
        } else {
            b - ((1.0 - p) * width * (b - c)).sqrt()
        }
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        let (a, c, b) = self.corners();
        let width = b - a;
        if q * width < b - c {
            b - (q * width * (b - c)).sqrt()
        } else {
            a + ((1.0 - q) * width * (c - a)).sqrt()
        }
    }
}

impl<R, A, C, B> UnivariateDensity<R> for Triangular<A, C, B>
where
    R: Scalar,
    A: Parameter + Datum<R>,
    C: Parameter + Datum<R>,
    B: Parameter + Datum<R>,
{
    #[inline]
    fn support(&self) -> Support<R> {
        Support::Between(lift(self.0), lift(self.2))
    }

    #[inline]
    fn ln_pdf(&self, x: R) -> R {
        Joined::of(|terms| self.add_ln_pdf(x, terms))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Terms<R>) {
        let (a, c, b) = self.corners();
        let v = x.value();
        let width = b - a;
        let below = v < c || (v == c && c == b);
        let (end, run) = if below { (v - a, c - a) } else { (b - v, b - c) };
        let inverse = width.recip();
        let (from_end, from_run) = (end.recip(), run.recip());
        let own = inverse + from_run - from_end;
        let partials = if below {
            [from_end, own, -from_run, -inverse]
        } else {
            [-from_end, inverse, from_run, -own]
        };
        let [in_x, in_a, in_c, in_b] = partials;
        terms.add(
            LN_2 + (end / run).ln() - width.ln(),
            ((x, in_x), (self.0, in_a), (self.1, in_c), (self.2, in_b)),
        );
    }

    /// The distance from the nearer end keeps its digits.
    #[inline]
    fn at_coordinate(&self, y: R, terms: &mut impl Terms<R>) -> R {
        let (a, c, b) = self.corners();
        let (p, q) = logistic(y.value());
        let [ln_p, ln_q] = [-y.value(), y.value()].map(|y| -softplus(y));
        let inverse = (b - a).recip();
        let support: Support<R> = self.support();
        let below = p * (b - a) < c - a;
        let run = if below { c - a } else { b - c };
        let share = LN_2 + ln_p + ln_q - (run * inverse).ln();
        let from_run = run.recip();
        let (value, partials) = if below {
            (share + ln_p, [2.0 * q - p, from_run - inverse, -from_run, inverse])
        } else {
            (share + ln_q, [q - 2.0 * p, -inverse, from_run, inverse - from_run])
        };
        let [in_y, in_a, in_c, in_b] = partials;
        terms.add(value, ((y, in_y), (self.0, in_a), (self.1, in_c), (self.2, in_b)));
        support.point(y)
    }

    /// The ends move only where the interval does not cut them off.
    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let (low, high) = (self.at(lower), self.at(upper));
        let mass = if low.0 > 0.5 {
            low.1 - high.1
        } else if high.1 > 0.5 {
            high.0 - low.0
        } else {
            1.0 - low.0 - high.1
        };
        let partials = std::array::from_fn(|i| (high.2[i] - low.2[i]) / mass);
        R::fuse(mass.ln(), [lift(self.0), lift(self.1), lift(self.2)], partials)
    }
}
