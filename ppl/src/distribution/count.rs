//! Distributions of one count.

use rand::Rng;

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
    /// Summed outwards from the mean unless overridden, which suits one mode and costs some
    /// twenty standard deviations of terms.
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

/// P(K < first), P(first ≤ K ≤ last) and P(K > last), from the tails that keep digits; [`u64::MAX`]
/// is no last.
pub(super) fn masses<D: Count>(counts: &D, first: u64, last: u64) -> (f64, f64, f64) {
    let before = first.checked_sub(1);
    let below = before.map_or(0.0, |k| counts.cdf(k));
    let above = if last == u64::MAX { 0.0 } else { counts.sf(last) };
    let inside = if below > 0.5 {
        before.map_or(1.0, |k| counts.sf(k)) - above
    } else if above > 0.5 {
        counts.cdf(last) - below
    } else {
        1.0 - below - above
    };
    (below, inside, above)
}

/// ln P(first ≤ K ≤ last) from the distribution function, unless it underflows.
pub(super) fn ln_inside<D: Count>(counts: &D, first: u64, last: u64) -> Option<f64> {
    let (below, inside, above) = masses(counts, first, last);
    let value = if inside > 0.5 { (-(below + above)).ln_1p() } else { inside.ln() };
    (inside > 1e-280).then_some(value)
}

/// A sampler that looks for its step comes to scales where a sum would not end.
const MOST_TERMS: usize = 1_000_000;

/// Sum and derivatives from the terms: ∂ ln P is the expectation of ∂ ln p over the interval; NaN where
/// too many would be needed.
pub(super) fn ln_mass_by_sum<R, D>(counts: &D, first: u64, last: u64) -> R
where
    R: Scalar,
    D: CountMass<R>,
{
    if first > last {
        return R::from(f64::NEG_INFINITY);
    }
    let value = ln_inside(counts, first, last);
    let centre = (counts.mean() as u64).clamp(first, last);
    let reference = counts.ln_pmf(centre);
    let peak = reference.value();
    // parameters that are data leave nothing to sum; a partial may vanish at one count, not at
    // three
    let fixed = [1, 2].iter().all(|&d| counts.ln_pmf(centre.saturating_add(d)).is_constant());
    if let (Some(value), true) = (value, reference.is_constant() && fixed) {
        return R::from(value);
    }
    // without a last count, what the first cuts off has the opposite derivative and fewer terms
    let cut_off = last == u64::MAX && (first as f64) < 20.0 * counts.variance().sqrt();
    if let Some(value) = value.filter(|ln_inside| cut_off && *ln_inside > -10.0) {
        let weighted = (0..first).map(|k| {
            let term = counts.ln_pmf(k);
            (term, -(term.value() - value).exp())
        });
        return R::fuse_iter(value, weighted.filter(|(_, weight)| *weight < 0.0));
    }
    let mut terms = vec![(reference, 1.0)];
    let mut total = 1.0;
    let mut add = |k: u64| {
        let term = counts.ln_pmf(k);
        let weight = (term.value() - peak).exp();
        total += weight;
        terms.push((term, weight));
        weight > 1e-18 * total && terms.len() < MOST_TERMS
    };
    let (mut up, mut down) = (centre, centre);
    while up < last && add(up + 1) {
        up += 1;
    }
    while down > first && add(down - 1) {
        down -= 1;
    }
    if terms.len() >= MOST_TERMS {
        return R::from(f64::NAN);
    }
    terms.retain(|(_, weight)| *weight > 0.0);
    terms.iter_mut().for_each(|(_, weight)| *weight /= total);
    R::fuse_iter(value.unwrap_or(peak + total.ln()), terms)
}

/// ln Σ p(k) over a range whose terms are all needed.
pub(super) fn ln_mass_of_all<R: Scalar, D: CountMass<R>>(counts: &D, first: u64, last: u64) -> R {
    let terms: Vec<R> = (first..=last).map(|k| counts.ln_pmf(k)).collect();
    let peak = terms.iter().fold(f64::NEG_INFINITY, |peak, term| peak.max(term.value()));
    if peak == f64::NEG_INFINITY {
        return R::from(peak);
    }
    let weights = || terms.iter().map(|term| (term.value() - peak).exp());
    let total: f64 = weights().sum();
    let normalised = weights().map(|weight| weight / total);
    R::fuse_iter(peak + total.ln(), terms.iter().copied().zip(normalised))
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

    fn ln_mass(&self, first: u64, last: u64) -> R {
        let (own_first, own_last) = self.interval.counts();
        self.inner.ln_mass(first.max(own_first), last.min(own_last))
            - self.inner.ln_mass(own_first, own_last)
    }
}
