//! Regressions of counts and flags with canonical link: Poisson and logistic regression.

use rand::Rng;

use super::design::Design;
use super::intercept::Intercept;
use super::regression::{self, Eta, Regression};
use crate::density::DomainError;
use crate::distribution::{BernoulliLogit, Distribution, Family, PoissonLog, Sequence};
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::term::accumulator::Accumulator;

/// Poisson regression with log link, `PoissonLogGlm(x, intercept, slopes)`: kᵢ ~ PoissonLog(ηᵢ) with ηᵢ = aᵢ + Σₖ xᵢₖ
/// bₖ, for all data in one statement. The distribution is for observed data; it cannot be the prior of an unknown.
///
/// ln P(k) = Σᵢ (kᵢ ηᵢ − e^ηᵢ − ln kᵢ!).
///
/// x, intercept and slopes are as in [`NormalGlm`](crate::NormalGlm); the data are a slice or vector of counts.
/// Cross-validation leaves out one datum at a time.
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

/// Logistic regression, `BernoulliLogitGlm(x, intercept, slopes)`: a flag is true with probability 1/(1 + e^−ηᵢ),
/// where ηᵢ = aᵢ + Σₖ xᵢₖ bₖ, for all data in one statement. The distribution is for observed data; it cannot be the
/// prior of an unknown.
///
/// ln P = Σᵢ −ln(1 + e^∓ηᵢ), with the sign − if the flag is true.
///
/// x, intercept and slopes are as in [`NormalGlm`](crate::NormalGlm); the data are a slice or vector of `bool`.
/// Cross-validation leaves out one datum at a time.
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

/// Implements the regression `$Name` for data of type `$Datum`; `$Each` is the distribution of one datum given the
/// linear predictor η. The stored statistics of an observation are its data, converted to `f64` when the data are
/// bound.
macro_rules! impl_link {
    ($Name:ident, $Each:ident, $Datum:ty, |$x:ident| $datum:expr) => {
        impl<X: Clone, A: Clone, B: Clone> Family for $Name<X, A, B> {}

        impl<R, X, A, B> Regression<R> for $Name<X, A, B>
        where
            R: Scalar,
            X: Design,
            A: Intercept<R>,
            B: Sequence<Item: Datum<R>>,
        {
            type Each<'g>
                = $Each<Eta<'g, A, B>>
            where
                Self: 'g;

            #[inline(always)]
            fn size(&self) -> usize {
                self.0.size()
            }

            #[inline(always)]
            fn each(&self, i: usize) -> Self::Each<'_> {
                $Each(Eta::new::<R>(&self.0, &self.1, &self.2, i))
            }
        }

        impl<R, X, A, B> Distribution<R> for $Name<X, A, B>
        where
            R: Scalar,
            X: Design,
            A: Intercept<R>,
            B: Sequence<Item: Datum<R>>,
        {
            type Value = Vec<$Datum>;

            #[inline(always)]
            fn add_terms(&self, data: &Vec<$Datum>, terms: &mut impl Accumulator<R>) {
                regression::add_terms(self, data.iter().copied(), terms);
            }

            const SUMMARISES: bool = true;

            fn summarise(&self, data: &Vec<$Datum>, statistics: &mut Vec<f64>) {
                statistics.extend(data.iter().map(|&datum| datum as u64 as f64));
            }

            #[inline(always)]
            fn add_statistics_terms(&self, statistics: &[f64], terms: &mut impl Accumulator<R>) {
                regression::add_terms(self, statistics.iter().map(|&$x| $datum), terms);
            }

            fn pointwise(&self, data: &Vec<$Datum>, out: &mut Vec<f64>) {
                regression::pointwise(self, data, out);
            }

            fn fits(&self, data: &Vec<$Datum>) -> Result<(), DomainError> {
                regression::require_length(stringify!($Name), &self.0, data.len())
            }

            fn validate(&self) -> Result<(), DomainError> {
                regression::validate(stringify!($Name), &self.0, &self.1, &self.2)
            }

            fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Vec<$Datum> {
                regression::draw(self, rng)
            }
        }
    };
}
impl_link!(PoissonLogGlm, PoissonLog, u64, |x| x as u64);
impl_link!(BernoulliLogitGlm, BernoulliLogit, bool, |x| x != 0.0);
