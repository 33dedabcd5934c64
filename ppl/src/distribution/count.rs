//! Distributions of one count.

use rand::Rng;

use super::count_mass::{ln_mass_by_sum, masses};
use super::{Family, Truncated};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::terms::Terms;

/// A parameter that is a count: `u64`, `u32`, `usize` or a reference to one.
pub trait CountParameter: Copy {
    /// Its value.
    fn count(self) -> u64;
}

impl<T: Copy + Datum<u64>> CountParameter for T {
    #[inline]
    fn count(self) -> u64 {
        self.lift()
    }
}

/// A distribution of one count: what needs the values of its parameters only.
pub trait Count: Family {
    /// Whether the parameters lie in their domain.
    ///
    /// # Errors
    /// [`DomainError`] naming distribution, parameter, requirement and value.
    fn validate(&self) -> Result<(), DomainError>;

    /// An exact draw; 0 for parameters outside their domain.
    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> u64;

    /// Expectation.
    fn mean(&self) -> f64;

    /// Variance.
    fn variance(&self) -> f64;

    /// P(K ≤ k), accurate in the lower tail: a plain number, which has lost its derivatives in
    /// unknown parameters ([`ln_cdf`](CountMass::ln_cdf) has them).
    fn cdf(&self, k: u64) -> f64;

    /// P(K > k), accurate in the upper tail: a plain number, which has lost its derivatives in
    /// unknown parameters ([`ln_sf`](CountMass::ln_sf) has them).
    fn sf(&self, k: u64) -> f64;

    /// The smallest k with P(K ≤ k) ≥ p.
    fn quantile(&self, p: f64) -> u64 {
        smallest(|k| self.cdf(k) >= p)
    }

    /// The smallest k with P(K > k) ≤ q, for small q.
    fn upper_quantile(&self, q: f64) -> u64 {
        smallest(|k| self.sf(k) <= q)
    }

    /// An exact draw of K given that it is one of `first..=last`, by inversion.
    fn sample_within<G: Rng + ?Sized>(&self, first: u64, last: u64, rng: &mut G) -> u64 {
        let (below, inside, above) = masses(self, first, last);
        let u: f64 = rng.random();
        let p = below + u * inside;
        let k = if p < 0.5 {
            self.quantile(p)
        } else {
            self.upper_quantile(above + (1.0 - u) * inside)
        };
        // `max` then `min`: `clamp` would panic where there is no count inside
        k.max(first).min(last)
    }
}

/// The mass function of a [`Count`] over any [`Scalar`].
///
/// Implementing it (and [`count!`](crate::count)) makes a distribution of counts usable in
/// models, in all variations; [`Poisson`](super::Poisson) shows how.
pub trait CountMass<R: Scalar>: Count {
    /// ln P(K = k), as one fused operation with exact partials; −∞ outside the support.
    fn ln_pmf(&self, k: u64) -> R;

    /// See [`Distribution::add_terms`](crate::Distribution::add_terms).
    #[doc(hidden)]
    #[inline(always)]
    fn add_ln_pmf(&self, k: u64, terms: &mut impl Terms<R>) {
        terms.add_number(self.ln_pmf(k));
    }

    /// See [`Distribution::POOLS`](crate::Distribution::POOLS).
    #[doc(hidden)]
    const POOLS: bool = false;

    /// See [`Distribution::sum_up`](crate::Distribution::sum_up).
    #[doc(hidden)]
    fn sum_up(data: impl Iterator<Item = u64>, sums: &mut Vec<f64>) {
        let _ = (data, sums);
    }

    /// See [`Distribution::add_pooled_terms`](crate::Distribution::add_pooled_terms).
    #[doc(hidden)]
    fn add_pooled_terms(&self, sums: &[f64], terms: &mut impl Terms<R>) {
        let _ = sums;
        terms.add_number(R::from(f64::NAN));
    }

    /// ln P(first ≤ K ≤ last), with its derivatives in the parameters; [`u64::MAX`] is no last.
    ///
    /// One minus the few counts that a lower end cuts off, and else summed outwards from the mean,
    /// unless overridden: the latter suits one mode and costs some twenty standard deviations of
    /// terms.
    fn ln_mass(&self, first: u64, last: u64) -> R {
        ln_mass_by_sum(self, first, last)
    }

    /// ln P(K ≤ k), with its derivatives in the parameters.
    fn ln_cdf(&self, k: u64) -> R {
        self.ln_mass(0, k)
    }

    /// ln P(K > k), with its derivatives in the parameters.
    fn ln_sf(&self, k: u64) -> R {
        match k.checked_add(1) {
            Some(next) => self.ln_mass(next, u64::MAX),
            None => R::from(f64::NEG_INFINITY),
        }
    }
}

/// Makes a [`CountMass`] a [`Distribution`](crate::Distribution):
/// `ppl::count!([L: Parameter] Poisson<L>);`.
#[macro_export]
macro_rules! count {
    ([$($P:ident: $Bound:path),*] $Name:ty) => {
        impl<$($P: $Bound),*> $crate::Family for $Name {}

        impl<R: $crate::Scalar, $($P: $Bound),*> $crate::Distribution<R> for $Name
        where
            Self: $crate::CountMass<R>,
        {
            type Value = u64;

            #[inline]
            fn ln_density(&self, k: &u64) -> R {
                $crate::CountMass::ln_pmf(self, *k)
            }

            #[inline(always)]
            fn add_terms(&self, k: &u64, terms: &mut impl $crate::Terms<R>) {
                $crate::CountMass::add_ln_pmf(self, *k, terms);
            }

            const POOLS: bool = <Self as $crate::CountMass<R>>::POOLS;

            fn sum_up(data: impl Iterator<Item = u64>, sums: &mut Vec<f64>) {
                <Self as $crate::CountMass<R>>::sum_up(data, sums);
            }

            #[inline(always)]
            fn add_pooled_terms(&self, sums: &[f64], terms: &mut impl $crate::Terms<R>) {
                $crate::CountMass::add_pooled_terms(self, sums, terms);
            }

            fn validate(&self) -> Result<(), $crate::DomainError> {
                $crate::Count::validate(self)
            }

            fn draw<G: $crate::rand::Rng + ?Sized>(&self, rng: &mut G) -> u64 {
                $crate::Count::sample(self, rng)
            }
        }

        impl<R: $crate::Scalar, $($P: $Bound),*> $crate::Numeric<R> for $Name
        where
            Self: $crate::CountMass<R>,
        {
            #[inline]
            fn ln_probability(&self, interval: $crate::Interval) -> R {
                let (first, last) = interval.counts();
                $crate::CountMass::ln_mass(self, first, last)
            }

            fn draw_within<G>(&self, interval: $crate::Interval, rng: &mut G) -> u64
            where
                G: $crate::rand::Rng + ?Sized,
            {
                let (first, last) = interval.counts();
                $crate::Count::sample_within(self, first, last, rng)
            }

            #[inline]
            fn number(k: &u64) -> f64 {
                *k as f64
            }

            #[inline]
            fn is_within(k: &u64, interval: &$crate::Interval) -> bool {
                let (first, last) = interval.counts();
                (first..=last).contains(k)
            }

            fn clamp(k: u64, interval: &$crate::Interval) -> u64 {
                // `as` saturates at the ends of the counts
                k.max(interval.lower().floor() as u64).min(interval.upper().ceil() as u64)
            }
        }
    };
}

/// The smallest k where an increasing condition holds.
fn smallest(holds: impl Fn(u64) -> bool) -> u64 {
    if holds(0) {
        return 0;
    }
    let (mut low, mut high) = (0, 1u64);
    while !holds(high) {
        if high == u64::MAX {
            return high;
        }
        (low, high) = (high, high.saturating_mul(2));
    }
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if holds(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

impl<D: Count> Truncated<D> {
    /// Mean and variance, from sums of P(K > k).
    fn moments(&self) -> (f64, f64) {
        let start = Count::quantile(self, 1e-18);
        let (mut first, mut second) = (0.0, 0.0);
        for (j, k) in (start..).enumerate() {
            let beyond = Count::sf(self, k);
            let weight = 2.0 * j as f64 + 1.0;
            first += beyond;
            second += weight * beyond;
            if weight * beyond <= 1e-18 * second {
                break;
            }
        }
        (start as f64 + first, second - first * first)
    }
}

impl<D: Count> Count for Truncated<D> {
    fn validate(&self) -> Result<(), DomainError> {
        self.inner.validate()?;
        self.interval.validate("truncate")?;
        let (first, last) = self.interval.counts();
        let inside = if first > last { 0.0 } else { masses(&self.inner, first, last).1 };
        DomainError::require(inside > 0.0, "truncate", "mass inside", "positive", inside)
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        let (first, last) = self.interval.counts();
        self.inner.sample_within(first, last, rng)
    }

    fn mean(&self) -> f64 {
        self.moments().0
    }

    fn variance(&self) -> f64 {
        self.moments().1
    }

    fn cdf(&self, k: u64) -> f64 {
        let (first, last) = self.interval.counts();
        if k < first {
            return 0.0;
        }
        masses(&self.inner, first, k.min(last)).1 / masses(&self.inner, first, last).1
    }

    fn sf(&self, k: u64) -> f64 {
        let (first, last) = self.interval.counts();
        if k >= last {
            return 0.0;
        }
        masses(&self.inner, first.max(k + 1), last).1 / masses(&self.inner, first, last).1
    }
}

impl<R: Scalar, D: CountMass<R>> CountMass<R> for Truncated<D> {
    fn ln_pmf(&self, k: u64) -> R {
        let (first, last) = self.interval.counts();
        if (first..=last).contains(&k) {
            self.inner.ln_pmf(k) - self.inner.ln_mass(first, last)
        } else {
            R::from(f64::NEG_INFINITY)
        }
    }

    #[inline(always)]
    fn add_ln_pmf(&self, k: u64, terms: &mut impl Terms<R>) {
        let (first, last) = self.interval.counts();
        if !(first..=last).contains(&k) {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        self.inner.add_ln_pmf(k, terms);
        terms.add_number(-self.inner.ln_mass(first, last));
    }

    fn ln_mass(&self, first: u64, last: u64) -> R {
        let (own_first, own_last) = self.interval.counts();
        self.inner.ln_mass(first.max(own_first), last.min(own_last))
            - self.inner.ln_mass(own_first, own_last)
    }
}
