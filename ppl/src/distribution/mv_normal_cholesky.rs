//! The multivariate normal distribution, by the Cholesky factor of its covariance.

use rand::Rng;
use rand_distr::StandardNormal;

use super::{CholeskyFactor, Distribution, Family, Unknown};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::{Partials, Scalar};
use crate::special::HALF_LN_2PI;

/// Multivariate normal distribution with mean μ ∈ ℝᴷ and covariance L Lᵀ.
///
/// ln p(x) = −½ |L⁻¹(x − μ)|² − Σᵢ ln Lᵢᵢ − (K/2) ln 2π, for Lᵢᵢ > 0.
///
/// The mean is an array of numbers or unknowns, the factor a [`CholeskyFactor`] of either, or a
/// reference to one. An evaluation is one fused operation, with z = L⁻¹(x − μ), w = L⁻ᵀ z and
/// partials −w in x, w in μ and wᵢ zⱼ − δᵢⱼ/Lᵢᵢ in Lᵢⱼ.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let factor = CholeskyFactor::new([[2.0, 0.0], [0.0, 3.0]])?;
/// let joint: f64 = MvNormalCholesky([1.0, -1.0], factor).ln_density(&[0.5, 0.0]);
/// let product = Normal(1.0, 2.0).ln_density(&0.5) + Normal(-1.0, 3.0).ln_density(&0.0);
/// assert!((joint - product).abs() < 1e-14);
/// # Ok::<(), ppl::DomainError>(())
/// ```
///
/// # References
/// Kotz, Balakrishnan & Johnson (2000), *Continuous Multivariate Distributions*, vol. 1, ch. 45.
#[derive(Clone, Copy, Debug)]
pub struct MvNormalCholesky<M, L>(pub M, pub L);

impl<M: Clone, L: Clone> Family for MvNormalCholesky<M, L> {}

impl<M, L> MvNormalCholesky<M, L> {
    /// Mean and factor as numbers of one kind.
    #[inline]
    fn lift<R: Scalar, const K: usize>(&self) -> ([R; K], CholeskyFactor<R, K>)
    where
        M: Datum<[R; K]>,
        L: Datum<CholeskyFactor<R, K>>,
    {
        (self.0.lift(), self.1.lift())
    }
}

/// The partials of one density.
struct Gradient<R, const K: usize> {
    x: [R; K],
    mean: [R; K],
    factor: CholeskyFactor<R, K>,
    z: [f64; K],
    w: [f64; K],
}

impl<R: Scalar, const K: usize> Partials<R> for Gradient<R, K> {
    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        for i in 0..K {
            f(self.x[i], -self.w[i]);
            f(self.mean[i], self.w[i]);
            for j in 0..i {
                f(self.factor.get(i, j), self.w[i] * self.z[j]);
            }
            let diagonal = self.factor.get(i, i);
            f(diagonal, self.w[i] * self.z[i] - diagonal.value().recip());
        }
    }

    #[inline(always)]
    fn any(&self) -> Option<R> {
        let factor = (0..K).flat_map(|i| (0..=i).map(move |j| (i, j)));
        let numbers = self.mean.iter().chain(&self.x).copied();
        let mut all = numbers.chain(factor.map(|(i, j)| self.factor.get(i, j)));
        all.find(|number| !number.is_constant())
    }
}

impl<R, M, T, const K: usize> Distribution<R> for MvNormalCholesky<M, CholeskyFactor<T, K>>
where
    R: Scalar,
    M: Datum<[R; K]> + Clone,
    T: Datum<R> + Clone,
{
    type Value = [R; K];
    const SUMMANDS: bool = true;

    #[inline]
    fn ln_density(&self, x: &[R; K]) -> R {
        let (mean, factor) = self.lift::<R, K>();
        let l = |i: usize, j: usize| factor.get(i, j).value();
        let mut z = [0.0; K];
        let mut value = -HALF_LN_2PI * K as f64;
        for i in 0..K {
            let inner: f64 = (0..i).map(|j| l(i, j) * z[j]).sum();
            z[i] = (x[i].value() - mean[i].value() - inner) / l(i, i);
            value -= 0.5 * z[i] * z[i] + l(i, i).ln();
        }
        if !R::DIFFERENTIABLE {
            return R::from(value);
        }
        let mut w = z;
        for i in (0..K).rev() {
            let inner: f64 = (i + 1..K).map(|k| l(k, i) * w[k]).sum();
            w[i] = (w[i] - inner) / l(i, i);
        }
        R::term(value, Gradient { x: *x, mean, factor, z, w })
    }

    fn validate(&self) -> Result<(), DomainError> {
        let (mean, factor) = self.lift::<R, K>();
        for (i, mean) in mean.iter().enumerate() {
            let name = format!("mean[{i}]");
            DomainError::require_finite("MvNormalCholesky", &name, mean.value())?;
        }
        factor.validate("MvNormalCholesky")
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> [R; K] {
        let (mean, factor) = self.lift::<R, K>();
        let z: [f64; K] = std::array::from_fn(|_| rng.sample(StandardNormal));
        std::array::from_fn(|i| {
            let inner: f64 = (0..=i).map(|j| factor.get(i, j).value() * z[j]).sum();
            R::from(mean[i].value() + inner)
        })
    }
}

impl<R, M, T, const K: usize> Unknown<R> for MvNormalCholesky<M, CholeskyFactor<T, K>>
where
    R: Scalar,
    M: Datum<[R; K]> + Clone,
    T: Datum<R> + Clone,
{
    fn dim(&self) -> usize {
        K
    }

    #[inline]
    fn constrain(&self, next: &mut impl FnMut() -> R, _: bool) -> ([R; K], R) {
        let x = std::array::from_fn(|_| next());
        (x, self.ln_density(&x))
    }

    fn unconstrain(&self, x: &[R; K], out: &mut Vec<f64>) {
        out.extend(x.iter().map(|x| x.value()));
    }
}

super::cholesky_factor::by_reference!(MvNormalCholesky<M>(0), 1);
