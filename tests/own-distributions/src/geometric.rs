//! The geometric distribution.

use std::ops::RangeFrom;

use ppl::prelude::*;
use ppl::rand::Rng;
use ppl::{Datum, DomainError};

/// Geometric distribution of the number of failures before the first success, with probability p of a success.
///
/// ln P(k) = ln p + k ln(1 − p), for k = 0, 1, 2, … and 0 < p ≤ 1.
#[derive(Clone, Copy, Debug)]
pub struct Geometric<P>(pub P);

impl<R: Scalar, P: Parameter + Datum<R>> ppl::Density<R> for Geometric<P> {
    type Domain = RangeFrom<u64>;

    fn domain(&self) -> RangeFrom<u64> {
        0..
    }

    fn ln_density(&self, k: &u64) -> R {
        let probability: R = self.0.lift();
        let successes = probability.ln();
        if *k == 0 { successes } else { successes + (-probability).ln_1p() * (*k as f64) }
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        // uniform in (0, 1], so that the logarithm is finite
        let uniform = 1.0 - rng.random::<f64>();
        (uniform.ln() / (-self.0.number()).ln_1p()) as u64
    }

    fn validate(&self) -> Result<(), DomainError> {
        let p = self.0.number();
        let holds = p > 0.0 && p <= 1.0;
        DomainError::require(holds, "Geometric", "probability", "within 0 and 1 and not 0", p)
    }
}

ppl::density!([P: Parameter] Geometric<P>);
