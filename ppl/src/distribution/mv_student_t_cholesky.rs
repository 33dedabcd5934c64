//! The multivariate Student t distribution, by the Cholesky factor of its scale matrix.

use std::f64::consts::PI;

use rand::Rng;
use rand_distr::{ChiSquared, StandardNormal};

use super::mv_normal_cholesky::{Gradient, Solved, solve_upper};
use super::{CholeskyFactor, Distribution, Family, Parameter, Unknown};
use crate::density::DomainError;
use crate::partials::Partials;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::{ln_1p_minus, ln_beta, ln_gamma, ln_minus_digamma};
use crate::terms::{Joined, Terms};

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

/// The partials of one density: in ν, and those of a normal one with w stretched.
struct WithDegrees<N, R, const K: usize> {
    nu: (N, f64),
    rest: Gradient<R, K>,
}

impl<N: Datum<R>, R: Scalar, const K: usize> Partials<R> for WithDegrees<N, R, K> {
    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        self.rest.spread(f);
        self.nu.0.spread(self.nu.1, f);
    }

    #[inline(always)]
    fn settle(self, f: &mut impl FnMut(R, f64)) {
        self.rest.settle(f);
        self.nu.0.settle(self.nu.1, f);
    }
}

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
        Joined::of(|terms| self.add_terms(x, terms))
    }

    #[inline(always)]
    fn add_terms(&self, x: &[R; K], terms: &mut impl Terms<R>) {
        let (nu, half) = (self.0.number(), 0.5 * K as f64);
        let (mean, factor): ([R; K], CholeskyFactor<R, K>) = (self.1.lift(), self.2.lifted());
        let Solved { z, square, l, inverse, ln_determinant } = Solved::new(x, &mean, &factor);
        let ln_square = (square / nu).ln_1p();
        // ln Γ((ν + K)/2) − ln Γ(ν/2) without their cancellation
        let mut value = ln_gamma(half) - ln_beta(0.5 * nu, half) - half * (PI * nu).ln();
        value -= ln_determinant + (0.5 * nu + half) * ln_square;
        if !R::DIFFERENTIABLE {
            return terms.add_number(R::from(value));
        }
        let c = (nu + 2.0 * half) / (nu + square);
        let mut w = z.map(|z| c * z);
        solve_upper(&l, &inverse, &mut w);
        let in_nu = if N::CONSTANT {
            0.0
        } else {
            0.5 * (ln_1p_minus(2.0 * half / nu) + ln_minus_digamma(0.5 * nu)
                - ln_minus_digamma(0.5 * nu + half)
                - ln_square
                + c * square / nu)
        };
        let rest = Gradient { x: *x, mean, factor, z, w, inverse };
        terms.add(value, WithDegrees { nu: (self.0, in_nu), rest });
    }

    fn validate(&self) -> Result<(), DomainError> {
        const NAME: &str = "MvStudentTCholesky";
        DomainError::require_positive(NAME, "degrees of freedom", self.0.number())?;
        let (mean, factor): ([R; K], CholeskyFactor<R, K>) = (self.1.lift(), self.2.lifted());
        for (i, mean) in mean.iter().enumerate() {
            DomainError::require_finite(NAME, format_args!("location[{i}]"), mean.value())?;
        }
        factor.validate(NAME)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> [R; K] {
        let (mean, factor): ([R; K], CholeskyFactor<R, K>) = (self.1.lift(), self.2.lifted());
        let (nu, l) = (self.0.number(), factor.values());
        let chi = ChiSquared::new(nu).map_or(f64::NAN, |chi| rng.sample(chi));
        let stretch = (nu / chi).sqrt();
        let z: [f64; K] = std::array::from_fn(|_| stretch * rng.sample::<f64, _>(StandardNormal));
        std::array::from_fn(|i| {
            let inner: f64 = (0..=i).map(|j| l[i][j] * z[j]).sum();
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
        self.add_terms(&x, terms);
        x
    }

    fn unconstrain(&self, x: &[R; K], out: &mut Vec<f64>) {
        out.extend(x.iter().map(|x| x.value()));
    }
}

super::cholesky_factor::by_reference!(MvStudentTCholesky < N, M > (0, 1), 2);
