//! The categorical distribution.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::Distribution;
use crate::distribution::vector::{TOLERANCE, Vector};
use crate::scalar::Scalar;

/// Categorical distribution of an index 0, 1, …, K − 1 with probabilities pₖ ≥ 0, Σ pₖ = 1; it
/// can be observed, not declared.
///
/// ln P(k) = ln pₖ.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_mass: f64 = Categorical([0.2, 0.5, 0.3]).ln_density(&1);
/// assert_eq!(ln_mass, 0.5f64.ln());
/// ```
///
/// # References
/// Agresti (2013), *Categorical Data Analysis*, ch. 1.
#[derive(Clone, Copy, Debug)]
pub struct Categorical<P>(pub P);

impl<P: Clone> Family for Categorical<P> {}

/// The index at which the running sum of weights passes u times the total.
fn index_at(u: f64, size: usize, weight: impl Fn(usize) -> f64) -> u64 {
    let mut left = u * (0..size).map(&weight).sum::<f64>();
    for i in 0..size {
        left -= weight(i);
        if left < 0.0 {
            return i as u64;
        }
    }
    size.saturating_sub(1) as u64
}

impl<R: Scalar, P: Vector<R> + Clone> Distribution<R> for Categorical<P> {
    type Value = u64;

    #[inline]
    fn ln_density(&self, k: &u64) -> R {
        match usize::try_from(*k) {
            Ok(k) if k < self.0.size() => self.0.at(k).ln(),
            _ => R::from(f64::NEG_INFINITY),
        }
    }

    fn validate(&self) -> Result<(), DomainError> {
        let mut sum = 0.0;
        for i in 0..self.0.size() {
            let value = self.0.at(i).value();
            let name = format_args!("probability[{i}]");
            DomainError::require(value >= 0.0, "Categorical", name, "nonnegative", value)?;
            sum += value;
        }
        let holds = (sum - 1.0).abs() <= TOLERANCE;
        DomainError::require(holds, "Categorical", "sum of the probabilities", "1", sum)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        index_at(rng.random(), self.0.size(), |i| self.0.at(i).value())
    }
}

/// Categorical distribution of an index 0, 1, …, K − 1 by logits: any numbers, of which only
/// the differences count; it can be observed, not declared.
///
/// ln P(k) = lₖ − ln Σ exp lⱼ.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_mass: f64 = CategoricalLogit([1.0, 1.0, 1.0, 1.0]).ln_density(&3);
/// assert!((ln_mass - 0.25f64.ln()).abs() < 1e-15);
/// ```
///
/// # References
/// Agresti (2013), *Categorical Data Analysis*, ch. 8.
#[derive(Clone, Copy, Debug)]
pub struct CategoricalLogit<L>(pub L);

impl<L: Clone> Family for CategoricalLogit<L> {}

impl<L> CategoricalLogit<L> {
    fn largest<R: Scalar>(&self) -> f64
    where
        L: Vector<R>,
    {
        (0..self.0.size()).fold(f64::NEG_INFINITY, |m, i| m.max(self.0.at(i).value()))
    }
}

impl<R: Scalar, L: Vector<R> + Clone> Distribution<R> for CategoricalLogit<L> {
    type Value = u64;

    fn ln_density(&self, k: &u64) -> R {
        let k = usize::try_from(*k).unwrap_or(usize::MAX);
        if k >= self.0.size() {
            return R::from(f64::NEG_INFINITY);
        }
        let largest = self.largest::<R>();
        let share = |i: usize| (self.0.at(i).value() - largest).exp();
        let sum: f64 = (0..self.0.size()).map(share).sum();
        let value = self.0.at(k).value() - largest - sum.ln();
        let partials = (0..self.0.size()).map(|i| {
            let own = if i == k { 1.0 } else { 0.0 };
            (self.0.at(i), own - share(i) / sum)
        });
        R::fuse_iter(value, partials)
    }

    fn validate(&self) -> Result<(), DomainError> {
        (0..self.0.size()).try_for_each(|i| {
            let name = format_args!("logit[{i}]");
            DomainError::require_finite("CategoricalLogit", name, self.0.at(i).value())
        })
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        let largest = self.largest::<R>();
        index_at(rng.random(), self.0.size(), |i| (self.0.at(i).value() - largest).exp())
    }
}
