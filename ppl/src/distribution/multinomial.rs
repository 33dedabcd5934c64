//! The multinomial distribution.

use rand::Rng;

use super::categorical::require_probabilities;
use super::{Distribution, Family, Vector};
use crate::density::DomainError;
use crate::scalar::Scalar;
use crate::special::ln_gamma;

/// Multinomial distribution of counts kᵢ with Σ kᵢ = n, with probabilities pᵢ ≥ 0, Σ pᵢ = 1; it
/// can be observed, not declared.
///
/// ln P(k) = ln n! − Σ ln kᵢ! + Σ kᵢ ln pᵢ.
///
/// The probabilities are an array, and so are the counts then, or a slice or `Vec`. The log
/// factorials leave an error of about ε n ln n.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_mass: f64 = Multinomial(4, [0.5, 0.25, 0.25]).ln_density(&[2, 1, 1]);
/// assert!((ln_mass - (12.0f64 / 64.0).ln()).abs() < 1e-14);
/// ```
///
/// # References
/// Johnson, Kotz & Balakrishnan (1997), *Discrete Multivariate Distributions*, ch. 35.
#[derive(Clone, Copy, Debug)]
pub struct Multinomial<P>(pub u64, pub P);

impl<P: Clone> Family for Multinomial<P> {}

impl<R: Scalar, P: Vector<R> + Clone> Distribution<R> for Multinomial<P> {
    type Value = P::Of<u64>;

    fn ln_density(&self, counts: &P::Of<u64>) -> R {
        let counts = counts.as_ref();
        let total = counts.iter().try_fold(0u64, |sum, &k| sum.checked_add(k));
        if counts.len() != self.1.size() || total != Some(self.0) {
            return R::from(f64::NEG_INFINITY);
        }
        let ln_factorial = |k: u64| if k < 2 { 0.0 } else { ln_gamma(k as f64 + 1.0) };
        // a count of zero says nothing about its probability beyond the others' sum
        let seen = || counts.iter().enumerate().filter(|&(_, &k)| k > 0);
        let value = seen().fold(ln_factorial(self.0), |sum, (i, &k)| {
            sum + k as f64 * self.1.at(i).value().ln() - ln_factorial(k)
        });
        let partials = seen().map(|(i, &k)| {
            let p = self.1.at(i);
            (p, k as f64 / p.value())
        });
        R::fuse_iter(value, partials)
    }

    fn validate(&self) -> Result<(), DomainError> {
        require_probabilities("Multinomial", &self.1)
    }

    /// One binomial draw after another from what is left.
    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> P::Of<u64> {
        let mut counts = self.1.filled(0u64);
        let mut left = self.0;
        let mut mass: f64 = (0..self.1.size()).map(|i| self.1.at(i).value()).sum();
        let last = self.1.size().saturating_sub(1);
        for (i, count) in counts.as_mut().iter_mut().enumerate() {
            let p = self.1.at(i).value();
            let share: f64 = if i == last { 1.0 } else { (p / mass).clamp(0.0, 1.0) };
            *count = rand_distr::Binomial::new(left, share).map_or(0, |b| rng.sample(b));
            left -= *count;
            mass -= p;
        }
        counts
    }
}
