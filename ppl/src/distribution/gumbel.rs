//! The Gumbel distribution.

use std::f64::consts::PI;

use rand::Rng;

use super::interval_mass::ln_mass_by_hazard;
use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Gumbel distribution of the largest of many, with location (and mode) μ and scale σ.
///
/// ln p(x) = −z − e⁻ᶻ − ln σ with z = (x − μ)/σ, for σ > 0. The distribution of the smallest of
/// many is that of −X.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let flood = Gumbel(3.0, 0.5);
/// assert!((flood.cdf(3.0) - (-1.0f64).exp()).abs() < 1e-16);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1995), *Continuous Univariate Distributions*, vol. 2, ch. 22.
#[derive(Clone, Copy, Debug)]
pub struct Gumbel<M, S>(pub M, pub S);

/// Euler's constant γ.
const EULER: f64 = 0.577_215_664_901_532_9;

crate::univariate!([M: Parameter, S: Parameter] Gumbel<M, S>);

impl<M: Parameter, S: Parameter> Gumbel<M, S> {
    /// z and −ln P(X ≤ x) = e⁻ᶻ.
    fn at(&self, x: f64) -> (f64, f64) {
        let z = (x - self.0.number()) / self.1.number();
        (z, (-z).exp())
    }
}

impl<M: Parameter, S: Parameter> Univariate for Gumbel<M, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("Gumbel", "location", self.0.number())?;
        DomainError::require_positive("Gumbel", "scale", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.upper_quantile(rng.random())
    }

    fn mean(&self) -> f64 {
        self.0.number() + EULER * self.1.number()
    }

    fn variance(&self) -> f64 {
        (PI * self.1.number()).powi(2) / 6.0
    }

    fn cdf(&self, x: f64) -> f64 {
        (-self.at(x).1).exp()
    }

    fn sf(&self, x: f64) -> f64 {
        -(-self.at(x).1).exp_m1()
    }

    fn quantile(&self, p: f64) -> f64 {
        self.0.number() - self.1.number() * (-p.ln()).ln()
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.0.number() - self.1.number() * (-(-q).ln_1p()).ln()
    }
}

impl<R, M, S> UnivariateDensity<R> for Gumbel<M, S>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    S: Parameter + Datum<R>,
{
    #[inline]
    fn support(&self) -> Support<R> {
        Support::Real
    }

    #[inline]
    fn ln_pdf(&self, x: R) -> R {
        Joined::of(|terms| self.add_ln_pdf(x, terms))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Terms<R>) {
        let scale = self.1.number();
        let inverse = scale.recip();
        let (z, e) = self.at(x.value());
        let slope = (1.0 - e) * inverse;
        // e⁻ᶻ outgrows every z
        let value = if e == f64::INFINITY { -e } else { -z - e - scale.ln() };
        terms.add(value, ((x, -slope), (self.0, slope), (self.1, z * slope - inverse)));
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let inverse = self.1.number().recip();
        let unknowns = [lift(self.0), lift(self.1)];
        if self.at(lower).0 > 40.0 {
            // so far up, 1 − e^{−e⁻ᶻ} is e⁻ᶻ, which may underflow
            let [low, high] = [lower, upper].map(|x| {
                let (z, _) = self.at(x);
                (z, [-inverse, -z * inverse])
            });
            return ln_mass_by_hazard(unknowns, low, high);
        }
        let [low, high] = [lower, upper].map(|x| {
            let (z, e) = self.at(x);
            (e, [e * inverse, z * e * inverse])
        });
        ln_mass_by_hazard(unknowns, high, low)
    }
}
