//! Linear regression.

use rand::Rng;

use super::design::Design;
use super::intercept::Intercept;
use super::regression::{self, Eta, Regression};
use super::statistics::{Fit, Statistics};
use crate::density::DomainError;
use crate::distribution::traits::normaliser;
use crate::distribution::{Distribution, Family, Normal, Sequence};
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::HALF_LN_2PI;
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;

/// Linear regression, `NormalGlm(x, intercept, slopes, sd)`: yᵢ ~ Normal(ηᵢ, σ) with ηᵢ = aᵢ + Σₖ xᵢₖ bₖ, for all data
/// in one statement.
///
/// ln p(y) = −½ Σᵢ ((yᵢ − ηᵢ)/σ)² − n ln σ − ½ n ln 2π, for σ > 0.
///
/// x is a [`Design`] with one row per datum; without predictors, its rows are empty (`&[[f64; 0]]`). The intercept is a
/// number or an unknown, or one value per group by [`ByGroup`](crate::ByGroup). The slopes are an array, a slice or a
/// `Vec` with one value per predictor. The data are a slice or vector of numbers.
///
/// Sufficient statistics are computed when the data are bound: the means of the groups, and a QR factorisation of the
/// deviations from the means. The cost of a gradient therefore depends on the number of groups and predictors, but not
/// on the number of data. Cross-validation leaves out one datum at a time.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     fn heights(school: &[usize], x: &[[f64; 2]], height: &[f64]) {
///         let mean ~ Normal(0.0, 1.0);
///         let level ~ Normal(mean, 1.0).array::<3>();
///         let slope ~ Normal(0.0, 1.0).array::<2>();
///         let sd ~ HalfNormal(1.0);
///         height ~ NormalGlm(x, ByGroup(level, school), slope, sd);
///     }
/// }
/// let x = [[0.3, 1.0], [0.1, 0.0], [-0.8, 1.0], [0.2, 0.0]];
/// assert_eq!(heights(&[0, 2, 1, 2], &x, &[1.2, 0.9, 0.2, 1.0]).layout()?.dim, 7);
/// # Ok::<(), ppl::ModelError>(())
/// ```
///
/// # References
/// Gelman et al. (2013), *Bayesian Data Analysis*, 3rd ed., ch. 14; Golub & Van Loan (2013), *Matrix
/// Computations*, 4th ed., § 5.3.
#[derive(Clone, Copy, Debug)]
pub struct NormalGlm<X, A, B, S>(pub X, pub A, pub B, pub S);

impl<X: Clone, A: Clone, B: Clone, S: Clone> Family for NormalGlm<X, A, B, S> {}

impl<R, X, A, B, S> Regression<R> for NormalGlm<X, A, B, S>
where
    R: Scalar,
    X: Design,
    A: Intercept<R>,
    B: Sequence<Item: Datum<R>>,
    S: Parameter + Datum<R>,
{
    type Each<'g>
        = Normal<Eta<'g, A, B>, S>
    where
        Self: 'g;

    #[inline(always)]
    fn size(&self) -> usize {
        self.0.size()
    }

    #[inline(always)]
    fn each(&self, i: usize) -> Self::Each<'_> {
        Normal(Eta::new::<R>(&self.0, &self.1, &self.2, i), self.3)
    }
}

impl<R, X, A, B, S> Distribution<R> for NormalGlm<X, A, B, S>
where
    R: Scalar,
    X: Design,
    A: Intercept<R>,
    B: Sequence<Item: Datum<R>>,
    S: Parameter + Datum<R>,
{
    type Value = Vec<R>;

    #[inline(always)]
    fn add_terms(&self, y: &Vec<R>, terms: &mut impl Accumulator<R>) {
        regression::add_terms(self, y.iter().copied(), terms);
    }

    const SUMMARISES: bool = true;

    fn summarise(&self, y: &Vec<R>, out: &mut Vec<f64>) {
        let y: Vec<f64> = y.iter().map(|y| y.value()).collect();
        Statistics::write(
            &self.0,
            &y,
            self.1.groups(),
            |i| self.1.group(i),
            self.2.items().len(),
            out,
        );
    }

    #[inline(always)]
    fn add_statistics_terms(&self, statistics: &[f64], terms: &mut impl Accumulator<R>) {
        let Self(_, intercept, slopes, sd) = self;
        let Some(statistics) = Statistics::read(statistics, slopes.items().len()) else {
            return terms.add_number(R::from(f64::NAN));
        };
        let n = statistics.n;
        let precise = sd.number().recip();
        let fit = Fit { statistics, intercept, slopes, weight: precise * precise };
        let quadratic = fit.squares() * fit.weight;
        let ln_normaliser = |sd: f64| sd.ln() + HALF_LN_2PI;
        terms.add(
            -0.5 * quadratic - n * normaliser(terms, *sd, ln_normaliser),
            fit.and(*sd, (quadratic - n) * precise),
        );
    }

    fn pointwise(&self, y: &Vec<R>, out: &mut Vec<f64>) {
        regression::pointwise(self, y, out);
    }

    fn fits(&self, y: &Vec<R>) -> Result<(), DomainError> {
        regression::require_length("NormalGlm", &self.0, y.len())
    }

    fn validate(&self) -> Result<(), DomainError> {
        regression::validate("NormalGlm", &self.0, &self.1, &self.2)?;
        DomainError::require_positive("NormalGlm", "sd", self.3.number())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Vec<R> {
        regression::draw(self, rng)
    }
}
