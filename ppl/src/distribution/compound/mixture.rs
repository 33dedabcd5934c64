//! Mixtures with the component summed out.

mod numbers;

use rand::Rng;

use crate::accumulator::{Accumulator, Settled, Valued};
use crate::datum::Datum;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::{Distribution, Unknown, lift};
use crate::distribution::univariate_density::{UnivariateDensity, constrain};
use crate::distribution::vector::Sequence;
use crate::parameter::Parameter;
use crate::scalar::Scalar;
use crate::special::ln_add_exp;

/// A value from one of several distributions, chosen with the given weights; which one is summed
/// out.
///
/// ln p(x) = ln Σᵢ wᵢ pᵢ(x), for wᵢ ≥ 0 with Σ wᵢ = 1. The weights are an array, slice or vector;
/// so are the components, of one family. Components may be real numbers, counts, or anything else
/// with a density; of real numbers the mixture can be an unknown. A mixture of several families is
/// `factor(ln_sum_exp(…))`.
///
/// An observation keeps nothing of its components: their partials are taken with the weights
/// wᵢ pᵢ/p, and ∂/∂wᵢ = pᵢ/p.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let measurement = Mixture([0.9, 0.1], [Normal(0.0, 1.0), Normal(0.0, 10.0)]);
/// assert!((measurement.variance() - 10.9).abs() < 1e-14);
///
/// let ln_density: f64 = measurement.ln_density(&0.0);
/// assert!((ln_density - (0.91 / (2.0 * std::f64::consts::PI).sqrt()).ln()).abs() < 1e-15);
/// ```
///
/// # References
/// McLachlan & Peel (2000), *Finite Mixture Models*, ch. 1.
#[derive(Clone, Copy, Debug)]
pub struct Mixture<W, C>(pub W, pub C);

/// Up to how many components the densities of an observation are kept where they are found.
const FEW: usize = 8;

/// A sum of densities, of which the largest is 1, that has all its digits.
const SMALLEST: f64 = 1e-290;

impl<W: Sequence<Item: Parameter>, C: Sequence> Mixture<W, C> {
    /// Weights with their components.
    fn pairs(&self) -> impl Iterator<Item = (W::Item, &C::Item)> {
        self.0.items().iter().copied().zip(self.1.items())
    }

    fn components(&self) -> std::slice::Iter<'_, C::Item> {
        self.1.items().iter()
    }

    /// Σ wᵢ g(component i).
    fn average(&self, g: impl Fn(&C::Item) -> f64) -> f64 {
        self.pairs().map(|(weight, component)| weight.number() * g(component)).sum()
    }

    /// ln Σ wᵢ e^{termᵢ}.
    #[inline]
    fn ln_average<R: Scalar>(&self, term: impl Fn(&C::Item) -> R) -> R
    where
        W::Item: Datum<R>,
    {
        if self.0.items().len() != self.1.items().len() {
            return R::from(f64::NAN);
        }
        let mut total = R::from(f64::NEG_INFINITY);
        for (weight, component) in self.pairs() {
            let term = term(component);
            let ln_component = term.value();
            let own = weight.number().ln() + ln_component;
            let value = ln_add_exp(total.value(), own);
            // a component without density here changes nothing
            if ln_component == f64::NEG_INFINITY || value == f64::NEG_INFINITY {
                continue;
            }
            let partials = [total.value(), own, ln_component].map(|part| (part - value).exp());
            total = R::fuse(value, [total, term, lift(weight)], partials);
        }
        total
    }

    /// Adds ln p(x), whose partials, times `weight`, go to what they are in: nothing is kept of the
    /// components. False where that is not so simple.
    #[inline(always)]
    fn settle<R>(
        &self,
        x: &<C::Item as Distribution<R>>::Value,
        weight: f64,
        terms: &mut impl Accumulator<R>,
    ) -> bool
    where
        R: Scalar,
        W::Item: Datum<R>,
        C::Item: Distribution<R>,
    {
        let weights = self.0.items();
        if weights.len() != self.1.items().len() || weights.len() > FEW {
            return false;
        }
        // ln pᵢ, then pᵢ in proportion to the largest
        let mut densities = [0.0; FEW];
        let densities = &mut densities[..weights.len()];
        let mut largest = f64::NEG_INFINITY;
        for (ln_density, component) in densities.iter_mut().zip(self.components()) {
            let mut terms = Valued::default();
            component.add_terms(x, &mut terms);
            *ln_density = terms.0;
            largest = largest.max(*ln_density);
        }
        if let [first, second] = densities {
            // of two, one is the largest
            let smaller = (-(*first - *second).abs()).exp();
            let order = *first >= *second;
            (*first, *second) = if order { (1.0, smaller) } else { (smaller, 1.0) };
        } else {
            densities.iter_mut().for_each(|density| *density = (*density - largest).exp());
        }
        let sum: f64 = densities.iter().zip(weights).map(|(p, share)| share.number() * p).sum();
        // densities of zero, or far below one whose weight is zero, and no numbers
        if !(sum > SMALLEST && sum.is_finite()) {
            return false;
        }
        let inverse = sum.recip();
        if R::DIFFERENTIABLE {
            for (density, (share, component)) in densities.iter().zip(self.pairs()) {
                let in_share = density * inverse * weight;
                component.add_terms(x, &mut Settled::new(share.number() * in_share));
                Accumulator::<R>::add(&mut Settled::new(1.0), 0.0, ((share, in_share),));
            }
        }
        let value = largest + terms.minus_ln(inverse);
        terms.add_number(R::from(value));
        true
    }

    fn require_weights(&self) -> Result<(), DomainError> {
        let weights = self.0.items();
        DomainError::require(
            weights.len() == self.1.items().len() && !weights.is_empty(),
            "Mixture",
            "number of weights",
            format_args!("that of the components, {}", self.1.items().len()),
            weights.len() as f64,
        )?;
        for (i, weight) in weights.iter().enumerate() {
            let weight = weight.number();
            let name = format_args!("weight {i}");
            DomainError::require(weight >= 0.0, "Mixture", name, "at least 0", weight)?;
        }
        let sum: f64 = weights.iter().map(|w| w.number()).sum();
        DomainError::require((sum - 1.0).abs() < 1e-8, "Mixture", "sum of the weights", "1", sum)
    }

    /// A component chosen with these probabilities.
    fn choose<G: Rng + ?Sized>(&self, rng: &mut G) -> &C::Item {
        let mut left = rng.random::<f64>() * self.average(|_| 1.0);
        let mut chosen = &self.1.items()[0];
        for (weight, component) in self.pairs().filter(|(weight, _)| weight.number() > 0.0) {
            chosen = component;
            left -= weight.number();
            if left < 0.0 {
                break;
            }
        }
        chosen
    }
}

impl<W: Sequence<Item: Parameter>, C: Sequence> Family for Mixture<W, C> {}

impl<R, W, C> Distribution<R> for Mixture<W, C>
where
    R: Scalar,
    W: Sequence<Item: Parameter + Datum<R>>,
    C: Sequence<Item: Distribution<R>>,
{
    type Value = <C::Item as Distribution<R>>::Value;

    #[inline]
    fn ln_density(&self, x: &Self::Value) -> R {
        self.ln_average(|component| component.ln_density(x))
    }

    #[inline(always)]
    fn add_terms(&self, x: &Self::Value, terms: &mut impl Accumulator<R>) {
        if !terms.settles().is_some_and(|weight| self.settle(x, weight, terms)) {
            terms.add_number(self.ln_density(x));
        }
    }

    fn validate(&self) -> Result<(), DomainError> {
        self.require_weights()?;
        self.components().try_for_each(|component| component.validate())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Self::Value {
        self.choose(rng).draw(rng)
    }
}

impl<R, W, C> Unknown<R> for Mixture<W, C>
where
    R: Scalar,
    W: Sequence<Item: Parameter + Datum<R>>,
    C: Sequence<Item: UnivariateDensity<R> + Distribution<R, Value = R>>,
{
    fn dim(&self) -> usize {
        1
    }

    #[inline]
    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Accumulator<R>,
    ) -> R {
        constrain(self, next(), jacobian, terms)
    }

    fn unconstrain(&self, x: &R, out: &mut Vec<f64>) {
        out.push(UnivariateDensity::<R>::support(self).unconstrain(x.value()));
    }

    fn bounds(&self) -> Option<(f64, f64)> {
        UnivariateDensity::<R>::chosen_ends(self)
    }
}
