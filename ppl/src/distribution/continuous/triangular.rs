//! The triangular distribution.

use std::f64::consts::LN_2;

use crate::density::DomainError;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::Support;

/// Triangular distribution on a < x < b with mode c: `Triangular(a, c, b)`, for a ≤ c ≤ b and a < b.
///
/// p(x) = 2 (x − a)/((b − a)(c − a)) for x < c, and 2 (b − x)/((b − a)(b − c)) for x ≥ c.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let guess = Triangular(250.0, 270.0, 300.0);
/// let at_mode: f64 = guess.ln_density(&270.0);
/// assert!((at_mode - (2.0f64 / 50.0).ln()).abs() < 1e-14);
/// assert!((guess.cdf(270.0) - 0.4).abs() < 1e-15);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1995), *Continuous Univariate Distributions*, vol. 2, ch. 26.
#[derive(Clone, Copy, Debug)]
pub struct Triangular<A, C, B>(pub A, pub C, pub B);

crate::univariate!([A: Parameter, C: Parameter, B: Parameter] Triangular<A, C, B>);

impl<A: Parameter, C: Parameter, B: Parameter> Triangular<A, C, B> {
    /// The numbers a, c and b.
    fn corners(&self) -> [f64; 3] {
        [self.0.number(), self.1.number(), self.2.number()]
    }
}

impl<A: Parameter, C: Parameter, B: Parameter> Univariate for Triangular<A, C, B> {
    fn validate(&self) -> Result<(), DomainError> {
        let [a, c, b] = self.corners();
        DomainError::require_finite("Triangular", "lower end", a)?;
        DomainError::require_finite("Triangular", "upper end", b)?;
        let requirement = format_args!("above the lower end {a}");
        DomainError::require(b > a, "Triangular", "upper end", requirement, b)?;
        let requirement = format_args!("between {a} and {b}");
        DomainError::require((a..=b).contains(&c), "Triangular", "mode", requirement, c)
    }

    fn mean(&self) -> f64 {
        let [a, c, b] = self.corners();
        (a + c + b) / 3.0
    }

    fn variance(&self) -> f64 {
        let [a, c, b] = self.corners();
        ((b - a).powi(2) - (c - a) * (b - c)) / 18.0
    }

    fn cdf(&self, x: f64) -> f64 {
        let [a, c, b] = self.corners();
        if x <= a {
            0.0
        } else if x < c {
            (x - a) / (b - a) * ((x - a) / (c - a))
        } else if x >= b {
            1.0
        } else {
            1.0 - (b - x) / (b - a) * ((b - x) / (b - c))
        }
    }

    fn sf(&self, x: f64) -> f64 {
        let [a, c, b] = self.corners();
        if x >= b {
            0.0
        } else if x >= c {
            (b - x) / (b - a) * ((b - x) / (b - c))
        } else if x <= a {
            1.0
        } else {
            1.0 - (x - a) / (b - a) * ((x - a) / (c - a))
        }
    }

    fn quantile(&self, p: f64) -> f64 {
        let [a, c, b] = self.corners();
        if p * (b - a) <= c - a {
            a + (p * (b - a) * (c - a)).sqrt()
        } else {
            b - ((1.0 - p) * (b - a) * (b - c)).sqrt()
        }
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        let [a, c, b] = self.corners();
        if q * (b - a) <= b - c {
            b - (q * (b - a) * (b - c)).sqrt()
        } else {
            a + ((1.0 - q) * (b - a) * (c - a)).sqrt()
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
    const CONSTANT: bool = A::CONSTANT && C::CONSTANT && B::CONSTANT;

    #[inline]
    fn support(&self) -> Support<R> {
        Support::Between(self.0.lift(), self.2.lift())
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let [a, c, b] = self.corners();
        let (v, width) = (x.value(), b - a);
        let whole = width.recip();
        if v < c {
            let (from_end, side) = ((v - a).recip(), (c - a).recip());
            terms.add(
                LN_2 + (v - a).ln() - width.ln() - (c - a).ln(),
                (
                    (x, from_end),
                    (self.0, whole + side - from_end),
                    (self.1, -side),
                    (self.2, -whole),
                ),
            );
        } else {
            let (to_end, side) = ((b - v).recip(), (b - c).recip());
            terms.add(
                LN_2 + (b - v).ln() - width.ln() - (b - c).ln(),
                ((x, -to_end), (self.0, whole), (self.1, side), (self.2, to_end - whole - side)),
            );
        }
    }
}
