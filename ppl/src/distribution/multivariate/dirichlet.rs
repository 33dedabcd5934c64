//! The Dirichlet distribution.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::{Distribution, Unknown};
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::special::{digamma, ln_gamma};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;
use crate::transform::{Domain, Simplex, SmoothDomain};

/// Dirichlet distribution of K shares whose sum is 1, with concentrations α₁, …, α_K.
///
/// ln p(x) = Σₖ (αₖ − 1) ln xₖ + ln Γ(Σ αₖ) − Σ ln Γ(αₖ), for xₖ > 0 and Σ xₖ = 1, as a density of the first K − 1 shares.
///
/// [`Simplex`] documents the unconstrained coordinates.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let shares = Dirichlet([2.0, 3.0, 5.0]);
/// let density: f64 = shares.ln_density(&[0.2, 0.3, 0.5]);
/// let product = 7560.0 * 0.2 * 0.3f64.powi(2) * 0.5f64.powi(4);
/// assert!((density - f64::ln(product)).abs() < 1e-13);
///
/// ppl::model! {
///     fn mixture(y: &[f64]) {
///         let shares ~ Dirichlet([1.0, 1.0, 1.0]);
///         for y in y {
///             y ~ Mixture(shares, [Normal(-4.0, 1.0), Normal(0.0, 1.0), Normal(4.0, 1.0)]);
///         }
///     }
/// }
/// assert_eq!(mixture(&[0.1, 3.8]).layout()?.dim, 2);
/// # Ok::<(), ppl::ModelError>(())
/// ```
///
/// # References
/// Kotz, Balakrishnan & Johnson (2000), *Continuous Multivariate Distributions*, vol. 1, ch. 49.
#[derive(Clone, Copy, Debug)]
pub struct Dirichlet<A, const K: usize>(pub [A; K]);

impl<A: Clone, const K: usize> Family for Dirichlet<A, K> {}

impl<A: Parameter, const K: usize> Dirichlet<A, K> {
    /// Expectations αₖ/Σα.
    pub fn mean(&self) -> [f64; K] {
        let sum = self.sum();
        self.0.map(|alpha| alpha.number() / sum)
    }

    fn sum(&self) -> f64 {
        self.0.iter().map(|alpha| alpha.number()).sum()
    }

    /// The constant ln Γ(Σα) − Σ ln Γ(αₖ).
    fn constant<R: Scalar>(&self) -> R
    where
        A: Datum<R>,
    {
        let sum = self.sum();
        let values = self.0.map(|alpha| alpha.number());
        let value = ln_gamma(sum) - values.iter().map(|alpha| ln_gamma(*alpha)).sum::<f64>();
        let of_sum = digamma(sum);
        R::fuse(value, self.0.map(|alpha| alpha.lift()), values.map(|a| of_sum - digamma(a)))
    }

    /// Log density from the logarithms of the shares.
    fn of_logarithms<R: Scalar>(&self, ln_shares: [R; K]) -> R
    where
        A: Datum<R>,
    {
        let mut total = self.constant::<R>();
        for (alpha, ln_share) in self.0.iter().zip(ln_shares) {
            let alpha: R = alpha.lift();
            // a share of 0 has an infinite logarithm, which α = 1 does not use
            if alpha.value() != 1.0 || !alpha.is_constant() {
                total += (alpha - 1.0) * ln_share;
            }
        }
        total
    }
}

impl<R: Scalar, A: Parameter + Datum<R>, const K: usize> Distribution<R> for Dirichlet<A, K> {
    type Value = [R; K];

    fn add_terms(&self, x: &[R; K], terms: &mut impl Accumulator<R>) {
        terms.add_number(match Simplex::<K>.includes(x) {
            true => self.of_logarithms(x.map(Scalar::ln)),
            false => R::from(f64::NEG_INFINITY),
        });
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require(K > 0, "Dirichlet", "number of shares", "at least 1", K as f64)?;
        for (k, alpha) in self.0.iter().enumerate() {
            let name = format_args!("concentration {k}");
            DomainError::require_positive("Dirichlet", name, alpha.number())?;
        }
        Ok(())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> [R; K] {
        // a gamma draw with shape α equals a gamma draw with shape α + 1 times u^{1/α}, for u uniform on (0, 1); the
        // logarithm of the product does not underflow
        let logarithms = self.0.map(|alpha| {
            let alpha = alpha.number();
            let larger: f64 = rand_distr::Gamma::new(alpha + 1.0, 1.0)
                .map_or(f64::NAN, |gamma| rng.sample(gamma));
            larger.ln() + rng.random::<f64>().ln() / alpha
        });
        let largest = logarithms.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let sum: f64 = logarithms.iter().map(|ln| (ln - largest).exp()).sum();
        logarithms.map(|ln| {
            let share = (ln - largest).exp() / sum;
            // not `f64::max`, which would replace NaN by the smallest number
            R::from(if share < f64::MIN_POSITIVE { f64::MIN_POSITIVE } else { share })
        })
    }
}

impl<R: Scalar, A: Parameter + Datum<R>, const K: usize> Unknown<R> for Dirichlet<A, K> {
    fn dim(&self) -> usize {
        SmoothDomain::<R>::dim(&Simplex::<K>)
    }

    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Accumulator<R>,
    ) -> [R; K] {
        let (ln_shares, log_jacobian) = Simplex::<K>::ln_shares(next);
        terms.add_number(self.of_logarithms(ln_shares));
        if jacobian {
            terms.add_number(log_jacobian);
        }
        ln_shares.map(Scalar::exp)
    }

    fn unconstrain(&self, x: &[R; K], out: &mut Vec<f64>) {
        Simplex::<K>.coordinates_of(x, out);
    }
}
