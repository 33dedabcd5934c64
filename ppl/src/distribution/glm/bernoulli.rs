//! Logistic regression of flags.

use rand::Rng;

use super::design::Design;
use super::intercept::Intercept;
use super::regression::{self, Eta, Regression};
use crate::accumulator::{Accumulator, Joined};
use crate::density::DomainError;
use crate::distribution::{BernoulliLogit, Distribution, Family, Vector};
use crate::scalar::Scalar;

/// Flags about a linear predictor, `BernoulliLogitGlm(x, intercept, slopes)`: each is true with
/// probability 1/(1 + e^−ηᵢ), where ηᵢ = aᵢ + Σₖ xᵢₖ bₖ, for all i in one statement; they can be
/// observed, not declared.
///
/// ln P = Σᵢ −ln(1 + e^∓ηᵢ), with − where the flag is true.
///
/// x, intercept and slopes are those of [`NormalGlm`](crate::NormalGlm); data are slices or vectors of
/// `bool`. Cross-validation sees every datum by itself.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     fn fractured(load_n: &[f64], fractured: &[bool]) {
///         let intercept ~ Normal(0.0, 2.0);
///         let slope ~ Normal(0.0, 1.0).array::<1>();
///         fractured ~ BernoulliLogitGlm(load_n, intercept, slope);
///     }
/// }
/// assert_eq!(fractured(&[0.5, 1.2, 0.8], &[false, true, true]).layout()?.dim, 2);
/// # Ok::<(), ppl::ModelError>(())
/// ```
///
/// # References
/// McCullagh & Nelder (1989), *Generalized Linear Models*, 2nd ed., ch. 4.
#[derive(Clone, Copy, Debug)]
pub struct BernoulliLogitGlm<X, A, B>(pub X, pub A, pub B);

impl<X: Clone, A: Clone, B: Clone> Family for BernoulliLogitGlm<X, A, B> {}

impl<R, X, A, B> Regression<R> for BernoulliLogitGlm<X, A, B>
where
    R: Scalar,
    X: Design,
    A: Intercept<R>,
    B: Vector<R>,
{
    type Each<'g>
        = BernoulliLogit<Eta<'g, A, B>>
    where
        Self: 'g;

    #[inline(always)]
    fn size(&self) -> usize {
        self.0.size()
    }

    #[inline(always)]
    fn each(&self, i: usize) -> Self::Each<'_> {
        BernoulliLogit(Eta::new::<R>(&self.0, &self.1, &self.2, i))
    }
}

impl<R, X, A, B> Distribution<R> for BernoulliLogitGlm<X, A, B>
where
    R: Scalar,
    X: Design,
    A: Intercept<R>,
    B: Vector<R> + Clone,
{
    type Value = Vec<bool>;

    fn ln_density(&self, data: &Vec<bool>) -> R {
        Joined::of(|terms| self.add_terms(data, terms))
    }

    #[inline(always)]
    fn add_terms(&self, data: &Vec<bool>, terms: &mut impl Accumulator<R>) {
        regression::add_terms(self, data.iter().copied(), terms);
    }

    const SUMMARISES: bool = true;

    /// The data as they are: bound once, and not read anew at every point.
    fn summarise(&self, data: &Vec<bool>, sums: &mut Vec<f64>) {
        sums.extend(data.iter().map(|datum| f64::from(u8::from(*datum))));
    }

    #[inline(always)]
    fn add_pooled_terms(&self, sums: &[f64], terms: &mut impl Accumulator<R>) {
        regression::add_terms(self, sums.iter().map(|&datum| datum != 0.0), terms);
    }

    fn pointwise(&self, data: &Vec<bool>, out: &mut Vec<f64>) {
        regression::pointwise(self, data, out);
    }

    fn fits(&self, data: &Vec<bool>) -> Result<(), DomainError> {
        regression::require_length("BernoulliLogitGlm", &self.0, data.len())
    }

    fn validate(&self) -> Result<(), DomainError> {
        regression::validate("BernoulliLogitGlm", &self.0, &self.1, &self.2)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Vec<bool> {
        regression::draw(self, rng)
    }
}
