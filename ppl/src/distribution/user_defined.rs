//! User-defined distributions: a log density, a draw and a domain.

use rand::Rng;

use super::family::Family;
use crate::density::DomainError;
use crate::number::scalar::Scalar;
use crate::term::accumulator::Accumulator;
use crate::transform::{Domain, SmoothDomain};

/// A user-defined distribution.
///
/// Implement this trait and call [`density!`](crate::density!) for the type. The distribution can then stand on the
/// right-hand side of `place ~ D`, and of `let x ~ D` if the domain is a [`SmoothDomain`]; `.iid(n)` and
/// `.array::<N>()` are available. Derivatives follow from `ln_density`, which is written for any scalar type.
///
/// `.truncate(a..b)` and `.censor(a..b)` need distribution functions and partial derivatives: implement
/// [`Univariate`](crate::Univariate) and [`UnivariateDensity`](crate::UnivariateDensity) instead, and call
/// [`univariate!`](crate::univariate!).
///
/// Write the trait with its path, `impl<R: Scalar> ppl::Density<R> for Name`. The prelude does not contain the trait,
/// because its methods have the names of the methods of [`Distribution`](crate::Distribution), which are called in
/// models.
///
/// # Example
/// ```
/// use ppl::prelude::*;
/// use ppl::rand::Rng;
/// use ppl::{Datum, transform::Support};
///
/// /// Laplace distribution with location 0 and an unknown scale.
/// #[derive(Clone, Copy, Debug)]
/// struct Laplace<S>(S);
///
/// impl<R: Scalar, S: Parameter + Datum<R>> ppl::Density<R> for Laplace<S> {
///     type Domain = Support<R>;
///
///     fn domain(&self) -> Support<R> {
///         Support::Real
///     }
///
///     fn ln_density(&self, x: &R) -> R {
///         let scale: R = self.0.lift();
///         -x.abs() / scale - (scale * 2.0).ln()
///     }
///
///     fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> R {
///         let size: f64 = -self.0.number() * rng.random::<f64>().ln();
///         R::from(if rng.random() { size } else { -size })
///     }
/// }
///
/// ppl::density!([S: Parameter] Laplace<S>);
///
/// ppl::model! {
///     fn noise(y: &[f64]) {
///         let scale ~ HalfNormal(1.0);
///         for y in y {
///             y ~ Laplace(scale);
///         }
///     }
/// }
/// ppl::check::gradient(&noise(&[0.3, -1.2, 0.4]), 1);
/// ```
pub trait Density<R: Scalar>: Family {
    /// Type of the domain, which determines the type of the values.
    type Domain: Domain<R>;

    /// Domain of the values. The density is 0 outside the domain.
    fn domain(&self) -> Self::Domain;

    /// Log density (log probability for counts) at `x` inside the domain, including the normalising constant if it
    /// depends on unknown parameters. NaN for invalid parameters.
    fn ln_density(&self, x: &ValueOf<R, Self>) -> R;

    /// Draws from the distribution; the value has no derivatives.
    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> ValueOf<R, Self>;

    /// Checks that the parameters are valid. By default, all parameters are valid.
    ///
    /// # Errors
    /// [`DomainError`] with distribution, parameter, requirement and value.
    fn validate(&self) -> Result<(), DomainError> {
        Ok(())
    }
}

/// Type of the values of a user-defined distribution.
pub type ValueOf<R, D> = <<D as Density<R>>::Domain as Domain<R>>::Value;

/// Adds the log density at `x` to `terms`; −∞ outside the domain.
#[inline(always)]
pub fn add_density<R: Scalar, D: Density<R>>(
    distribution: &D,
    x: &ValueOf<R, D>,
    terms: &mut impl Accumulator<R>,
) {
    terms.add_number(match distribution.domain().includes(x) {
        true => distribution.ln_density(x),
        false => R::from(f64::NEG_INFINITY),
    });
}

/// Maps the next coordinates to a value. Adds its log density to `terms`, and the log-Jacobian if `jacobian` is true.
#[inline(always)]
pub fn constrain_density<R, D>(
    distribution: &D,
    next: &mut impl FnMut() -> R,
    jacobian: bool,
    terms: &mut impl Accumulator<R>,
) -> ValueOf<R, D>
where
    R: Scalar,
    D: Density<R, Domain: SmoothDomain<R>>,
{
    let (x, log_jacobian) = distribution.domain().value_at(next);
    terms.add_number(distribution.ln_density(&x));
    if jacobian {
        terms.add_number(log_jacobian);
    }
    x
}

/// Implements [`Distribution`](crate::Distribution) and [`Unknown`](crate::Unknown) for a user-defined
/// [`Density`](crate::Density): `ppl::density!([M: Parameter] Laplace<M>);`. The brackets contain the generic
/// parameters of the type.
#[macro_export]
macro_rules! density {
    ([$($generics:tt)*] $Name:ty) => {
        $crate::density!(@distribution [$($generics)*] $Name, |own| {
            $crate::Density::<R>::validate(own)
        });
    };
    (@distribution [$($generics:tt)*] $Name:ty, |$own:ident| $validate:block) => {
        impl<$($generics)*> $crate::Family for $Name {}

        impl<R: $crate::Scalar, $($generics)*> $crate::Distribution<R> for $Name
        where
            Self: $crate::Density<R>,
        {
            type Value = <<Self as $crate::Density<R>>::Domain as $crate::transform::Domain<R>>::Value;

            #[inline(always)]
            fn add_terms(&self, x: &Self::Value, terms: &mut impl $crate::Accumulator<R>) {
                $crate::__private::add_density(self, x, terms);
            }

            fn validate(&self) -> Result<(), $crate::DomainError> {
                let $own = self;
                $validate
            }

            fn draw<G: $crate::rand::Rng + ?Sized>(&self, rng: &mut G) -> Self::Value {
                $crate::Density::<R>::draw(self, rng)
            }
        }

        impl<R: $crate::Scalar, $($generics)*> $crate::Unknown<R> for $Name
        where
            Self: $crate::Density<R, Domain: $crate::transform::SmoothDomain<R>>,
        {
            fn dim(&self) -> usize {
                $crate::transform::SmoothDomain::<R>::dim(&$crate::Density::<R>::domain(self))
            }

            #[inline(always)]
            fn constrain(
                &self,
                next: &mut impl FnMut() -> R,
                jacobian: bool,
                terms: &mut impl $crate::Accumulator<R>,
            ) -> Self::Value {
                $crate::__private::constrain_density(self, next, jacobian, terms)
            }

            fn unconstrain(&self, x: &Self::Value, out: &mut Vec<f64>) {
                $crate::transform::SmoothDomain::<R>::coordinates_of(
                    &$crate::Density::<R>::domain(self), x, out,
                );
            }

            fn bounds(&self) -> Option<(f64, f64)> {
                $crate::transform::SmoothDomain::<R>::ends(&$crate::Density::<R>::domain(self))
            }
        }
    };
}
