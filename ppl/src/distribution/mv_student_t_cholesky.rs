//! The multivariate Student t distribution, by the Cholesky factor of its scale matrix.

use rand::Rng;
use rand_distr::{ChiSquared, StandardNormal};

use super::{CholeskyFactor, Distribution, Family, Parameter, Unknown, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::{ln_1p_minus, ln_beta, ln_gamma, ln_minus_digamma};
use crate::terms::Terms;

/// Multivariate Student t distribution with ν degrees of freedom, location μ ∈ ℝᴷ and scale
/// matrix L Lᵀ: its covariance is L Lᵀ ν/(ν − 2) for ν > 2.
///
/// ln p(x) = ln Γ((ν + K)/2) − ln Γ(ν/2) − (K/2) ln(π ν) − Σᵢ ln Lᵢᵢ −
/// ((ν + K)/2) ln(1 + |z|²/ν) with z = L⁻¹(x − μ).
///
/// Arguments as in [`MvNormalCholesky`](super::MvNormalCholesky), with ν before them. An
/// evaluation is one fused operation: with w = L⁻ᵀ z and c = (ν + K)/(ν + |z|²), partials −c w
/// in x, c w in μ and c wᵢ zⱼ − δᵢⱼ/Lᵢⱼ in Lᵢⱼ.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let factor = CholeskyFactor::new([[2.0]])?;
/// let one: f64 = MvStudentTCholesky(4.0, [1.0], factor).ln_density(&[0.5]);
/// let same: f64 = StudentT(4.0, 1.0, 2.0).ln_density(&0.5);
/// assert!((one - same).abs() < 1e-14);
/// # Ok::<(), ppl::DomainError>(())
/// ```
///
/// # References
/// Kotz & Nadarajah (2004), *Multivariate t Distributions and Their Applications*, ch. 1.
#[derive(Clone, Copy, Debug)]
pub struct MvStudentTCholesky<N, M, L>(pub N, pub M, pub L);

impl<N: Parameter, M: Clone, L: Clone> Family for MvStudentTCholesky<N, M, L> {}

impl<R, N, M, T, const K: usize> Distribution<R> for MvStudentTCholesky<N, M, CholeskyFactor<T, K>>
where
    R: Scalar,
    N: Parameter + Datum<R>,
    M: Datum<[R; K]> + Clone,
    T: Datum<R> + Clone,
{
    type Value = [R; K];

    #[inline]
    fn ln_density(&self, x: &[R; K]) -> R {
        let (nu, size) = (self.0.number(), K as f64);
        let (mean, factor): ([R; K], CholeskyFactor<R, K>) = (self.1.lift(), self.2.lift());
        let l = |i: usize, j: usize| factor.get(i, j).value();
        let mut z = [0.0; K];
        let half = 0.5 * size;
        // ln Γ((ν + K)/2) − ln Γ(ν/2) without their cancellation
        let mut value =
            ln_gamma(half) - ln_beta(0.5 * nu, half) - half * (std::f64::consts::PI * nu).ln();
        for i in 0..K {
            let inner: f64 = (0..i).map(|j| l(i, j) * z[j]).sum();
            z[i] = (x[i].value() - mean[i].value() - inner) / l(i, i);
            value -= l(i, i).ln();
        }
        let square: f64 = z.iter().map(|z| z * z).sum();
        let ln_square = (square / nu).ln_1p();
        value -= (0.5 * nu + half) * ln_square;
        if !R::DIFFERENTIABLE {
            return R::from(value);
        }
        let mut w = z;
        for i in (0..K).rev() {
            let inner: f64 = (i + 1..K).map(|k| l(k, i) * w[k]).sum();
            w[i] = (w[i] - inner) / l(i, i);
        }
        let c = (nu + size) / (nu + square);
        let w = w.map(|w| c * w);
        let nu_lifted = lift(self.0);
        let in_nu = if nu_lifted.is_constant() {
            0.0
        } else {
            0.5 * (ln_1p_minus(size / nu) + ln_minus_digamma(0.5 * nu)
                - ln_minus_digamma(0.5 * nu + half)
                - ln_square
                + c * square / nu)
        };
        let in_x = (0..K).map(|i| (x[i], -w[i]));
        let in_mean = (0..K).map(|i| (mean[i], w[i]));
        let in_factor = (0..K).flat_map(|i| {
            (0..=i).map(move |j| {
                let diagonal = if i == j { l(i, i).recip() } else { 0.0 };
                (factor.get(i, j), w[i] * z[j] - diagonal)
            })
        });
        R::fuse_iter(value, in_x.chain(in_mean).chain(in_factor).chain([(nu_lifted, in_nu)]))
    }

    fn validate(&self) -> Result<(), DomainError> {
        const NAME: &str = "MvStudentTCholesky";
        DomainError::require_positive(NAME, "degrees of freedom", self.0.number())?;
        let (mean, factor): ([R; K], CholeskyFactor<R, K>) = (self.1.lift(), self.2.lift());
        for (i, mean) in mean.iter().enumerate() {
            DomainError::require_finite(NAME, format_args!("location[{i}]"), mean.value())?;
        }
        factor.validate(NAME)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> [R; K] {
        let (mean, factor): ([R; K], CholeskyFactor<R, K>) = (self.1.lift(), self.2.lift());
        let nu = self.0.number();
        let chi = ChiSquared::new(nu).map_or(f64::NAN, |chi| rng.sample(chi));
        let stretch = (nu / chi).sqrt();
        let z: [f64; K] = std::array::from_fn(|_| stretch * rng.sample::<f64, _>(StandardNormal));
        std::array::from_fn(|i| {
            let inner: f64 = (0..=i).map(|j| factor.get(i, j).value() * z[j]).sum();
            R::from(mean[i].value() + inner)
        })
    }
}

impl<R, N, M, T, const K: usize> Unknown<R> for MvStudentTCholesky<N, M, CholeskyFactor<T, K>>
where
    R: Scalar,
    N: Parameter + Datum<R>,
    M: Datum<[R; K]> + Clone,
    T: Datum<R> + Clone,
{
    fn dim(&self) -> usize {
        K
    }

    #[inline]
    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        _: bool,
        terms: &mut impl Terms<R>,
    ) -> [R; K] {
        let x = std::array::from_fn(|_| next());
        terms.add_number(self.ln_density(&x));
        x
    }

    fn unconstrain(&self, x: &[R; K], out: &mut Vec<f64>) {
        out.extend(x.iter().map(|x| x.value()));
    }
}

super::cholesky_factor::by_reference!(MvStudentTCholesky < N, M > (0, 1), 2);
