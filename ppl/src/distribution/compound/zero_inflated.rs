//! Counts with additional zeros.

use rand::Rng;

use crate::accumulator::Accumulator;
use crate::datum::Datum;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::{Distribution, lift};
use crate::parameter::Parameter;
use crate::scalar::Scalar;
use crate::special::ln_add_exp;

/// A count that is zero with probability π and otherwise has the distribution inside; it can be
/// observed, not declared.
///
/// P(0) = π + (1 − π) p(0), P(k) = (1 − π) p(k) for k > 0, and 0 ≤ π ≤ 1. Note that PyMC's ψ is
/// 1 − π.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let shifts_without_claims = ZeroInflated(0.4, Poisson(2.0));
/// let ln_mass: f64 = shifts_without_claims.ln_density(&0);
/// assert!((ln_mass - (0.4 + 0.6 * (-2.0f64).exp()).ln()).abs() < 1e-15);
/// ```
///
/// # References
/// Lambert (1992), doi:10.2307/1269547.
#[derive(Clone, Copy, Debug)]
pub struct ZeroInflated<W, D>(pub W, pub D);

impl<W: Parameter, D: Family> Family for ZeroInflated<W, D> {}

impl<R, W, D> Distribution<R> for ZeroInflated<W, D>
where
    R: Scalar,
    W: Parameter + Datum<R>,
    D: Distribution<R, Value = u64>,
{
    type Value = u64;

    /// ln[π + (1 − π) p(0)], or without π above zero.
    #[inline]
    fn ln_density(&self, k: &u64) -> R {
        let inner = self.1.ln_density(k);
        let (weight, l) = (self.0.number(), inner.value());
        let rest = (-weight).ln_1p();
        if *k > 0 {
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

    #[inline(always)]
    fn add_terms(&self, k: &u64, terms: &mut impl Accumulator<R>) {
        if *k == 0 {
            return terms.add_number(self.ln_density(k));
        }
        // the terms of the inner distribution may leave out what is the same at every point
        let others = 1.0 - self.0.number();
        let kept = terms.minus_ln(others.recip());
        terms.add(kept, ((self.0, -others.recip()),));
        self.1.add_terms(k, terms);
    }

    fn validate(&self) -> Result<(), DomainError> {
        let weight = self.0.number();
        let holds = (0.0..=1.0).contains(&weight);
        DomainError::require(holds, "ZeroInflated", "weight of zero", "within 0 and 1", weight)?;
        self.1.validate()
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        if rng.random::<f64>() < self.0.number() { 0 } else { self.1.draw(rng) }
    }
}
