//! The ordered logistic distribution.

use rand::Rng;

use super::{Distribution, Family, Parameter, Vector, cut_points, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::{Scalar, logistic, softplus};
use crate::special::ln_one_minus_exp;

/// Ordered logistic distribution of a grade 0, 1, …, K with predictor η and K cut points
/// c₁ < … < c_K; it can be observed, not declared.
///
/// P(k) = σ(cₖ₊₁ − η) − σ(cₖ − η) with c₀ = −∞ and c_K₊₁ = ∞: a logistic variable around η,
/// seen only as the interval between cut points that it falls in. Fused, without cancellation.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let grades = OrderedLogistic(0.3, [-1.0, 0.5, 2.0]);
/// let total: f64 = (0..4).map(|k| -> f64 { grades.ln_density(&k) }).map(f64::exp).sum();
/// assert!((total - 1.0).abs() < 1e-15);
/// ```
///
/// # References
/// McCullagh (1980), *Regression Models for Ordinal Data*, doi:10.1111/j.2517-6161.1980.tb01109.x.
#[derive(Clone, Copy, Debug)]
pub struct OrderedLogistic<E, C>(pub E, pub C);

impl<E: Parameter, C: Clone> Family for OrderedLogistic<E, C> {}

impl<R, E, C> Distribution<R> for OrderedLogistic<E, C>
where
    R: Scalar,
    E: Parameter + Datum<R>,
    C: Vector<R> + Clone,
{
    type Value = u64;

    fn ln_density(&self, grade: &u64) -> R {
        let Some((lower, upper)) = cut_points::around(&self.1, *grade) else {
            return R::from(f64::NEG_INFINITY);
        };
        let eta = self.0.number();
        let (mut value, mut in_eta) = (0.0, 0.0);
        let mut partials = [(R::from(0.0), 0.0); 2];
        // σ(b) − σ(a) = σ(b) σ(−a) (1 − e^{a − b})
        let between = match (lower, upper) {
            (Some(lower), Some(upper)) => {
                let gap = upper.value() - lower.value();
                value += ln_one_minus_exp(gap);
                gap.exp_m1().recip()
            }
            _ => 0.0,
        };
        if let Some(upper) = upper {
            let b = upper.value() - eta;
            value -= softplus(-b);
            let slope = logistic(b).1;
            in_eta -= slope;
            partials[0] = (upper, slope + between);
        }
        if let Some(lower) = lower {
            let a = lower.value() - eta;
            value -= softplus(a);
            let slope = logistic(a).0;
            in_eta += slope;
            partials[1] = (lower, -slope - between);
        }
        R::fuse_iter(value, partials.into_iter().chain([(lift(self.0), in_eta)]))
    }

    fn validate(&self) -> Result<(), DomainError> {
        cut_points::validate("OrderedLogistic", self.0.number(), &self.1)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        let u: f64 = rng.random();
        cut_points::grade(&self.1, self.0.number() + u.ln() - (-u).ln_1p())
    }
}
