//! Distributions of one real number.

use rand::Rng;

use super::{Family, Interval, Truncated, interval_mass};
use crate::density::DomainError;
use crate::scalar::Scalar;
use crate::terms::Terms;
use crate::transform::Support;

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

    /// P(X ≤ x), accurate in the lower tail: a plain number, which has lost its derivatives in
    /// unknown parameters ([`ln_cdf`](UnivariateDensity::ln_cdf) has them).
    fn cdf(&self, x: f64) -> f64;

    /// P(X > x), accurate in the upper tail: a plain number, which has lost its derivatives in
    /// unknown parameters ([`ln_sf`](UnivariateDensity::ln_sf) has them).
    fn sf(&self, x: f64) -> f64;

    /// The x with P(X ≤ x) = p.
    fn quantile(&self, p: f64) -> f64;

    /// The x with P(X > x) = q, accurate for small q.
    fn upper_quantile(&self, q: f64) -> f64 {
        self.quantile(1.0 - q)
    }

    /// An exact draw of X given that it lies in the interval.
    fn sample_within<G: Rng + ?Sized>(&self, interval: Interval, rng: &mut G) -> f64 {
        Truncated { inner: self.clone(), interval }.sample(rng)
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
/// /// The hyperbolic secant distribution, moved by its one parameter.
/// #[derive(Clone, Copy)]
/// struct Secant<M>(M);
///
/// ppl::univariate!([M: Parameter] Secant<M>);
///
/// impl<M: Parameter> Univariate for Secant<M> {
///     fn validate(&self) -> Result<(), DomainError> {
///         DomainError::require_finite("Secant", "mean", self.0.number())
///     }
///     fn sample<G: ppl::rand::Rng + ?Sized>(&self, rng: &mut G) -> f64 {
///         self.quantile(rng.random())
///     }
///     fn mean(&self) -> f64 {
///         self.0.number()
///     }
///     fn variance(&self) -> f64 {
///         std::f64::consts::FRAC_PI_2.powi(2)
///     }
///     fn cdf(&self, x: f64) -> f64 {
///         std::f64::consts::FRAC_2_PI * (x - self.0.number()).exp().atan()
///     }
///     fn sf(&self, x: f64) -> f64 {
///         std::f64::consts::FRAC_2_PI * (self.0.number() - x).exp().atan()
///     }
///     fn quantile(&self, p: f64) -> f64 {
///         self.0.number() + (std::f64::consts::FRAC_PI_2 * p).tan().ln()
///     }
/// }
///
/// impl<R: Scalar, M: Parameter + Datum<R>> UnivariateDensity<R> for Secant<M> {
///     fn support(&self) -> Support<R> {
///         Support::Real
///     }
///     fn ln_pdf(&self, x: R) -> R {
///         let z = x.value() - self.0.number();
///         let slope = z.tanh();
///         let value = -ppl::special::ln_cosh(z) - std::f64::consts::PI.ln();
///         R::fuse(value, [x, self.0.lift()], [-slope, slope])
///     }
/// }
///
/// let positive = Secant(1.0).truncate(0.0..);
/// assert!((positive.cdf(positive.quantile(0.3)) - 0.3).abs() < 1e-12);
/// ```
pub trait UnivariateDensity<R: Scalar>: Univariate {
    /// Whether all parameters are data, as far as known.
    #[doc(hidden)]
    const CONSTANT: bool = false;

    /// Whether the ends of the support are those of the quantity, as of a share or an angle, so that
    /// no prior can be wider.
    #[doc(hidden)]
    const NATURAL_ENDS: bool = false;

    /// Where the density is positive.
    fn support(&self) -> Support<R>;

    /// Log density at `x` inside the support, as one fused operation with exact partials.
    fn ln_pdf(&self, x: R) -> R;

    /// See [`Distribution::add_terms`](super::Distribution::add_terms).
    #[doc(hidden)]
    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Terms<R>) {
        terms.add_number(self.ln_pdf(x));
    }

    /// See [`Distribution::POOLS`](super::Distribution::POOLS).
    #[doc(hidden)]
    const POOLS: bool = false;

    /// See [`Distribution::sum_up`](super::Distribution::sum_up).
    #[doc(hidden)]
    fn sum_up(data: impl Iterator<Item = R>, sums: &mut Vec<f64>) {
        let _ = (data, sums);
    }

    /// See [`Distribution::add_pooled_terms`](super::Distribution::add_pooled_terms).
    #[doc(hidden)]
    fn add_pooled_terms(&self, sums: &[f64], terms: &mut impl Terms<R>) {
        let _ = sums;
        terms.add_number(R::from(f64::NAN));
    }

    /// The value at the unconstrained coordinate `y`; log density plus log-Jacobian go to `terms`.
    /// Override it where the two cancel.
    #[inline(always)]
    fn at_coordinate(&self, y: R, terms: &mut impl Terms<R>) -> R {
        let x = self.support().place(y, terms);
        self.add_ln_pdf(x, terms);
        x
    }

    /// [`at_coordinate`](UnivariateDensity::at_coordinate) for n values.
    #[doc(hidden)]
    #[inline(always)]
    fn at_coordinates(
        &self,
        n: usize,
        next: &mut impl FnMut() -> R,
        terms: &mut impl Terms<R>,
    ) -> Vec<R> {
        (0..n).map(|_| self.at_coordinate(next(), terms)).collect()
    }

    /// ln P(lower < X < upper), with its derivatives in the parameters.
    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        interval_mass::ln_mass_by_quadrature(self, lower, upper)
    }

    /// ln P(X ≤ x), with its derivatives in x and the parameters.
    fn ln_cdf(&self, x: impl Into<R>) -> R {
        self.ln_mass_between(f64::NEG_INFINITY, x)
    }

    /// ln P(X > x), with its derivatives in x and the parameters.
    fn ln_sf(&self, x: impl Into<R>) -> R {
        self.ln_mass_between(x, f64::INFINITY)
    }

    /// ln P(lower < X < upper), with its derivatives in both ends and the parameters; −∞ if there is
    /// nothing between them.
    fn ln_mass_between(&self, lower: impl Into<R>, upper: impl Into<R>) -> R {
        interval_mass::ln_mass_between(self, lower.into(), upper.into())
    }

    /// The ends of the support, if there are two and neither is the quantity's own.
    #[doc(hidden)]
    fn chosen_ends(&self) -> Option<(f64, f64)> {
        let (lower, upper) = self.support().bounds();
        (lower.is_finite() && upper.is_finite() && !Self::NATURAL_ENDS).then_some((lower, upper))
    }
}

/// Makes a [`UnivariateDensity`] a [`Distribution`](crate::Distribution) and an [`Unknown`](crate::Unknown):
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

            #[inline(always)]
            fn ln_density(&self, x: &R) -> R {
                $crate::Joined::of(|terms| $crate::__private::add_terms(self, *x, terms))
            }

            #[inline(always)]
            fn add_terms(&self, x: &R, terms: &mut impl $crate::Terms<R>) {
                $crate::__private::add_terms(self, *x, terms);
            }

            const POOLS: bool = <Self as $crate::UnivariateDensity<R>>::POOLS;

            fn sum_up(data: impl Iterator<Item = R>, sums: &mut Vec<f64>) {
                <Self as $crate::UnivariateDensity<R>>::sum_up(data, sums);
            }

            #[inline(always)]
            fn add_pooled_terms(&self, sums: &[f64], terms: &mut impl $crate::Terms<R>) {
                $crate::UnivariateDensity::add_pooled_terms(self, sums, terms);
            }

            fn validate(&self) -> Result<(), $crate::DomainError> {
                $crate::Univariate::validate(self)
            }

            fn draw<G: $crate::rand::Rng + ?Sized>(&self, rng: &mut G) -> R {
                let support = $crate::UnivariateDensity::<R>::support(self);
                R::from(support.inside($crate::Univariate::sample(self, rng)))
            }
        }

        impl<R: $crate::Scalar, $($P: $Bound),*> $crate::Numeric<R> for $Name
        where
            Self: $crate::UnivariateDensity<R>,
        {
            const CONSTANT: bool = <Self as $crate::UnivariateDensity<R>>::CONSTANT;

            #[inline]
            fn ln_probability(&self, interval: $crate::Interval) -> R {
                $crate::__private::ln_probability(self, interval)
            }

            fn draw_within<G>(&self, interval: $crate::Interval, rng: &mut G) -> R
            where
                G: $crate::rand::Rng + ?Sized,
            {
                let support = $crate::UnivariateDensity::<R>::support(self);
                let support = support.within(interval.lower(), interval.upper());
                R::from(support.inside($crate::Univariate::sample_within(self, interval, rng)))
            }

            #[inline]
            fn number(x: &R) -> f64 {
                x.value()
            }

            #[inline]
            fn is_within(x: &R, interval: &$crate::Interval) -> bool {
                interval.contains(x.value())
            }

            fn clamp(x: R, interval: &$crate::Interval) -> R {
                R::from(x.value().max(interval.lower()).min(interval.upper()))
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
            fn constrain(
                &self,
                next: &mut impl FnMut() -> R,
                jacobian: bool,
                terms: &mut impl $crate::Terms<R>,
            ) -> R {
                $crate::__private::constrain(self, next(), jacobian, terms)
            }

            #[inline(always)]
            fn constrain_all(
                &self,
                n: usize,
                next: &mut impl FnMut() -> R,
                jacobian: bool,
                terms: &mut impl $crate::Terms<R>,
            ) -> Vec<R> {
                if jacobian {
                    return $crate::UnivariateDensity::at_coordinates(self, n, next, terms);
                }
                let mut values = Vec::with_capacity(n);
                for _ in 0..n {
                    values.push(self.constrain(next, false, terms));
                }
                values
            }

            fn unconstrain(&self, x: &R, out: &mut Vec<f64>) {
                out.push($crate::UnivariateDensity::<R>::support(self).unconstrain(x.value()));
            }

            fn bounds(&self) -> Option<(f64, f64)> {
                $crate::UnivariateDensity::<R>::chosen_ends(self)
            }
        }
    };
}

/// −∞ outside the support, the density inside.
#[inline(always)]
pub fn add_terms<R, D>(distribution: &D, x: R, terms: &mut impl Terms<R>)
where
    R: Scalar,
    D: UnivariateDensity<R>,
{
    if distribution.support().contains(x.value()) || x.value().is_nan() {
        distribution.add_ln_pdf(x, terms);
    } else {
        terms.add_number(R::from(f64::NEG_INFINITY));
    }
}

/// One coordinate to one value.
#[inline(always)]
pub fn constrain<R: Scalar, D: UnivariateDensity<R>>(
    distribution: &D,
    y: R,
    jacobian: bool,
    terms: &mut impl Terms<R>,
) -> R {
    if jacobian {
        distribution.at_coordinate(y, terms)
    } else {
        let x = distribution.support().replace(y, terms);
        distribution.add_ln_pdf(x, terms);
        x
    }
}
