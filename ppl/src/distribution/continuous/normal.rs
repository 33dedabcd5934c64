//! The normal distribution.

use rand::{Rng, RngCore};
use rand_distr::StandardNormal;

use crate::density::DomainError;
use crate::distribution::traits::normaliser;
use crate::distribution::univariate::Univariate;
use crate::distribution::univariate_density::UnivariateDensity;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{
    HALF_LN_2PI, NormalInterval, Tail, ln_normal_cdf, normal_cdf, normal_upper_quantile,
};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::Support;

/// Normal distribution with mean μ and standard deviation σ.
///
/// ln p(x) = −½ ((x − μ)/σ)² − ln σ − ½ ln 2π, for σ > 0.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_pdf: f64 = Normal(1.0, 2.0).ln_density(&1.0);
/// assert!((ln_pdf + (2.0 * (2.0 * std::f64::consts::PI).sqrt()).ln()).abs() < 1e-14);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1994), *Continuous Univariate Distributions*, vol. 1, ch. 13.
#[derive(Clone, Copy, Debug)]
pub struct Normal<M, S>(pub M, pub S);

crate::univariate!([M: Parameter, S: Parameter] Normal<M, S>);

impl<M: Parameter, S: Parameter> Normal<M, S> {
    fn standardise(&self, x: f64) -> f64 {
        (x - self.0.number()) / self.1.number()
    }
}

impl<M: Parameter, S: Parameter> Univariate for Normal<M, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("Normal", "mean", self.0.number())?;
        DomainError::require_positive("Normal", "sd", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, mut rng: &mut G) -> f64 {
        self.0.number() + self.1.number() * standard_normal(&mut rng)
    }

    fn mean(&self) -> f64 {
        self.0.number()
    }

    fn variance(&self) -> f64 {
        self.1.number().powi(2)
    }

    fn cdf(&self, x: f64) -> f64 {
        normal_cdf(self.standardise(x))
    }

    fn sf(&self, x: f64) -> f64 {
        normal_cdf(-self.standardise(x))
    }

    fn ln_tail(&self, x: f64, tail: Tail) -> f64 {
        let z = self.standardise(x);
        ln_normal_cdf(if tail == Tail::Lower { z } else { -z }).0
    }

    fn quantile(&self, p: f64) -> f64 {
        self.0.number() - self.1.number() * normal_upper_quantile(p)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.0.number() + self.1.number() * normal_upper_quantile(q)
    }
}

/// Draws from Normal(0, 1). The generator is a trait object, so that the function is compiled once instead of for
/// every generator type.
pub(super) fn standard_normal(rng: &mut dyn RngCore) -> f64 {
    rng.sample(StandardNormal)
}

/// Log of the normalising constant, ln(σ √(2π)).
#[inline(always)]
fn ln_normaliser(sd: f64) -> f64 {
    sd.ln() + HALF_LN_2PI
}

impl<R, M, S> UnivariateDensity<R> for Normal<M, S>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    S: Parameter + Datum<R>,
{
    const CONSTANT: bool = M::CONSTANT && S::CONSTANT;

    #[inline(always)]
    fn support(&self) -> Support<R> {
        Support::Real
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let precise = self.1.number().recip();
        let z = (x.value() - self.0.number()) * precise;
        let slope = z * precise;
        // if σ is the same for all data of a loop, ln σ is computed directly, and the compiler moves it out of the
        // loop
        let constant = match S::SHARED || S::CONSTANT {
            true => -normaliser(terms, self.1, ln_normaliser),
            false => terms.minus_ln(self.1.number()) - HALF_LN_2PI,
        };
        terms.add(
            -0.5 * z * z + constant,
            ((x, -slope), (self.0, slope), (self.1, z * slope - precise)),
        );
    }

    #[inline(always)]
    fn at_coordinate(&self, y: R, terms: &mut impl Accumulator<R>) -> R {
        self.add_ln_pdf(y, terms);
        y
    }

    /// Adds the terms of n values in one loop, so that the sums of the derivatives with respect to mean and σ stay in
    /// registers.
    #[inline(always)]
    fn at_coordinates(
        &self,
        n: usize,
        next: &mut impl FnMut() -> R,
        terms: &mut impl Accumulator<R>,
    ) -> Vec<R> {
        let (mean, precise) = (self.0.number(), self.1.number().recip());
        let (mut sum, mut squares) = (0.0, 0.0);
        let mut values = vec![R::from(0.0); n];
        for value in &mut values {
            let x = next();
            let z = (x.value() - mean) * precise;
            terms.add(0.0, ((x, -z * precise),));
            sum += z;
            squares += z * z;
            *value = x;
        }
        let n = n as f64;
        terms.add(
            -0.5 * squares - n * normaliser(terms, self.1, ln_normaliser),
            ((self.0, sum * precise), (self.1, (squares - n) * precise)),
        );
        values
    }

    const HAS_STATISTICS: bool = true;

    /// Statistics n, x̄ and Σ (x − x̄)².
    fn sufficient_statistics(mut data: impl Iterator<Item = R>, out: &mut Vec<f64>) {
        // the sums are over differences from the first datum, which avoids cancellation
        let Some(origin) = data.next().map(Scalar::value) else { return };
        let (mut n, mut sum, mut squares) = (1.0, 0.0, 0.0);
        for x in data {
            let d = x.value() - origin;
            n += 1.0;
            sum += d;
            squares += d * d;
        }
        out.extend([n, origin + sum / n, squares - sum * sum / n]);
    }

    #[inline(always)]
    fn add_statistics_terms(&self, statistics: &[f64], terms: &mut impl Accumulator<R>) {
        let &[n, mean, squares] = statistics else { return };
        let precise = self.1.number().recip();
        let away = mean - self.0.number();
        let all = squares + n * away * away;
        let quadratic = all * precise * precise;
        terms.add(
            -0.5 * quadratic - n * normaliser(terms, self.1, ln_normaliser),
            ((self.0, n * away * precise * precise), (self.1, (quadratic - n) * precise)),
        );
    }

    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        let sd = self.1.number();
        let inside = NormalInterval::new(self.standardise(lower), self.standardise(upper));
        R::gather(inside.ln_mass, ((self.0, inside.first / sd), (self.1, inside.second / sd)))
    }
}
