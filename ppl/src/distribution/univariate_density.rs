//! Univariate distributions: densities with derivatives.

use super::interval::Interval;
use super::interval_mass::ln_mass_by_quadrature;
use super::univariate::Univariate;
use crate::number::scalar::Scalar;
use crate::term::accumulator::{Accumulator, Joined};
use crate::transform::Support;

/// Density of a [`Univariate`] distribution over any [`Scalar`] type.
///
/// If a type implements this trait and [`univariate!`](crate::univariate) is called for the type, it can be used in
/// models with all variations of [`Family`](crate::Family).
///
/// # Example
/// ```
/// use ppl::prelude::*;
/// use ppl::{Datum, DomainError, Accumulator, Univariate, UnivariateDensity, transform::Support};
///
/// /// Hyperbolic secant distribution with an unknown location.
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
///     // the value, and its derivatives with respect to x and the parameter
///     fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
///         let z = x.value() - self.0.number();
///         let value = -z.cosh().ln() - std::f64::consts::PI.ln();
///         terms.add(value, ((x, -z.tanh()), (self.0, z.tanh())));
///     }
/// }
///
/// let positive = Secant(1.0).truncate(0.0..);
/// assert!((positive.cdf(positive.quantile(0.3)) - 0.3).abs() < 1e-12);
/// ```
pub trait UnivariateDensity<R: Scalar>: Univariate {
    /// Whether all parameters are known to be data.
    #[doc(hidden)]
    const CONSTANT: bool = false;

    /// Whether the ends of the support are natural bounds of the quantity, such as 0 and 1 for a share, so that no
    /// prior can have wider bounds.
    #[doc(hidden)]
    const NATURAL_ENDS: bool = false;

    /// Support of the density.
    fn support(&self) -> Support<R>;

    /// Adds the log density at `x` inside the support, with its exact partial derivatives with respect to x and the
    /// parameters.
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>);

    /// Log density at `x` inside the support.
    #[inline(always)]
    fn ln_pdf(&self, x: R) -> R {
        Joined::of(|terms| self.add_ln_pdf(x, terms))
    }

    /// See [`Distribution::HAS_STATISTICS`](super::Distribution::HAS_STATISTICS).
    #[doc(hidden)]
    const HAS_STATISTICS: bool = false;

    /// See [`Distribution::sufficient_statistics`](super::Distribution::sufficient_statistics).
    #[doc(hidden)]
    fn sufficient_statistics(data: impl Iterator<Item = R>, out: &mut Vec<f64>) {
        let _ = (data, out);
    }

    /// See [`Distribution::add_statistics_terms`](super::Distribution::add_statistics_terms).
    #[doc(hidden)]
    fn add_statistics_terms(&self, statistics: &[f64], terms: &mut impl Accumulator<R>) {
        let _ = statistics;
        terms.add_number(R::from(f64::NAN));
    }

    /// Maps the unconstrained coordinate `y` to a value, and adds log density and log-Jacobian to `terms`. Override
    /// this method if terms of the log density and the log-Jacobian cancel.
    #[inline(always)]
    fn at_coordinate(&self, y: R, terms: &mut impl Accumulator<R>) -> R {
        let x = self.support().constrain_last_use(y, terms);
        self.add_ln_pdf(x, terms);
        x
    }

    /// Version of [`at_coordinate`](UnivariateDensity::at_coordinate) for n values.
    #[doc(hidden)]
    #[inline(always)]
    fn at_coordinates(
        &self,
        n: usize,
        next: &mut impl FnMut() -> R,
        terms: &mut impl Accumulator<R>,
    ) -> Vec<R> {
        (0..n).map(|_| self.at_coordinate(next(), terms)).collect()
    }

    /// Log probability ln P(lower < X < upper), with its derivatives with respect to the parameters. The default uses
    /// adaptive quadrature; override this method if there is a closed form.
    fn ln_mass(&self, lower: f64, upper: f64) -> R {
        self.ln_mass_by_quadrature(lower, upper)
    }

    /// Default implementation of [`ln_mass`](UnivariateDensity::ln_mass).
    #[doc(hidden)]
    fn ln_mass_by_quadrature(&self, lower: f64, upper: f64) -> R {
        let at_coordinate = |y| {
            Joined::of(|terms| {
                self.at_coordinate(y, terms);
            })
        };
        let interval = Interval::new(lower..upper);
        ln_mass_by_quadrature(self, self.support(), interval, |x| self.ln_pdf(x), at_coordinate)
    }

    /// Log distribution function ln P(X ≤ x), with its derivatives with respect to x and the parameters.
    fn ln_cdf(&self, x: impl Into<R>) -> R {
        self.ln_mass_between(f64::NEG_INFINITY, x)
    }

    /// Log survival function ln P(X > x), with its derivatives with respect to x and the parameters.
    fn ln_sf(&self, x: impl Into<R>) -> R {
        self.ln_mass_between(x, f64::INFINITY)
    }

    /// Log probability ln P(lower < X < upper), with its derivatives with respect to both ends and the parameters; −∞
    /// if the interval is empty.
    fn ln_mass_between(&self, lower: impl Into<R>, upper: impl Into<R>) -> R {
        let ends: [R; 2] = [lower.into(), upper.into()];
        let mass = ln_probability(self, Interval::new(ends[0].value()..ends[1].value()));
        if ends.into_iter().all(R::is_constant) {
            return mass;
        }
        let (a, b) = self.support().bounds();
        // the derivative of the probability with respect to an end of the interval is ± the density at this end, and
        // 0 outside the support
        let density = |x: f64| {
            if !(a < x && x < b) {
                return 0.0;
            }
            (self.ln_pdf(R::from(x)).value() - mass.value()).exp()
        };
        let [below, above] = ends.map(|end| density(end.value()));
        R::fuse(mass.value(), [mass, ends[0], ends[1]], [1.0, -below, above])
    }

    /// Implementation of [`Unknown::bounds`](super::Unknown::bounds): the ends of the support, if both are finite and
    /// not natural bounds of the quantity.
    #[doc(hidden)]
    fn chosen_ends(&self) -> Option<(f64, f64)> {
        let (lower, upper) = self.support().bounds();
        (lower.is_finite() && upper.is_finite() && !Self::NATURAL_ENDS).then_some((lower, upper))
    }
}

/// Implements [`Distribution`](crate::Distribution) and [`Unknown`](crate::Unknown) for a [`UnivariateDensity`]:
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
            fn add_terms(&self, x: &R, terms: &mut impl $crate::Accumulator<R>) {
                $crate::__private::add_terms(self, *x, terms);
            }

            const HAS_STATISTICS: bool = <Self as $crate::UnivariateDensity<R>>::HAS_STATISTICS;

            fn sufficient_statistics(data: impl Iterator<Item = R>, out: &mut Vec<f64>) {
                <Self as $crate::UnivariateDensity<R>>::sufficient_statistics(data, out);
            }

            #[inline(always)]
            fn add_statistics_terms(&self, statistics: &[f64], terms: &mut impl $crate::Accumulator<R>) {
                $crate::UnivariateDensity::add_statistics_terms(self, statistics, terms);
            }

            fn validate(&self) -> Result<(), $crate::DomainError> {
                $crate::Univariate::validate(self)
            }

            fn draw<G: $crate::rand::Rng + ?Sized>(&self, rng: &mut G) -> R {
                let support = $crate::UnivariateDensity::<R>::support(self);
                R::from(support.inside($crate::Univariate::sample(self, rng)))
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
                terms: &mut impl $crate::Accumulator<R>,
            ) -> R {
                $crate::__private::constrain(self, next(), jacobian, terms)
            }

            #[inline(always)]
            fn constrain_all(
                &self,
                n: usize,
                next: &mut impl FnMut() -> R,
                jacobian: bool,
                terms: &mut impl $crate::Accumulator<R>,
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

/// Adds the log density at `x` to `terms`; −∞ outside the support.
#[inline(always)]
pub fn add_terms<R, D>(distribution: &D, x: R, terms: &mut impl Accumulator<R>)
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

/// Maps one coordinate to a value and adds the log density of the value to `terms`, including the log-Jacobian if
/// `jacobian` is true.
#[inline(always)]
pub fn constrain<R: Scalar, D: UnivariateDensity<R>>(
    distribution: &D,
    y: R,
    jacobian: bool,
    terms: &mut impl Accumulator<R>,
) -> R {
    if jacobian {
        distribution.at_coordinate(y, terms)
    } else {
        let x = distribution.support().replace(y, terms);
        distribution.add_ln_pdf(x, terms);
        x
    }
}

/// Log probability ln P(X ∈ interval); the interval can cover the support or be disjoint from it.
pub(super) fn ln_probability<R: Scalar, D: UnivariateDensity<R>>(
    distribution: &D,
    interval: Interval,
) -> R {
    let (lower, upper) = (interval.lower(), interval.upper());
    let (a, b) = distribution.support().bounds();
    if lower <= a && upper >= b {
        R::from(0.0)
    } else if lower >= b || upper <= a || lower >= upper {
        R::from(f64::NEG_INFINITY)
    } else {
        distribution.ln_mass(lower, upper)
    }
}
