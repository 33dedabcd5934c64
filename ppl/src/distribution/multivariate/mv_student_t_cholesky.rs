//! Multivariate Student t distribution, parametrised by the Cholesky factor of its scale matrix.

use rand::Rng;
use rand_distr::StandardNormal;

use super::factor::Factor;
use super::mv_normal_cholesky::{Scale, Vector, require_finite_mean, require_length};
use super::mv_normal_terms::{Gradient, ln_determinant, solve_lower, solve_upper};
use super::size::Size;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::{Distribution, Unknown, lift};
use crate::number::partials::Partials;
use crate::number::scalar::Scalar;
use crate::quantity::datum::{Datum, Recordable};
use crate::special::{ln_beta, ln_gamma, ln_minus_digamma};
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;

/// Multivariate t distribution with ν degrees of freedom, location μ ∈ ℝᴷ and scale matrix L Lᵀ. The covariance is
/// L Lᵀ ν/(ν − 2) for ν > 2.
///
/// ln p(x) = ln Γ((ν + K)/2) − ln Γ(ν/2) − (K/2) ln νπ − Σᵢ ln Lᵢᵢ − ½ (ν + K) ln(1 + |L⁻¹(x − μ)|²/ν), for ν, Lᵢᵢ > 0.
///
/// Location and factor are given as for [`MvNormalCholesky`](super::MvNormalCholesky).
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let factor = CholeskyFactor::new([[2.0]])?;
/// let vector: f64 = MvStudentTCholesky(4.0, [1.0], factor).ln_density(&[3.5]);
/// let number: f64 = StudentT(4.0, 1.0, 2.0).ln_density(&3.5);
/// assert!((vector - number).abs() < 1e-14);
/// # Ok::<(), ppl::DomainError>(())
/// ```
///
/// # References
/// Kotz & Nadarajah (2004), *Multivariate t Distributions and Their Applications*, ch. 1.
#[derive(Clone, Copy, Debug)]
pub struct MvStudentTCholesky<N, M, L>(pub N, pub M, pub L);

impl<N: Clone, M: Clone, L: Clone> Family for MvStudentTCholesky<N, M, L> {}

const NAME: &str = "MvStudentTCholesky";

/// Partial derivatives of the log density.
struct WithDegrees<R: Scalar, S: Size> {
    degrees: R,
    in_degrees: f64,
    others: Gradient<R, S>,
}

impl<R: Scalar, S: Size> Partials<R> for WithDegrees<R, S> {
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        f(self.degrees, self.in_degrees);
        self.others.spread(f);
    }
}

/// Adds the log density at `x`.
fn add_terms<R: Scalar, S: Size>(
    degrees: R,
    x: &S::Vector<R>,
    mean: S::Vector<R>,
    factor: Factor<R, S>,
    terms: &mut impl Accumulator<R>,
) {
    let (size, l, nu) = (factor.size, factor.values(), degrees.value());
    let inverse = size.vector(|i| l[i][i].recip());
    let mut z = size.vector(|i| x[i].value() - mean[i].value());
    solve_lower(size, &l, &inverse, &mut z);
    let square: f64 = z.as_ref().iter().map(|z| z * z).sum();
    let half = 0.5 * size.get() as f64;
    let far = (square / nu).ln_1p();
    let constant =
        ln_gamma(half) - ln_beta(0.5 * nu, half) - half * (nu.ln() + std::f64::consts::PI.ln());
    let value = constant - ln_determinant(size, &l) - (0.5 * nu + half) * far;
    if !R::DIFFERENTIABLE {
        return terms.add_number(R::from(value));
    }
    // ψ((ν + K)/2) − ψ(ν/2); to avoid cancellation, the digamma function ψ is expressed by the function ln x − ψ(x)
    let digammas =
        (2.0 * half / nu).ln_1p() + ln_minus_digamma(0.5 * nu) - ln_minus_digamma(0.5 * nu + half);
    let weight = (nu + 2.0 * half) / (nu + square);
    let in_degrees = 0.5 * (digammas - far) + 0.5 * (weight * square - 2.0 * half) / nu;
    // the derivatives are the derivatives of a normal density in which w = L⁻ᵀ z is multiplied by (ν +
    // K)/(ν + |z|²)
    let mut w = size.vector(|i| weight * z[i]);
    solve_upper(size, &l, &inverse, &mut w);
    let others = Gradient { x: x.clone(), mean, factor, z, w, inverse };
    terms.add(value, WithDegrees { degrees, in_degrees, others });
}

impl<R, N, M, L> Distribution<R> for MvStudentTCholesky<N, M, L>
where
    R: Scalar,
    N: Parameter + Datum<R>,
    L: Scale<R>,
    M: Datum<Vector<R, L>> + Clone,
{
    type Value = Vector<R, L>;

    fn add_terms(&self, x: &Self::Value, terms: &mut impl Accumulator<R>) {
        let (factor, mean) = (self.2.factor(), self.1.lift());
        if x.as_ref().len() != factor.size() || mean.as_ref().len() != factor.size() {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        add_terms(lift(self.0), x, mean, factor, terms);
    }

    fn validate(&self) -> Result<(), DomainError> {
        let (factor, mean) = (self.2.factor(), self.1.lift());
        DomainError::require_positive(NAME, "degrees of freedom", self.0.number())?;
        require_length(NAME, "length of the mean", mean.as_ref().len(), factor.size())?;
        require_finite_mean(NAME, mean.as_ref())?;
        factor.validate(NAME)
    }

    fn fits(&self, x: &Self::Value) -> Result<(), DomainError> {
        require_length(NAME, "length of x", x.as_ref().len(), self.2.factor().size())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Self::Value {
        let (factor, mean, nu) = (self.2.factor(), self.1.lift(), self.0.number());
        let l = factor.values();
        let z: Vec<f64> = (0..factor.size()).map(|_| rng.sample(StandardNormal)).collect();
        let square = rand_distr::ChiSquared::new(nu).map_or(f64::NAN, |chi| rng.sample(chi));
        let stretch = (nu / square).sqrt();
        factor.size.vector(|i| {
            let inner: f64 = (0..=i).map(|j| l[i][j] * z[j]).sum();
            R::from(mean[i].value() + stretch * inner)
        })
    }
}

impl<R, N, M, L> Unknown<R> for MvStudentTCholesky<N, M, L>
where
    R: Scalar,
    N: Parameter + Datum<R>,
    L: Scale<R>,
    M: Datum<Vector<R, L>> + Clone,
{
    fn dim(&self) -> usize {
        self.2.factor().size()
    }

    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        _: bool,
        terms: &mut impl Accumulator<R>,
    ) -> Self::Value {
        let x = self.2.factor().size.vector(|_| next());
        self.add_terms(&x, terms);
        x
    }

    fn unconstrain(&self, x: &Self::Value, out: &mut Vec<f64>) {
        x.flatten(out);
    }
}
