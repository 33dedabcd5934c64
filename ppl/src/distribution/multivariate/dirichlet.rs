//! The Dirichlet distribution.

use rand::Rng;

use crate::accumulator::Accumulator;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::{Distribution, Unknown};
use crate::distribution::vector::{TOLERANCE, Vector};
use crate::scalar::Scalar;
use crate::special::{digamma, ln_gamma};
use crate::transform::{Simplex, VectorMap, ln_simplex};

/// Dirichlet distribution of shares x > 0 with Σ xᵢ = 1, with concentrations αᵢ > 0.
///
/// ln p(x) = ln Γ(Σ αᵢ) − Σ ln Γ(αᵢ) + Σ (αᵢ − 1) ln xᵢ, with respect to all but one of the
/// shares. `Dirichlet([1.0; N])` is uniform on the simplex.
///
/// The concentrations are an array, and so are the shares then, or a slice or `Vec`. The
/// coordinates are those of [`Simplex`]; density times Jacobian has the powers αᵢ, so that small
/// concentrations are no trouble. The log gamma functions leave an error of about
/// ε Σ αᵢ ln Σ αᵢ.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let pair: f64 = Dirichlet([2.0, 3.0]).ln_density(&[0.4, 0.6]);
/// let share: f64 = Beta(2.0, 3.0).ln_density(&0.4);
/// assert!((pair - share).abs() < 1e-14);
/// ```
///
/// # References
/// Kotz, Balakrishnan & Johnson (2000), *Continuous Multivariate Distributions*, vol. 1, ch. 49.
#[derive(Clone, Copy, Debug)]
pub struct Dirichlet<A>(pub A);

impl<A: Clone> Family for Dirichlet<A> {}

impl<A> Dirichlet<A> {
    /// ln Γ(Σ α) − Σ ln Γ(α) + Σ (αᵢ − less) ln xᵢ from terms (xᵢ as it enters, ln xᵢ,
    /// ∂ ln xᵢ/∂xᵢ).
    fn total<R: Scalar>(&self, less: f64, x: impl Fn(usize) -> (R, f64, f64)) -> R
    where
        A: Vector<R>,
    {
        let indices = 0..self.0.size();
        let sum: f64 = indices.clone().map(|i| self.0.at(i).value()).sum();
        let mut value = ln_gamma(sum);
        for i in indices.clone() {
            let (alpha, ln_x) = (self.0.at(i).value(), x(i).1);
            // a flat share may vanish
            let power = if alpha == less { 0.0 } else { (alpha - less) * ln_x };
            value += power - ln_gamma(alpha);
        }
        if !R::DIFFERENTIABLE {
            return R::from(value);
        }
        let constant = indices.clone().all(|i| self.0.at(i).is_constant());
        let psi = if constant { 0.0 } else { digamma(sum) };
        let in_x = indices.clone().map(|i| {
            let ((x, _, slope), alpha) = (x(i), self.0.at(i).value());
            (x, if alpha == less { 0.0 } else { (alpha - less) * slope })
        });
        let in_alpha = indices.filter(|_| !constant).map(|i| {
            let alpha = self.0.at(i);
            (alpha, psi - digamma(alpha.value()) + x(i).1)
        });
        R::fuse_iter(value, in_x.chain(in_alpha))
    }
}

impl<R: Scalar, A: Vector<R> + Clone> Distribution<R> for Dirichlet<A> {
    type Value = A::Of<R>;

    fn ln_density(&self, x: &A::Of<R>) -> R {
        let x = x.as_ref();
        let sum: f64 = x.iter().map(|x| x.value()).sum();
        let inside = x.iter().all(|x| x.value() >= 0.0) && (sum - 1.0).abs() <= TOLERANCE;
        if x.len() != self.0.size() || !inside {
            return R::from(f64::NEG_INFINITY);
        }
        self.total(1.0, |i| (x[i], x[i].value().ln(), x[i].value().recip()))
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require(self.0.size() > 0, "Dirichlet", "size", "at least 1", 0.0)?;
        (0..self.0.size()).try_for_each(|i| {
            let name = format_args!("concentration[{i}]");
            DomainError::require_positive("Dirichlet", name, self.0.at(i).value())
        })
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> A::Of<R> {
        let mut values = self.0.filled(R::from(0.0));
        let x = values.as_mut();
        for (i, x) in x.iter_mut().enumerate() {
            *x = R::from(ln_gamma_draw(self.0.at(i).value(), rng));
        }
        let largest = x.iter().fold(f64::NEG_INFINITY, |m, x| m.max(x.value()));
        let total: f64 = x.iter().map(|x| (x.value() - largest).exp()).sum();
        x.iter_mut().for_each(|x| {
            let share = (x.value() - largest).exp() / total;
            *x = R::from(share.max(f64::MIN_POSITIVE));
        });
        values
    }
}

/// The logarithm of a draw from the gamma distribution with this shape and unit rate, as
/// ln G(b + 1) + (ln U)/b: no underflow for small shapes.
pub(super) fn ln_gamma_draw<G: Rng + ?Sized>(shape: f64, rng: &mut G) -> f64 {
    let ln_larger = rand_distr::Gamma::new(shape + 1.0, 1.0)
        .map_or(f64::NAN, |gamma| rng.sample::<f64, _>(gamma).ln());
    let exponential: f64 = rng.sample(rand_distr::Exp1);
    ln_larger - exponential / shape
}

impl<R: Scalar, A: Vector<R> + Clone> Unknown<R> for Dirichlet<A> {
    fn dim(&self) -> usize {
        VectorMap::<R>::dim(&Simplex, self.0.size())
    }

    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Accumulator<R>,
    ) -> A::Of<R> {
        let mut values = self.0.filled(R::from(0.0));
        ln_simplex(next, values.as_mut());
        let ln_x = values.as_ref();
        let less = if jacobian { 0.0 } else { 1.0 };
        let mut total = self.total(less, |i| (ln_x[i], ln_x[i].value(), 1.0));
        if jacobian {
            total += 0.5 * (ln_x.len() as f64).ln();
        }
        terms.add_number(total);
        values.as_mut().iter_mut().for_each(|x| *x = x.exp());
        values
    }

    fn unconstrain(&self, x: &A::Of<R>, out: &mut Vec<f64>) {
        Simplex.unconstrain(x.as_ref(), out);
    }
}
