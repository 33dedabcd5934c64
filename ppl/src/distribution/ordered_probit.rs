//! The ordered probit distribution.

use rand::Rng;
use rand_distr::StandardNormal;

use super::{Distribution, Family, Parameter, Vector, cut_points, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::{HALF_LN_2PI, NormalInterval};

/// Ordered probit distribution of a grade 0, …, K from a predictor η and K ascending cut points c: the
/// grade is the number of cut points below η + a standard normal error; it can be observed, not
/// declared.
///
/// P(k) = Φ(c_k − η) − Φ(c_(k−1) − η), where c_(−1) = −∞ and c_K = ∞.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_mass: f64 = OrderedProbit(0.0, [0.0]).ln_density(&1);
/// assert_eq!(ln_mass, -(2f64.ln()));
/// ```
///
/// # References
/// McCullagh (1980), *Regression models for ordinal data*, JRSS B 42(2).
#[derive(Clone, Copy, Debug)]
pub struct OrderedProbit<E, C>(pub E, pub C);

impl<E: Parameter, C: Clone> Family for OrderedProbit<E, C> {}

impl<R, E, C> Distribution<R> for OrderedProbit<E, C>
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
        let alpha = lower.map_or(f64::NEG_INFINITY, |cut| cut.value() - eta);
        let beta = upper.map_or(f64::INFINITY, |cut| cut.value() - eta);
        let inside = NormalInterval::new(alpha, beta);
        // φ(z)/P
        let share = |z: f64| (-0.5 * z * z - HALF_LN_2PI - inside.ln_mass).exp();
        let below = lower.map(|cut| (cut, -share(alpha)));
        let above = upper.map(|cut| (cut, share(beta)));
        let own = (lift(self.0), inside.first);
        R::fuse_iter(inside.ln_mass, below.into_iter().chain(above).chain([own]))
    }

    fn validate(&self) -> Result<(), DomainError> {
        cut_points::validate("OrderedProbit", self.0.number(), &self.1)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        let error: f64 = rng.sample(StandardNormal);
        cut_points::grade(&self.1, self.0.number() + error)
    }
}
