//! The ordered logistic distribution.

use rand::Rng;

use super::{Distribution, Family, Parameter, Vector, lift};
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
        let cuts = self.1.size();
        let k = usize::try_from(*grade).unwrap_or(usize::MAX);
        if k > cuts {
            return R::from(f64::NEG_INFINITY);
        }
        let eta = self.0.number();
        let (mut value, mut in_eta) = (0.0, 0.0);
        let mut partials = [(R::from(0.0), 0.0); 2];
        let (lower, upper) = ((k > 0).then(|| self.1.at(k - 1)), (k < cuts).then(|| self.1.at(k)));
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
        DomainError::require_finite("OrderedLogistic", "predictor", self.0.number())?;
        (0..self.1.size()).try_for_each(|i| {
            let (name, cut) = (format!("cut point {i}"), self.1.at(i).value());
            DomainError::require_finite("OrderedLogistic", &name, cut)?;
            let before = if i > 0 { self.1.at(i - 1).value() } else { f64::NEG_INFINITY };
            let above = format!("above the one before, {before}");
            DomainError::require(cut > before, "OrderedLogistic", &name, &above, cut)
        })
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        let u: f64 = rng.random();
        let latent = self.0.number() + u.ln() - (-u).ln_1p();
        (0..self.1.size()).take_while(|&i| self.1.at(i).value() < latent).count() as u64
    }
}
