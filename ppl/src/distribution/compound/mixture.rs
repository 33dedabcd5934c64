//! Mixture distributions, marginalised over the component.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::{Distribution, lift};
use crate::distribution::vector::Sequence;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;

/// Mixture of distributions with given weights; the component of each value is marginalised out. A mixture can be
/// observed, but it cannot be the prior of an unknown.
///
/// ln p(x) = ln Σᵢ wᵢ pᵢ(x), for wᵢ ≥ 0 with Σ wᵢ = 1. The weights are an array, slice or vector. The components are an
/// array, slice or vector of distributions of one family, with values of any type. For a mixture of several families,
/// use `factor(ln_sum_exp(…))`.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// // one in ten measurements has a large error
/// let measurement = Mixture([0.9, 0.1], [Normal(0.0, 1.0), Normal(0.0, 10.0)]);
/// let ln_density: f64 = measurement.ln_density(&0.0);
/// assert!((ln_density - (0.91 / (2.0 * std::f64::consts::PI).sqrt()).ln()).abs() < 1e-15);
/// ```
///
/// # References
/// McLachlan & Peel (2000), *Finite Mixture Models*, ch. 1.
#[derive(Clone, Copy, Debug)]
pub struct Mixture<W, C>(pub W, pub C);

impl<W: Sequence, C: Sequence> Family for Mixture<W, C> {}

impl<R, W, C> Distribution<R> for Mixture<W, C>
where
    R: Scalar,
    W: Sequence<Item: Parameter + Datum<R>>,
    C: Sequence<Item: Distribution<R>>,
{
    type Value = <C::Item as Distribution<R>>::Value;

    /// Adds ln p, with the partial derivatives wᵢ pᵢ/p with respect to ln pᵢ and pᵢ/p with respect to wᵢ.
    fn add_terms(&self, x: &Self::Value, terms: &mut impl Accumulator<R>) {
        let (weights, components) = (self.0.items(), self.1.items());
        if weights.len() != components.len() {
            return terms.add_number(R::from(f64::NAN));
        }
        let densities: Vec<R> =
            components.iter().map(|component| component.ln_density(x)).collect();
        let ln_terms = || densities.iter().zip(weights).map(|(t, w)| w.number().ln() + t.value());
        let largest = ln_terms().fold(f64::NEG_INFINITY, f64::max);
        if ln_terms().all(|ln_term| ln_term == f64::NEG_INFINITY) {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        let value = largest + ln_terms().map(|ln_term| (ln_term - largest).exp()).sum::<f64>().ln();
        let in_densities =
            densities.iter().zip(ln_terms()).map(|(&t, ln_term)| (t, (ln_term - value).exp()));
        let in_weights = densities.iter().zip(weights).map(|(t, &w)| {
            let weight: R = lift(w);
            (weight, if weight.is_constant() { 0.0 } else { (t.value() - value).exp() })
        });
        // skip components of zero density: their derivative can be infinite, and 0 · ∞ is NaN
        let partials = in_densities.chain(in_weights).filter(|(_, partial)| *partial != 0.0);
        terms.add_number(R::fuse_iter(value, partials));
    }

    fn validate(&self) -> Result<(), DomainError> {
        let (weights, components) = (self.0.items(), self.1.items());
        DomainError::require(
            weights.len() == components.len() && !weights.is_empty(),
            "Mixture",
            "number of weights",
            format_args!("equal to the number of components, {}", components.len()),
            weights.len() as f64,
        )?;
        for (i, weight) in weights.iter().enumerate() {
            let weight = weight.number();
            let name = format_args!("weight {i}");
            DomainError::require(weight >= 0.0, "Mixture", name, "at least 0", weight)?;
        }
        let sum: f64 = weights.iter().map(|w| w.number()).sum();
        DomainError::require((sum - 1.0).abs() < 1e-8, "Mixture", "sum of the weights", "1", sum)?;
        components.iter().try_for_each(Distribution::validate)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Self::Value {
        let (weights, components) = (self.0.items(), self.1.items());
        let mut left = rng.random::<f64>() * weights.iter().map(|w| w.number()).sum::<f64>();
        let mut chosen = &components[0];
        for (weight, component) in weights.iter().zip(components) {
            if weight.number() > 0.0 {
                chosen = component;
                left -= weight.number();
            }
            if left < 0.0 {
                break;
            }
        }
        chosen.draw(rng)
    }
}
