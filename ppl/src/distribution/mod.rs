//! Distributions: density with exact partials, draws, support, moments.
//!
//! One family a file. Parameters are public fields (`Normal(mean, sd)`), each a number, a
//! reference to one, or an unknown of the model. Variations are methods of [`Family`]:
//! `.truncate(a..b)`, `.iid(n)`, `.array::<N>()`, `.array::<N>().ordered()`,
//! `.array::<N>().sum_to_zero()`.

mod array;
mod bernoulli;
mod beta;
mod categorical;
mod cholesky_factor;
mod dirichlet;
mod exponential;
mod gamma;
mod gaussian_process;
mod half_cauchy;
mod half_normal;
mod iid;
mod inverse_wishart_cholesky;
mod lkj_cholesky;
mod log_normal;
mod multinomial;
mod mv_normal_cholesky;
mod mv_student_t_cholesky;
mod non_centered;
mod normal;
mod ordered;
mod ordered_logistic;
mod poisson;
mod student_t;
mod sum_to_zero;
mod triangular;
mod truncated;
mod uniform;
mod unit_vector;
mod vector;
mod wishart_cholesky;

use std::ops::{Bound, RangeBounds};

use rand::Rng;

use crate::density::DomainError;
use crate::record::{Datum, Record};
use crate::scalar::Scalar;
use crate::transform::Support;

pub use array::Array;
pub use bernoulli::Bernoulli;
pub use beta::Beta;
pub use categorical::{Categorical, CategoricalLogit};
pub use cholesky_factor::CholeskyFactor;
pub use dirichlet::Dirichlet;
pub use exponential::Exponential;
pub use gamma::Gamma;
pub use gaussian_process::{
    GaussianProcess, Kernel, Lengths, Matern32, Matern52, Mean, Point, Prediction,
    SquaredExponential,
};
pub use half_cauchy::HalfCauchy;
pub use half_normal::HalfNormal;
pub use iid::Iid;
pub use inverse_wishart_cholesky::InverseWishartCholesky;
pub use lkj_cholesky::LkjCholesky;
pub use log_normal::LogNormal;
pub use multinomial::Multinomial;
pub use mv_normal_cholesky::MvNormalCholesky;
pub use mv_student_t_cholesky::MvStudentTCholesky;
pub use non_centered::{LocationScale, NonCentered};
pub use normal::Normal;
pub use ordered::Ordered;
pub use ordered_logistic::OrderedLogistic;
pub use poisson::Poisson;
pub use student_t::StudentT;
pub use sum_to_zero::SumToZero;
pub use truncated::Truncated;
pub use uniform::Uniform;
pub use unit_vector::UnitVector;
pub use vector::{Repeated, Vector};
pub use wishart_cholesky::WishartCholesky;

/// A parameter of a distribution, seen as a plain number: `f64`, `&f64` or any [`Scalar`].
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

/// The variations that every distribution has.
pub trait Family: Sized + Clone {
    /// The distribution conditioned on an interval: `Normal(0.0, 1.0).truncate(0.0..)`.
    ///
    /// The bounds are data. Both ends may be open, and count as measure zero anyway.
    fn truncate(self, range: impl RangeBounds<f64>) -> Truncated<Self> {
        let end = |bound: Bound<&f64>, open: f64| match bound {
            Bound::Included(&x) | Bound::Excluded(&x) => x,
            Bound::Unbounded => open,
        };
        Truncated {
            inner: self,
            lower: end(range.start_bound(), f64::NEG_INFINITY),
            upper: end(range.end_bound(), f64::INFINITY),
        }
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

    /// See [`UnivariateDensity::SUMMANDS`].
    #[doc(hidden)]
    const SUMMANDS: bool = false;

    /// Log density (log mass for counts) at `x`; −∞ outside the support, NaN for parameters
    /// outside their domain.
    fn ln_density(&self, x: &Self::Value) -> R;

    /// The sum of the log densities at many data. Where the parameters are the same for all, a
    /// few sums over the data suffice.
    #[doc(hidden)]
    #[inline(always)]
    fn ln_densities(&self, data: impl Iterator<Item = Self::Value>) -> R {
        let mut total = R::from(0.0);
        for x in data {
            total += self.ln_density(&x);
        }
        total
    }

    /// Whether the parameters lie in their domain.
    ///
    /// # Errors
    /// [`DomainError`] naming distribution, parameter, requirement and value.
    fn validate(&self) -> Result<(), DomainError>;

    /// An exact draw, as constants of `R`.
    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Self::Value;
}

/// A distribution whose values can be unknowns: it maps unconstrained coordinates to them.
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be the distribution of an unknown",
    label = "has no smooth map from unconstrained space",
    note = "a discrete distribution can only be observed: write `place ~ D` without `let`",
    note = "a discrete unknown must be summed out by hand, with `factor`"
)]
pub trait Unknown<R: Scalar>: Distribution<R> {
    /// Number of unconstrained coordinates.
    fn dim(&self) -> usize;

    /// The value at the next coordinates, and its log density; `jacobian` adds the
    /// log-Jacobian of the map, in a form that cancels what can be cancelled.
    fn constrain(&self, next: &mut impl FnMut() -> R, jacobian: bool) -> (Self::Value, R);

    /// Appends the coordinates of `x`: the inverse of [`constrain`](Unknown::constrain).
    fn unconstrain(&self, x: &Self::Value, out: &mut Vec<f64>);

    /// The ends of the support, if each element has the same two finite ones.
    fn bounds(&self) -> Option<(f64, f64)> {
        None
    }
}

/// A distribution of one real number: what needs the values of its parameters only.
pub trait Univariate: Family {
    /// Whether the parameters lie in their domain.
    ///
    /// # Errors
    /// [`DomainError`] naming distribution, parameter, requirement and value.
    fn validate(&self) -> Result<(), DomainError>;

    /// An exact draw.
    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64;

    /// Expectation; NaN or infinite where it does not exist.
    fn mean(&self) -> f64;

    /// Variance; NaN or infinite where it does not exist.
    fn variance(&self) -> f64;

    /// P(X ≤ x), accurate in the lower tail.
    fn cdf(&self, x: f64) -> f64;

    /// P(X > x), accurate in the upper tail.
    fn sf(&self, x: f64) -> f64;

    /// The x with P(X ≤ x) = p.
    fn quantile(&self, p: f64) -> f64;

    /// The x with P(X > x) = q, accurate for small q.
    fn upper_quantile(&self, q: f64) -> f64 {
        self.quantile(1.0 - q)
    }
}

/// The density of a [`Univariate`] distribution over any [`Scalar`].
///
/// Implementing it (and [`univariate!`](crate::univariate)) makes a distribution usable in
/// models, in all variations.
///
/// # Example
/// ```
/// use ppl::prelude::*;
/// use ppl::{Datum, DomainError, Univariate, UnivariateDensity, transform::Support};
///
/// /// The standard logistic distribution, moved by its one parameter.
/// #[derive(Clone, Copy)]
/// struct Logistic<M>(M);
///
/// ppl::univariate!([M: Parameter] Logistic<M>);
///
/// impl<M: Parameter> Univariate for Logistic<M> {
///     fn validate(&self) -> Result<(), DomainError> {
///         DomainError::require_finite("Logistic", "mean", self.0.number())
///     }
///     fn sample<G: ppl::rand::Rng + ?Sized>(&self, rng: &mut G) -> f64 {
///         self.quantile(rng.random())
///     }
///     fn mean(&self) -> f64 {
///         self.0.number()
///     }
///     fn variance(&self) -> f64 {
///         std::f64::consts::PI.powi(2) / 3.0
///     }
///     fn cdf(&self, x: f64) -> f64 {
///         (x - self.0.number()).logistic()
///     }
///     fn sf(&self, x: f64) -> f64 {
///         (self.0.number() - x).logistic()
///     }
///     fn quantile(&self, p: f64) -> f64 {
///         self.0.number() + (p / (1.0 - p)).ln()
///     }
/// }
///
/// impl<R: Scalar, M: Parameter + Datum<R>> UnivariateDensity<R> for Logistic<M> {
///     fn support(&self) -> Support<R> {
///         Support::Real
///     }
///     fn ln_pdf(&self, x: R) -> R {
///         let z = x.value() - self.0.number();
///         let slope = 1.0 - 2.0 * z.logistic();
///         R::fuse(-z.softplus() - (-z).softplus(), [x, self.0.lift()], [slope, -slope])
///     }
/// }
///
/// let positive = Logistic(1.0).truncate(0.0..);
/// assert!((positive.cdf(positive.quantile(0.3)) - 0.3).abs() < 1e-12);
/// ```
pub trait UnivariateDensity<R: Scalar>: Univariate {
    /// Whether the log density is a sum of [terms](Scalar::term), from whose values nothing
    /// further is computed: their partials may be taken one by one then.
    #[doc(hidden)]
    const SUMMANDS: bool = false;

    /// Whether all parameters are data, as far as known.
    #[doc(hidden)]
    const CONSTANT: bool = false;

    /// Where the density is positive.
    fn support(&self) -> Support<R>;

    /// Log density at `x` inside the support, as one fused operation with exact partials.
    fn ln_pdf(&self, x: R) -> R;

    /// The sum of the log densities at many data; see [`Distribution::ln_densities`].
    #[doc(hidden)]
    #[inline(always)]
    fn ln_pdfs(&self, data: impl Iterator<Item = R>) -> R
    where
        Self: Distribution<R>,
    {
        let mut total = R::from(0.0);
        for x in data {
            total += ln_density(self, x);
        }
        total
    }

    /// The value at the unconstrained coordinate `y`, with log density plus log-Jacobian.
    /// Override it where the two cancel.
    #[inline(always)]
    fn ln_pdf_unconstrained(&self, y: R) -> (R, R) {
        let (x, log_jacobian) = self.support().constrain(y);
        (x, self.ln_pdf(x) + R::term(log_jacobian.value(), ((log_jacobian, 1.0),)))
    }

    /// ln P(lower < X < upper), with its derivatives in the parameters.
    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        truncated::ln_mass_by_quadrature(self, lower, upper)
    }
}

/// Makes a [`UnivariateDensity`] a [`Distribution`] and an [`Unknown`]:
/// `ppl::univariate!([M: Parameter, S: Parameter] Normal<M, S>);`.
#[macro_export]
macro_rules! univariate {
    ([$($P:ident: $Bound:path),*] $Name:ty) => {
        impl<$($P: $Bound),*> $crate::Family for $Name {}

        impl<R: $crate::Scalar, $($P: $Bound),*> $crate::Distribution<R> for $Name
        where
            Self: $crate::UnivariateDensity<R>,
        {
            type Value = R;
            const SUMMANDS: bool = <Self as $crate::UnivariateDensity<R>>::SUMMANDS;

            #[inline(always)]
            fn ln_density(&self, x: &R) -> R {
                $crate::__private::ln_density(self, *x)
            }

            #[inline(always)]
            fn ln_densities(&self, data: impl Iterator<Item = R>) -> R {
                $crate::UnivariateDensity::ln_pdfs(self, data)
            }

            fn validate(&self) -> Result<(), $crate::DomainError> {
                $crate::Univariate::validate(self)
            }

            fn draw<G: $crate::rand::Rng + ?Sized>(&self, rng: &mut G) -> R {
                R::from($crate::Univariate::sample(self, rng))
            }
        }

        impl<R: $crate::Scalar, $($P: $Bound),*> $crate::Unknown<R> for $Name
        where
            Self: $crate::UnivariateDensity<R>,
        {
            #[inline(always)]
            fn dim(&self) -> usize {
                1
            }

            #[inline(always)]
            fn constrain(&self, next: &mut impl FnMut() -> R, jacobian: bool) -> (R, R) {
                $crate::__private::constrain(self, next(), jacobian)
            }

            fn unconstrain(&self, x: &R, out: &mut Vec<f64>) {
                out.push($crate::UnivariateDensity::<R>::support(self).unconstrain(x.value()));
            }

            fn bounds(&self) -> Option<(f64, f64)> {
                let (lower, upper) = $crate::UnivariateDensity::<R>::support(self).bounds();
                (lower.is_finite() && upper.is_finite()).then_some((lower, upper))
            }
        }
    };
}

/// −∞ outside the support, the density inside.
#[inline(always)]
pub fn ln_density<R: Scalar, D: UnivariateDensity<R>>(distribution: &D, x: R) -> R {
    if distribution.support().contains(x.value()) || x.value().is_nan() {
        distribution.ln_pdf(x)
    } else {
        R::from(f64::NEG_INFINITY)
    }
}

/// One coordinate to one value.
#[inline(always)]
pub fn constrain<R: Scalar, D: UnivariateDensity<R>>(
    distribution: &D,
    y: R,
    jacobian: bool,
) -> (R, R) {
    if jacobian {
        distribution.ln_pdf_unconstrained(y)
    } else {
        let (x, _) = distribution.support().constrain(y);
        (x, distribution.ln_pdf(x))
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
    parameter: P,
    part: impl FnOnce(f64) -> f64,
) -> f64 {
    if R::LEAN && P::CONSTANT { 0.0 } else { part(parameter.number()) }
}
