//! Distributions: density with exact partials, draws, support, moments.
//!
//! One family a file. Parameters are public fields (`Normal(mean, sd)`), each a number, a
//! reference to one, or an unknown of the model. Variations are methods of [`Family`]:
//! `.truncate(a..b)`, `.censor(a..b)`, `.iid(n)`, `.array::<N>()`, `.array::<N>().ordered()`,
//! `.array::<N>().sum_to_zero()`.

mod array;
mod bernoulli;
mod bernoulli_logit;
mod bernoulli_probit;
mod beta;
mod beta_binomial;
mod binomial;
mod categorical;
mod cauchy;
mod censored;
mod chi_squared;
mod cholesky_factor;
mod count;
mod count_mass;
mod cut_points;
mod dirichlet;
mod discrete_uniform;
mod either;
mod ex_gaussian;
mod exponential;
mod frechet;
mod gamma;
mod gaussian_process;
mod geometric;
mod glm;
mod gumbel;
mod half_cauchy;
mod half_normal;
mod half_student_t;
mod iid;
mod interval;
mod interval_mass;
mod inverse_gamma;
mod inverse_gaussian;
mod inverse_wishart_cholesky;
mod kumaraswamy;
mod laplace;
mod lkj_cholesky;
mod log_logistic;
mod log_normal;
mod logistic;
mod logit_normal;
mod lomax;
mod mixture;
mod multinomial;
mod mv_normal_cholesky;
mod mv_student_t_cholesky;
mod negative_binomial;
mod non_centered;
mod normal;
mod numeric;
mod ordered;
mod ordered_logistic;
mod ordered_probit;
mod pareto;
mod poisson;
mod poisson_log;
mod rayleigh;
mod skew_normal;
mod student_t;
mod sum_to_zero;
mod triangle;
mod triangular;
mod truncated;
mod uniform;
mod unit_vector;
mod univariate;
mod vector;
mod von_mises;
mod weibull;
mod wishart_cholesky;
mod zero_inflated;

use rand::Rng;

use crate::density::DomainError;
use crate::real::Real;
use crate::record::{Datum, Record};
use crate::scalar::Scalar;
use crate::terms::{Settled, Terms};

pub use array::Array;
pub use bernoulli::Bernoulli;
pub use bernoulli_logit::BernoulliLogit;
pub use bernoulli_probit::BernoulliProbit;
pub use beta::Beta;
pub use beta_binomial::BetaBinomial;
pub use binomial::{Binomial, BinomialLogit};
pub use categorical::{Categorical, CategoricalLogit};
pub use cauchy::Cauchy;
pub use censored::Censored;
pub use chi_squared::ChiSquared;
pub(crate) use cholesky_factor::Angles;
pub use cholesky_factor::CholeskyFactor;
pub use count::{Count, CountMass, CountParameter};
pub use dirichlet::Dirichlet;
pub use discrete_uniform::DiscreteUniform;
pub use either::Either;
pub use ex_gaussian::ExGaussian;
pub use exponential::Exponential;
pub use frechet::Frechet;
pub use gamma::Gamma;
pub use gaussian_process::{
    GaussianProcess, Kernel, Lengths, Matern32, Matern52, Mean, Point, Prediction,
    SquaredExponential,
};
pub use geometric::Geometric;
pub use glm::{
    BernoulliLogitGlm, ByGroup, Design, Intercept, NormalGlm, PoissonLogGlm, Predictors,
};
pub use gumbel::Gumbel;
pub use half_cauchy::HalfCauchy;
pub use half_normal::HalfNormal;
pub use half_student_t::HalfStudentT;
pub use iid::Iid;
pub use interval::{Ends, Interval};
#[doc(hidden)]
pub use interval_mass::ln_probability;
pub use inverse_gamma::InverseGamma;
pub use inverse_gaussian::InverseGaussian;
pub use inverse_wishart_cholesky::InverseWishartCholesky;
pub use kumaraswamy::Kumaraswamy;
pub use laplace::Laplace;
pub use lkj_cholesky::LkjCholesky;
pub use log_logistic::LogLogistic;
pub use log_normal::LogNormal;
pub use logistic::Logistic;
pub use logit_normal::LogitNormal;
pub use lomax::Lomax;
pub use mixture::{Components, Mixture, Weights};
pub use multinomial::Multinomial;
pub use mv_normal_cholesky::MvNormalCholesky;
pub use mv_student_t_cholesky::MvStudentTCholesky;
pub use negative_binomial::NegativeBinomial;
pub use non_centered::{LocationScale, NonCentered};
pub use normal::Normal;
pub use numeric::Numeric;
pub use ordered::Ordered;
pub use ordered_logistic::OrderedLogistic;
pub use ordered_probit::OrderedProbit;
pub use pareto::Pareto;
pub use poisson::Poisson;
pub use poisson_log::PoissonLog;
pub use rayleigh::Rayleigh;
pub use skew_normal::SkewNormal;
pub use student_t::StudentT;
pub use sum_to_zero::SumToZero;
pub use triangle::Triangular;
pub use truncated::Truncated;
pub use uniform::Uniform;
pub use unit_vector::UnitVector;
pub use univariate::{Univariate, UnivariateDensity};
#[doc(hidden)]
pub use univariate::{add_terms, constrain};
pub use vector::{Repeated, Vector};
pub use von_mises::VonMises;
pub use weibull::Weibull;
pub use wishart_cholesky::WishartCholesky;
pub use zero_inflated::ZeroInflated;

/// A parameter of a distribution, seen as a plain number: `f64`, any [`Scalar`], or a reference to
/// one.
pub trait Parameter: Copy {
    /// Its value.
    fn number(self) -> f64;
}

impl<S: Scalar> Parameter for S {
    #[inline]
    fn number(self) -> f64 {
        self.value()
    }
}

impl Parameter for &f64 {
    #[inline]
    fn number(self) -> f64 {
        *self
    }
}

impl<S: Scalar> Parameter for &Real<S> {
    #[inline]
    fn number(self) -> f64 {
        self.value()
    }
}

/// The variations that every distribution has.
pub trait Family: Sized + Clone {
    /// The distribution conditioned on an interval: `Normal(0.0, 1.0).truncate(0.0..)`.
    ///
    /// The bounds are data. Either may be left out; whether it belongs to the interval matters
    /// for counts only.
    fn truncate(self, range: impl Ends) -> Truncated<Self> {
        Truncated { inner: self, interval: Interval::new(range) }
    }

    /// The distribution seen through an instrument that ends: `Weibull(2.0, 50.0).censor(..100.0)`
    /// takes data at or beyond 100 as "at least 100".
    ///
    /// The bounds are data.
    fn censor(self, range: impl Ends) -> Censored<Self> {
        Censored { inner: self, interval: Interval::new(range) }
    }

    /// The same distribution over the coordinates of its standard form, for unknowns whose location
    /// or scale is unknown: `Normal(mu, tau).non_centered()`; see [`NonCentered`].
    fn non_centered(self) -> NonCentered<Self> {
        NonCentered { inner: self }
    }

    /// `n` independent values, a `Vec`: for lengths known at run time.
    fn iid(self, n: usize) -> Iid<Self> {
        Iid { inner: self, n }
    }

    /// `N` independent values, an array: for lengths known at compile time.
    fn array<const N: usize>(self) -> Array<Self, N> {
        Array { inner: self }
    }

    /// Independent values in ascending order: `Normal(0.0, 5.0).array::<4>().ordered()`.
    fn ordered(self) -> Ordered<Self> {
        Ordered { inner: self }
    }

    /// Independent normal values that sum to zero:
    /// `Normal(0.0, sd).array::<4>().sum_to_zero()`.
    fn sum_to_zero(self) -> SumToZero<Self> {
        SumToZero { inner: self }
    }
}

/// What every distribution offers to a model: density and draws over values of type `Value`.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a distribution",
    label = "the right-hand side of `~` must be a distribution such as `Normal(0.0, 1.0)`"
)]
pub trait Distribution<R: Scalar>: Family {
    /// A number, a count, a flag, an array, a vector or a Cholesky factor.
    type Value: Clone + Record;

    /// Log density (log mass for counts) at `x`; −∞ outside the support, NaN for parameters
    /// outside their domain.
    #[must_use = "a model takes it by `factor(…);`"]
    fn ln_density(&self, x: &Self::Value) -> R;

    /// [`ln_density`](Distribution::ln_density), term by term.
    #[doc(hidden)]
    #[inline(always)]
    fn add_terms(&self, x: &Self::Value, terms: &mut impl Terms<R>) {
        terms.add_number(self.ln_density(x));
    }

    /// Whether a few sums over data suffice for all of them, if the parameters are the same.
    #[doc(hidden)]
    const POOLS: bool = false;

    /// The sums that suffice, at the end of `sums`.
    #[doc(hidden)]
    fn sum_up(data: impl Iterator<Item = Self::Value>, sums: &mut Vec<f64>) {
        let _ = (data, sums);
    }

    /// The terms of the log densities at the data with these sums.
    #[doc(hidden)]
    fn add_pooled_terms(&self, sums: &[f64], terms: &mut impl Terms<R>) {
        let _ = sums;
        terms.add_number(R::from(f64::NAN));
    }

    /// Whether one observation holds so many data that they are summarised when they are bound.
    #[doc(hidden)]
    const SUMMARISES: bool = false;

    /// What [`add_pooled_terms`](Distribution::add_pooled_terms) needs of one observation, at the end
    /// of `sums`: it depends on `x` and on what the distribution has of data, not on unknowns.
    #[doc(hidden)]
    fn summarise(&self, x: &Self::Value, sums: &mut Vec<f64>) {
        let _ = (x, sums);
    }

    /// The log density of what cross-validation may leave out of `x`, part by part, at the end of
    /// `out`.
    #[doc(hidden)]
    fn pointwise(&self, x: &Self::Value, out: &mut Vec<f64>) {
        let mut terms = Settled::new(1.0);
        self.add_terms(x, &mut terms);
        out.push(terms.total());
    }

    /// Whether `x` has the size that the distribution asks for.
    ///
    /// # Errors
    /// [`DomainError`] that says both sizes.
    #[doc(hidden)]
    fn fits(&self, x: &Self::Value) -> Result<(), DomainError> {
        let _ = x;
        Ok(())
    }

    /// Whether the parameters lie in their domain.
    ///
    /// # Errors
    /// [`DomainError`] naming distribution, parameter, requirement and value.
    fn validate(&self) -> Result<(), DomainError>;

    /// An exact draw, as constants of `R`, that lies inside the open support: one that underflows to
    /// an end, or overflows, is the nearest number inside.
    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Self::Value;
}

/// A distribution whose values can be unknowns: it maps unconstrained coordinates to them.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be the distribution of an unknown",
    label = "has no smooth map from unconstrained space",
    note = "a discrete distribution can only be observed: write `place ~ D` without `let`",
    note = "a discrete unknown must be summed out: by `Mixture`, or by `factor(ln_sum_exp(…))`"
)]
pub trait Unknown<R: Scalar>: Distribution<R> {
    /// Number of unconstrained coordinates.
    fn dim(&self) -> usize;

    /// The value at the next coordinates. Its log density goes to `terms`; `jacobian` adds the
    /// log-Jacobian of the map, in a form that cancels what can be cancelled.
    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Terms<R>,
    ) -> Self::Value;

    /// [`constrain`](Unknown::constrain) for n independent values.
    #[doc(hidden)]
    #[inline(always)]
    fn constrain_all(
        &self,
        n: usize,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Terms<R>,
    ) -> Vec<Self::Value> {
        (0..n).map(|_| self.constrain(next, jacobian, terms)).collect()
    }

    /// Appends the coordinates of `x`: the inverse of [`constrain`](Unknown::constrain).
    fn unconstrain(&self, x: &Self::Value, out: &mut Vec<f64>);

    /// The ends of the support that a prior may be said to cut at, the same for each element: two
    /// finite ones, if they are not the quantity's own, or a single one at which a constant prior was
    /// truncated.
    fn bounds(&self) -> Option<(f64, f64)> {
        None
    }
}

/// A parameter as a number of the model's kind.
#[inline(always)]
pub(crate) fn lift<R>(parameter: impl Datum<R>) -> R {
    parameter.lift()
}

/// A part of a log density that depends on `parameter` alone: left out where that may be.
#[inline(always)]
pub(crate) fn normaliser<R: Scalar, P: Parameter + Datum<R>>(
    terms: &impl Terms<R>,
    parameter: P,
    part: impl FnOnce(f64) -> f64,
) -> f64 {
    if P::CONSTANT && terms.leave_out_constants() { 0.0 } else { part(parameter.number()) }
}
