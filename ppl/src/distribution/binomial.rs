//! The binomial distribution, by probability and by logit.

use rand::Rng;

use super::count_mass::{ln_inside, ln_mass_by_sum};
use super::{Count, CountMass, CountParameter, Parameter, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::{Scalar, logistic};
use crate::special::{HALF_LN_2PI, deviance, regularised_beta, stirling_error};
use crate::terms::Terms;

/// Binomial distribution of the successes among n trials with probability p each; it can be
/// observed, not declared.
///
/// ln P(k) = ln C(n, k) + k ln p + (n − k) ln(1 − p), for k = 0, …, n and 0 ≤ p ≤ 1.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_mass: f64 = Binomial(3u64, 0.5).ln_density(&1);
/// assert!((ln_mass - 0.375f64.ln()).abs() < 1e-15);
/// ```
///
/// # References
/// Johnson, Kemp & Kotz (2005), *Univariate Discrete Distributions*, ch. 3; Loader (2000), *Fast
/// and Accurate Computation of Binomial Probabilities*.
#[derive(Clone, Copy, Debug)]
pub struct Binomial<N, P>(pub N, pub P);

/// Binomial distribution by the logit x of its probability 1/(1 + e⁻ˣ), for logistic regression;
/// it can be observed, not declared.
///
/// ln P(k) = ln C(n, k) − k ln(1 + e⁻ˣ) − (n − k) ln(1 + eˣ), for k = 0, …, n and real x.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_mass: f64 = BinomialLogit(3u64, 0.0).ln_density(&1);
/// assert!((ln_mass - 0.375f64.ln()).abs() < 1e-15);
/// ```
///
/// # References
/// McCullagh & Nelder (1989), *Generalized Linear Models*, 2nd ed., ch. 4.
#[derive(Clone, Copy, Debug)]
pub struct BinomialLogit<N, X>(pub N, pub X);

crate::count!([N: CountParameter, P: Parameter] Binomial<N, P>);
crate::count!([N: CountParameter, X: Parameter] BinomialLogit<N, X>);

/// ln [Γ(n + 1)/(Γ(x + 1) Γ(n − x + 1)) pˣ qⁿ⁻ˣ] for real 0 ≤ x ≤ n and q = 1 − p.
#[inline]
pub(super) fn ln_binomial(x: f64, n: f64, p: f64, q: f64) -> f64 {
    let rest = n - x;
    if rest < 0.0 {
        f64::NEG_INFINITY
    } else if n == 0.0 {
        0.0
    } else if x == 0.0 {
        n * if p < 0.5 { (-p).ln_1p() } else { q.ln() }
    } else if rest == 0.0 {
        n * if q < 0.5 { (-q).ln_1p() } else { p.ln() }
    } else {
        let stirling = stirling_error(n) - stirling_error(x) - stirling_error(rest);
        let spread = 0.5 * (n / (x * rest)).ln() - HALF_LN_2PI;
        stirling + spread - deviance(x, n * p) - deviance(rest, n * q)
    }
}

/// What both parametrisations share: n, p and q = 1 − p as numbers.
#[derive(Clone, Copy)]
struct Trials {
    n: u64,
    p: f64,
    q: f64,
}

impl Trials {
    fn ln_pmf(&self, k: u64) -> f64 {
        if !(self.p >= 0.0 && self.q >= 0.0) {
            return f64::NAN;
        }
        ln_binomial(k as f64, self.n as f64, self.p, self.q)
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        rand_distr::Binomial::new(self.n, self.p).map_or(0, |binomial| rng.sample(binomial))
    }

    fn mean(&self) -> f64 {
        self.n as f64 * self.p
    }

    fn variance(&self) -> f64 {
        self.mean() * self.q
    }

    /// P(K > k) and P(K ≤ k).
    fn tails(&self, k: u64) -> (f64, f64) {
        if k >= self.n {
            return (0.0, 1.0);
        }
        regularised_beta(k as f64 + 1.0, (self.n - k) as f64, self.p, self.q)
    }

    /// ∂ ln P(first ≤ K ≤ last)/∂p · q, from ∂P(K ≤ k)/∂p = −p(k) (n − k)/q.
    fn in_p(&self, ln_mass: f64, first: u64, last: u64) -> f64 {
        let at = |k: u64| {
            let rest = self.n.saturating_sub(k) as f64;
            if rest == 0.0 { 0.0 } else { (self.ln_pmf(k) - ln_mass).exp() * rest }
        };
        first.checked_sub(1).map_or(0.0, at) - at(last)
    }
}

impl<N: CountParameter, P: Parameter> Binomial<N, P> {
    fn trials(&self) -> Trials {
        let p = self.1.number();
        Trials { n: self.0.count(), p, q: 1.0 - p }
    }
}

impl<N: CountParameter, X: Parameter> BinomialLogit<N, X> {
    fn trials(&self) -> Trials {
        let (p, q) = logistic(self.1.number());
        Trials { n: self.0.count(), p, q }
    }
}

impl<N: CountParameter, P: Parameter> Count for Binomial<N, P> {
    fn validate(&self) -> Result<(), DomainError> {
        let p = self.1.number();
        let holds = (0.0..=1.0).contains(&p);
        DomainError::require(holds, "Binomial", "probability", "within 0 and 1", p)
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        self.trials().sample(rng)
    }

    fn mean(&self) -> f64 {
        self.trials().mean()
    }

    fn variance(&self) -> f64 {
        self.trials().variance()
    }

    fn cdf(&self, k: u64) -> f64 {
        self.trials().tails(k).1
    }

    fn sf(&self, k: u64) -> f64 {
        self.trials().tails(k).0
    }
}

impl<R, N, P> CountMass<R> for Binomial<N, P>
where
    R: Scalar,
    N: CountParameter,
    P: Parameter + Datum<R>,
{
    #[inline]
    fn ln_pmf(&self, k: u64) -> R {
        let trials = self.trials();
        let (success, failure) = (k as f64, trials.n as f64 - k as f64);
        // no 0/0 at the ends
        let gain = if success == 0.0 { 0.0 } else { success / trials.p };
        let loss = if failure <= 0.0 { 0.0 } else { failure / trials.q };
        R::fuse(trials.ln_pmf(k), [lift(self.1)], [gain - loss])
    }

    #[inline(always)]
    fn add_ln_pmf(&self, k: u64, terms: &mut impl Terms<R>) {
        let (p, n) = (self.1.number(), self.0.count());
        let q = 1.0 - p;
        // at the ends terms vanish, and outside there is no density
        let inside = p > 0.0 && q > 0.0 && k <= n;
        if !(inside && terms.leave_out_constants()) {
            return terms.add_number(self.ln_pmf(k));
        }
        // without the binomial coefficient, which is the same at every point
        let (success, failure) = (k as f64, (n - k) as f64);
        let value = success * p.ln() + failure * q.ln();
        terms.add(value, ((self.1, success / p - failure / q),));
    }

    fn ln_mass(&self, first: u64, last: u64) -> R {
        let trials = self.trials();
        match ln_inside(self, first, last) {
            Some(value) => {
                R::fuse(value, [lift(self.1)], [trials.in_p(value, first, last) / trials.q])
            }
            None => ln_mass_by_sum(self, first, last),
        }
    }
}

impl<N: CountParameter, X: Parameter> Count for BinomialLogit<N, X> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("BinomialLogit", "logit", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        self.trials().sample(rng)
    }

    fn mean(&self) -> f64 {
        self.trials().mean()
    }

    fn variance(&self) -> f64 {
        self.trials().variance()
    }

    fn cdf(&self, k: u64) -> f64 {
        self.trials().tails(k).1
    }

    fn sf(&self, k: u64) -> f64 {
        self.trials().tails(k).0
    }
}

impl<R, N, X> CountMass<R> for BinomialLogit<N, X>
where
    R: Scalar,
    N: CountParameter,
    X: Parameter + Datum<R>,
{
    #[inline]
    fn ln_pmf(&self, k: u64) -> R {
        let trials = self.trials();
        let failure = trials.n as f64 - k as f64;
        // k − n p, without cancellation in either tail
        let in_logit = k as f64 * trials.q - failure * trials.p;
        R::fuse(trials.ln_pmf(k), [lift(self.1)], [if failure < 0.0 { 0.0 } else { in_logit }])
    }

    #[inline(always)]
    fn add_ln_pmf(&self, k: u64, terms: &mut impl Terms<R>) {
        let (logit, n) = (self.1.number(), self.0.count());
        if !terms.leave_out_constants() || k > n {
            return terms.add_number(self.ln_pmf(k));
        }
        // without the binomial coefficient, which is the same at every point; ln p and ln q from the
        // nearer end, ln(1 + e^{−|x|}) below it, to 10⁻¹⁶
        let (success, failure) = (k as f64, (n - k) as f64);
        let (p, q) = logistic(logit);
        let away = if logit > 0.0 { failure } else { success } * logit.abs();
        let value = -(n as f64) * (1.0 + (-logit.abs()).exp()).ln() - away;
        terms.add(value, ((self.1, success * q - failure * p),));
    }

    fn ln_mass(&self, first: u64, last: u64) -> R {
        let trials = self.trials();
        match ln_inside(self, first, last) {
            Some(value) => {
                R::fuse(value, [lift(self.1)], [trials.in_p(value, first, last) * trials.p])
            }
            None => ln_mass_by_sum(self, first, last),
        }
    }
}
