//! The beta-binomial distribution.

use rand::Rng;

use super::count_mass::{ln_mass_of_all, ln_mass_without};
use super::{Beta, Binomial, Count, CountMass, CountParameter, Parameter, Univariate, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::{digamma_rise, ln_beta};
use crate::terms::{Joined, Terms};

/// Beta-binomial distribution of the successes among n trials whose common probability is
/// Beta(α, β); it can be observed, not declared.
///
/// ln P(k) = ln C(n, k) + ln B(k + α, n − k + β) − ln B(α, β), for k = 0, …, n and α, β > 0.
/// Distribution functions are sums of at most n terms.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// // a uniform probability makes every count equally likely
/// let ln_mass: f64 = BetaBinomial(4u64, 1.0, 1.0).ln_density(&2);
/// assert!((ln_mass + 5f64.ln()).abs() < 1e-14);
/// ```
///
/// # References
/// Johnson, Kemp & Kotz (2005), *Univariate Discrete Distributions*, section 6.2.2.
#[derive(Clone, Copy, Debug)]
pub struct BetaBinomial<N, A, B>(pub N, pub A, pub B);

crate::count!([N: CountParameter, A: Parameter, B: Parameter] BetaBinomial<N, A, B>);

impl<N: CountParameter, A: Parameter, B: Parameter> BetaBinomial<N, A, B> {
    fn parameters(&self) -> (f64, f64, f64) {
        (self.0.count() as f64, self.1.number(), self.2.number())
    }

    fn ln_mass_at(&self, k: f64) -> f64 {
        let (n, a, b) = self.parameters();
        if k > n {
            return f64::NEG_INFINITY;
        }
        if !(a > 0.0 && b > 0.0) {
            return f64::NAN;
        }
        ln_beta(k + a, n - k + b) - ln_beta(a, b) - ln_beta(k + 1.0, n - k + 1.0) - n.ln_1p()
    }

    /// P(K ≤ k), or P(K > k), from the term at its inner end and the ratios of neighbours.
    fn tail(&self, k: u64, upper: bool) -> f64 {
        let (n, a, b) = self.parameters();
        // p(j + 1)/p(j)
        let ratio = |j: f64| (n - j) * (j + a) / ((j + 1.0) * (n - j - 1.0 + b));
        let (start, count) = if upper { (k + 1, self.0.count() - k) } else { (k, k + 1) };
        let mut term = self.ln_mass_at(start as f64).exp();
        let mut total = 0.0;
        let mut j = start as f64;
        for _ in 0..count {
            total += term;
            if upper {
                term *= ratio(j);
                j += 1.0;
            } else {
                j -= 1.0;
                term /= ratio(j);
            }
        }
        total.min(1.0)
    }
}

impl<N: CountParameter, A: Parameter, B: Parameter> Count for BetaBinomial<N, A, B> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("BetaBinomial", "first shape", self.1.number())?;
        DomainError::require_positive("BetaBinomial", "second shape", self.2.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        let p = Univariate::sample(&Beta(self.1, self.2), rng);
        Count::sample(&Binomial(self.0, p), rng)
    }

    fn mean(&self) -> f64 {
        let (n, a, b) = self.parameters();
        n * a / (a + b)
    }

    fn variance(&self) -> f64 {
        let (n, a, b) = self.parameters();
        let s = a + b;
        n * (a / s) * (b / s) * (s + n) / (s + 1.0)
    }

    fn cdf(&self, k: u64) -> f64 {
        if k >= self.0.count() { 1.0 } else { self.tail(k, false) }
    }

    fn sf(&self, k: u64) -> f64 {
        if k >= self.0.count() { 0.0 } else { self.tail(k, true) }
    }
}

impl<R, N, A, B> CountMass<R> for BetaBinomial<N, A, B>
where
    R: Scalar,
    N: CountParameter,
    A: Parameter + Datum<R>,
    B: Parameter + Datum<R>,
{
    #[inline]
    fn ln_pmf(&self, k: u64) -> R {
        Joined::of(|terms| self.add_ln_pmf(k, terms))
    }

    #[inline(always)]
    fn add_ln_pmf(&self, k: u64, terms: &mut impl Terms<R>) {
        let value = self.ln_mass_at(k as f64);
        let unknowns = [lift::<R>(self.1), lift(self.2)];
        if value == f64::NEG_INFINITY || unknowns.iter().all(|x| x.is_constant()) {
            return terms.add_number(R::from(value));
        }
        let (k, (n, a, b)) = (k as f64, self.parameters());
        let both = digamma_rise(a + b, n);
        let (in_a, in_b) = (digamma_rise(a, k) - both, digamma_rise(b, n - k) - both);
        terms.add(value, ((self.1, in_a), (self.2, in_b)));
    }

    /// One minus the few counts that are cut off, and else all terms: there may be a mode at either
    /// end.
    fn ln_mass(&self, first: u64, last: u64) -> R {
        let n = self.0.count();
        let last = last.min(n);
        if first > last {
            return R::from(f64::NEG_INFINITY);
        }
        // of ln P at a mode only the absolute error is small
        ln_mass_without(self, (0..first).chain(last.saturating_add(1)..n.saturating_add(1)))
            .filter(|mass: &R| mass.value() > -5.0)
            .unwrap_or_else(|| ln_mass_of_all(self, first, last))
    }
}
