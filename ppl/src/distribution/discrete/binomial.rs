//! The binomial distribution, by probability and by logit.

use rand::Rng;

use super::count_parameter::CountParameter;
use crate::accumulator::{Accumulator, Joined};
use crate::datum::Datum;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::Distribution;
use crate::parameter::Parameter;
use crate::scalar::Scalar;
use crate::special::{HALF_LN_2PI, deviance, logistic, stirling_error};

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

impl<N: CountParameter, P: Parameter> Family for Binomial<N, P> {}
impl<N: CountParameter, X: Parameter> Family for BinomialLogit<N, X> {}

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

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        rand_distr::Binomial::new(self.n, self.p).map_or(0, |binomial| rng.sample(binomial))
    }

    fn mean(&self) -> f64 {
        self.n as f64 * self.p
    }

    fn variance(&self) -> f64 {
        self.mean() * self.q
    }
}

impl<N: CountParameter, P: Parameter> Binomial<N, P> {
    fn trials(&self) -> Trials {
        let p = self.1.number();
        Trials { n: self.0.count(), p, q: 1.0 - p }
    }

    /// Expectation n p.
    pub fn mean(&self) -> f64 {
        self.trials().mean()
    }

    /// Variance n p (1 − p).
    pub fn variance(&self) -> f64 {
        self.trials().variance()
    }
}

impl<N: CountParameter, X: Parameter> BinomialLogit<N, X> {
    fn trials(&self) -> Trials {
        let (p, q) = logistic(self.1.number());
        Trials { n: self.0.count(), p, q }
    }

    /// Expectation n p.
    pub fn mean(&self) -> f64 {
        self.trials().mean()
    }

    /// Variance n p (1 − p).
    pub fn variance(&self) -> f64 {
        self.trials().variance()
    }
}

impl<R, N, P> Distribution<R> for Binomial<N, P>
where
    R: Scalar,
    N: CountParameter,
    P: Parameter + Datum<R>,
{
    type Value = u64;

    #[inline]
    fn ln_density(&self, k: &u64) -> R {
        Joined::of(|terms| self.add_terms(k, terms))
    }

    #[inline(always)]
    fn add_terms(&self, k: &u64, terms: &mut impl Accumulator<R>) {
        let Trials { n, p, q } = self.trials();
        let (success, failure) = (*k as f64, n as f64 - *k as f64);
        // at the ends terms vanish, and outside there is no density
        let inside = p > 0.0 && q > 0.0 && *k <= n;
        if inside && terms.leave_out_constants() {
            // without the binomial coefficient, which is the same at every point
            let value = success * p.ln() + failure * q.ln();
            return terms.add(value, ((self.1, success / p - failure / q),));
        }
        // no 0/0 at the ends
        let gain = if success == 0.0 { 0.0 } else { success / p };
        let loss = if failure <= 0.0 { 0.0 } else { failure / q };
        terms.add(self.trials().ln_pmf(*k), ((self.1, gain - loss),));
    }

    fn validate(&self) -> Result<(), DomainError> {
        let p = self.1.number();
        let holds = (0.0..=1.0).contains(&p);
        DomainError::require(holds, "Binomial", "probability", "within 0 and 1", p)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        self.trials().draw(rng)
    }
}

impl<R, N, X> Distribution<R> for BinomialLogit<N, X>
where
    R: Scalar,
    N: CountParameter,
    X: Parameter + Datum<R>,
{
    type Value = u64;

    #[inline]
    fn ln_density(&self, k: &u64) -> R {
        Joined::of(|terms| self.add_terms(k, terms))
    }

    #[inline(always)]
    fn add_terms(&self, k: &u64, terms: &mut impl Accumulator<R>) {
        let (logit, n) = (self.1.number(), self.0.count());
        if *k > n {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        let (success, failure) = (*k as f64, (n - *k) as f64);
        let (p, q) = logistic(logit);
        let value = if terms.leave_out_constants() {
            // without the binomial coefficient, which is the same at every point; ln p and ln q from
            // the nearer end, ln(1 + e^{−|x|}) below it, to 10⁻¹⁶
            let away = if logit > 0.0 { failure } else { success } * logit.abs();
            -(n as f64) * (1.0 + (-logit.abs()).exp()).ln() - away
        } else {
            Trials { n, p, q }.ln_pmf(*k)
        };
        // k − n p, without cancellation in either tail
        terms.add(value, ((self.1, success * q - failure * p),));
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("BinomialLogit", "logit", self.1.number())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> u64 {
        self.trials().draw(rng)
    }
}
