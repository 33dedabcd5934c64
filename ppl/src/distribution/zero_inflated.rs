//! Counts with additional zeros.

use rand::Rng;

use super::{Count, CountMass, Parameter, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::ln_add_exp;
use crate::terms::Terms;

/// A count that is zero with probability π and otherwise has the distribution inside; it can be
/// observed, not declared.
///
/// P(0) = π + (1 − π) p(0), P(k) = (1 − π) p(k) for k > 0, and 0 ≤ π ≤ 1. Note that PyMC's ψ is
/// 1 − π. With a truncation inside it is the hurdle model:
/// `ZeroInflated(0.3, Poisson(2.0).truncate(1.0..))`.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let shifts_without_claims = ZeroInflated(0.4, Poisson(2.0));
/// assert_eq!(shifts_without_claims.mean(), 1.2);
/// let ln_mass: f64 = shifts_without_claims.ln_density(&0);
/// assert!((ln_mass - (0.4 + 0.6 * (-2.0f64).exp()).ln()).abs() < 1e-15);
/// ```
///
/// # References
/// Lambert (1992), doi:10.2307/1269547.
#[derive(Clone, Copy, Debug)]
pub struct ZeroInflated<W, D>(pub W, pub D);

crate::count!([W: Parameter, D: Count] ZeroInflated<W, D>);

impl<W: Parameter, D: Count> ZeroInflated<W, D> {
    /// ln[π + (1 − π) eˡ], without π where the zero is not among the counts.
    #[inline]
    fn inflate<R: Scalar>(&self, inner: R, with_zero: bool) -> R
    where
        W: Datum<R>,
    {
        let (weight, l) = (self.0.number(), inner.value());
        let rest = (-weight).ln_1p();
        if !with_zero {
            let value = if weight <= 1.0 { rest + l } else { f64::NAN };
            return R::fuse(value, [lift(self.0), inner], [-(1.0 - weight).recip(), 1.0]);
        }
        let value = if l > -1.0 {
            // P = 1 − (1 − π) (1 − eˡ)
            ((1.0 - weight) * l.exp_m1()).ln_1p()
        } else {
            ln_add_exp(weight.ln(), rest + l)
        };
        let share = (rest + l - value).exp();
        let in_weight = -l.exp_m1() * (-value).exp();
        R::fuse(value, [lift(self.0), inner], [in_weight, share])
    }
}

impl<W: Parameter, D: Count> Count for ZeroInflated<W, D> {
    fn validate(&self) -> Result<(), DomainError> {
        let weight = self.0.number();
        let holds = (0.0..=1.0).contains(&weight);
        DomainError::require(holds, "ZeroInflated", "weight of zero", "within 0 and 1", weight)?;
        self.1.validate()
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        if rng.random::<f64>() < self.0.number() { 0 } else { self.1.sample(rng) }
    }

    fn mean(&self) -> f64 {
        (1.0 - self.0.number()) * self.1.mean()
    }

    fn variance(&self) -> f64 {
        let weight = self.0.number();
        (1.0 - weight) * (self.1.variance() + weight * self.1.mean().powi(2))
    }

    fn cdf(&self, k: u64) -> f64 {
        let weight = self.0.number();
        weight + (1.0 - weight) * self.1.cdf(k)
    }

    fn sf(&self, k: u64) -> f64 {
        (1.0 - self.0.number()) * self.1.sf(k)
    }
}

impl<R, W, D> CountMass<R> for ZeroInflated<W, D>
where
    R: Scalar,
    W: Parameter + Datum<R>,
    D: CountMass<R>,
{
    #[inline]
    fn ln_pmf(&self, k: u64) -> R {
        self.inflate(self.1.ln_pmf(k), k == 0)
    }

    #[inline(always)]
    fn add_ln_pmf(&self, k: u64, terms: &mut impl Terms<R>) {
        if k == 0 {
            return terms.add_number(self.ln_pmf(k));
        }
        // the terms of the inner distribution may leave out what is the same at every point
        let others = 1.0 - self.0.number();
        let kept = terms.minus_ln(others.recip());
        terms.add(kept, ((self.0, -others.recip()),));
        self.1.add_ln_pmf(k, terms);
    }

    fn ln_mass(&self, first: u64, last: u64) -> R {
        self.inflate(self.1.ln_mass(first, last), first == 0 && first <= last)
    }
}
