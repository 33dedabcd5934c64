//! Log-linear regression of counts.

use rand::Rng;

use super::design::Design;
use super::intercept::Intercept;
use super::regression::{self, Eta, Regression};
use crate::accumulator::{Accumulator, Joined};
use crate::density::DomainError;
use crate::distribution::{Distribution, Family, PoissonLog, Vector};
use crate::scalar::Scalar;

/// Counts about a linear predictor, `PoissonLogGlm(x, intercept, slopes)`: kᵢ ~ PoissonLog(ηᵢ) with
/// ηᵢ = aᵢ + Σₖ xᵢₖ bₖ, for all i in one statement; they can be observed, not declared.
///
/// ln P(k) = Σᵢ (kᵢ ηᵢ − e^ηᵢ − ln kᵢ!).
///
/// x, intercept and slopes are those of [`NormalGlm`](crate::NormalGlm); data are slices or vectors of
/// counts. Cross-validation sees every datum by itself.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     fn faults(length_m: &[f64], faults: &[u64]) {
///         let intercept ~ Normal(0.0, 2.0);
///         let slope ~ Normal(0.0, 1.0).array::<1>();
///         faults ~ PoissonLogGlm(length_m, intercept, slope);
///     }
/// }
/// assert_eq!(faults(&[0.5, 1.2, 0.8], &[2, 5, 3]).layout()?.dim, 2);
/// # Ok::<(), ppl::ModelError>(())
/// ```
///
/// # References
/// McCullagh & Nelder (1989), *Generalized Linear Models*, 2nd ed., ch. 6.
#[derive(Clone, Copy, Debug)]
pub struct PoissonLogGlm<X, A, B>(pub X, pub A, pub B);

impl<X: Clone, A: Clone, B: Clone> Family for PoissonLogGlm<X, A, B> {}

impl<R, X, A, B> Regression<R> for PoissonLogGlm<X, A, B>
where
    R: Scalar,
    X: Design,
    A: Intercept<R>,
    B: Vector<R>,
{
    type Each<'g>
        = PoissonLog<Eta<'g, A, B>>
    where
        Self: 'g;

    #[inline(always)]
    fn size(&self) -> usize {
        self.0.size()
    }

    #[inline(always)]
    fn each(&self, i: usize) -> Self::Each<'_> {
        PoissonLog(Eta::new::<R>(&self.0, &self.1, &self.2, i))
    }
}

impl<R, X, A, B> Distribution<R> for PoissonLogGlm<X, A, B>
where
    R: Scalar,
    X: Design,
    A: Intercept<R>,
    B: Vector<R> + Clone,
{
    type Value = Vec<u64>;

    fn ln_density(&self, data: &Vec<u64>) -> R {
        Joined::of(|terms| self.add_terms(data, terms))
    }

    #[inline(always)]
    fn add_terms(&self, data: &Vec<u64>, terms: &mut impl Accumulator<R>) {
        regression::add_terms(self, data.iter().copied(), terms);
    }

    const SUMMARISES: bool = true;

    /// The data as they are: bound once, and not read anew at every point.
    fn summarise(&self, data: &Vec<u64>, sums: &mut Vec<f64>) {
        sums.extend(data.iter().map(|datum| *datum as f64));
    }

    #[inline(always)]
    fn add_pooled_terms(&self, sums: &[f64], terms: &mut impl Accumulator<R>) {
        regression::add_terms(self, sums.iter().map(|&datum| datum as u64), terms);
    }

    fn pointwise(&self, data: &Vec<u64>, out: &mut Vec<f64>) {
        regression::pointwise(self, data, out);
    }

    fn fits(&self, data: &Vec<u64>) -> Result<(), DomainError> {
        regression::require_length("PoissonLogGlm", &self.0, data.len())
    }

    fn validate(&self) -> Result<(), DomainError> {
        regression::validate("PoissonLogGlm", &self.0, &self.1, &self.2)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Vec<u64> {
        regression::draw(self, rng)
    }
}
