//! The Wishart distribution, over Cholesky factors.

use std::f64::consts::LN_2;

use rand::Rng;
use rand_distr::{ChiSquared, StandardNormal};

use super::cholesky_factor::Whole;
use super::triangular::{product, product_transposed, solve, solve_transposed};
use super::{CholeskyFactor, Distribution, Family, Parameter, Unknown, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::{HALF_LN_2PI, digamma, ln_gamma};
use crate::terms::Terms;
use crate::transform::Covariance;

/// Cholesky factor L of a K×K matrix W = L Lᵀ with the Wishart distribution: ν degrees of
/// freedom, ν > K − 1, and scale matrix S Sᵀ by its factor S, so that E W = ν S Sᵀ.
///
/// With A = S⁻¹ L (Bartlett), the entries of A are independent: Aᵢᵢ has a chi distribution with
/// ν − i degrees of freedom (i from 0), those below the diagonal are standard normal. The
/// density is over the entries of L: that of W times 2ᴷ Π Lᵢᵢ^(K − i), whose logarithm is
/// Σ [ln χ(Aᵢᵢ) + Σⱼ﹤ᵢ ln φ(Aᵢⱼ) − (i + 1) ln Sᵢᵢ].
///
/// The coordinates are those of A ([`Covariance`]), so that prior draws are exact and no scale
/// is too far from 1.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// // K = 1: W = L² is gamma with shape ν/2 and rate 1/(2 S²), and dW = 2 L dL
/// let (l, scale) = (CholeskyFactor::new([[1.5]])?, CholeskyFactor::new([[2.0]])?);
/// let by_factor: f64 = WishartCholesky(5.0, scale).ln_density(&l);
/// let by_gamma: f64 = Gamma(2.5, 0.125).ln_density(&2.25) + 3.0f64.ln();
/// assert!((by_factor - by_gamma).abs() < 1e-14);
/// # Ok::<(), ppl::DomainError>(())
/// ```
///
/// # References
/// Bartlett (1934), doi:10.1017/S0370164600016813; Muirhead (1982), *Aspects of Multivariate
/// Statistical Theory*, ch. 3.
#[derive(Clone, Copy, Debug)]
pub struct WishartCholesky<N, L>(pub N, pub L);

impl<N: Parameter, L: Clone> Family for WishartCholesky<N, L> {}

/// ln p(A) of a Bartlett factor with its slopes: in the entries, and in ν.
pub(super) struct Bartlett<const K: usize> {
    pub(super) value: f64,
    pub(super) slopes: [[f64; K]; K],
    pub(super) in_nu: f64,
}

impl<const K: usize> Bartlett<K> {
    /// Row i has `degrees(i)` degrees of freedom on the diagonal; Π Aᵢᵢ^`extra` comes on top.
    pub(super) fn new(a: &[[f64; K]; K], degrees: impl Fn(usize) -> f64, extra: f64) -> Self {
        let (mut value, mut in_nu) = (0.0, 0.0);
        let mut slopes = [[0.0; K]; K];
        for i in 0..K {
            for j in 0..i {
                value -= 0.5 * a[i][j] * a[i][j] + HALF_LN_2PI;
                slopes[i][j] = -a[i][j];
            }
            let (x, degrees) = (a[i][i], degrees(i));
            let power = degrees - 1.0 + extra;
            value += power * x.ln() - 0.5 * x * x + (1.0 - 0.5 * degrees) * LN_2
                - ln_gamma(0.5 * degrees);
            slopes[i][i] = power / x - x;
            in_nu += x.ln() - 0.5 * (LN_2 + digamma(0.5 * degrees));
        }
        Self { value, slopes, in_nu }
    }

    /// As one operation on a factor whose entries are numbers of the model.
    pub(super) fn fuse<R: Scalar>(self, a: &CholeskyFactor<R, K>, nu: R) -> R {
        let Self { value, slopes, in_nu } = self;
        R::gather(value, Whole { factors: [(a, slopes)], other: (nu, in_nu) })
    }

    /// A draw.
    pub(super) fn draw<G: Rng + ?Sized>(
        degrees: impl Fn(usize) -> f64,
        rng: &mut G,
    ) -> [[f64; K]; K] {
        let mut a = [[0.0; K]; K];
        for i in 0..K {
            a[i][..i].iter_mut().for_each(|x| *x = rng.sample(StandardNormal));
            a[i][i] = ChiSquared::new(degrees(i)).map_or(f64::NAN, |chi| rng.sample(chi).sqrt());
        }
        a
    }
}

/// ν > K − 1 and a factor.
pub(super) fn validate<R: Scalar, const K: usize>(
    distribution: &str,
    nu: f64,
    scale: &CholeskyFactor<R, K>,
) -> Result<(), DomainError> {
    let requirement = format_args!("above K − 1 = {} and finite", K as f64 - 1.0);
    let holds = nu > K as f64 - 1.0 && nu.is_finite();
    DomainError::require(holds, distribution, "degrees of freedom", requirement, nu)?;
    scale.validate(distribution)
}

/// Σ (i + 1) ln Sᵢᵢ: the logarithm of |∂(S A)/∂A|.
pub(super) fn ln_scaling<const K: usize>(scale: &[[f64; K]; K]) -> f64 {
    (0..K).map(|i| (i + 1) as f64 * scale[i][i].ln()).sum()
}

/// One operation on two factors and ν, with these slopes.
pub(super) fn fuse<R: Scalar, const K: usize>(
    value: f64,
    factors: [(&CholeskyFactor<R, K>, [[f64; K]; K]); 2],
    nu: (R, f64),
) -> R {
    R::gather(value, Whole { factors, other: nu })
}

impl<N: Parameter, L> WishartCholesky<N, L> {
    fn degrees(&self) -> impl Fn(usize) -> f64 + use<N, L> {
        let nu = self.0.number();
        move |i| nu - i as f64
    }
}

impl<R, N, T, const K: usize> Distribution<R> for WishartCholesky<N, CholeskyFactor<T, K>>
where
    R: Scalar,
    N: Parameter + Datum<R>,
    T: Datum<R> + Clone,
{
    type Value = CholeskyFactor<R, K>;

    fn ln_density(&self, factor: &CholeskyFactor<R, K>) -> R {
        let scale: CholeskyFactor<R, K> = self.1.lift();
        let (l, s) = (factor.values(), scale.values());
        let a = solve(&s, &l);
        let bartlett = Bartlett::new(&a, self.degrees(), 0.0);
        let value = bartlett.value - ln_scaling(&s);
        if !R::DIFFERENTIABLE {
            return R::from(value);
        }
        // dA = S⁻¹ dL − S⁻¹ dS A
        let in_l = solve_transposed(&s, &bartlett.slopes);
        let mut in_s = product_transposed(&in_l, &a).map(|row| row.map(|x| -x));
        (0..K).for_each(|i| in_s[i][i] -= (i + 1) as f64 / s[i][i]);
        fuse(value, [(factor, in_l), (&scale, in_s)], (lift(self.0), bartlett.in_nu))
    }

    fn validate(&self) -> Result<(), DomainError> {
        let scale: CholeskyFactor<R, K> = self.1.lift();
        validate("WishartCholesky", self.0.number(), &scale)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> CholeskyFactor<R, K> {
        let scale: CholeskyFactor<R, K> = self.1.lift();
        let l = product(&scale.values(), &Bartlett::draw(self.degrees(), rng));
        CholeskyFactor::from_fn(|i, j| R::from(l[i][j]))
    }
}

impl<R, N, T, const K: usize> Unknown<R> for WishartCholesky<N, CholeskyFactor<T, K>>
where
    R: Scalar,
    N: Parameter + Datum<R>,
    T: Datum<R> + Clone,
{
    fn dim(&self) -> usize {
        K * (K + 1) / 2
    }

    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Terms<R>,
    ) -> CholeskyFactor<R, K> {
        let (a, _) = Covariance.constrain::<R, K>(next);
        let factor = self.1.lift().product(&a);
        terms.add_number(if jacobian {
            // the Jacobian of Aᵢᵢ = exp y is one more power
            Bartlett::new(&a.values(), self.degrees(), 1.0).fuse(&a, lift(self.0))
        } else {
            self.ln_density(&factor)
        });
        factor
    }

    fn unconstrain(&self, factor: &CholeskyFactor<R, K>, out: &mut Vec<f64>) {
        let scale: CholeskyFactor<R, K> = self.1.lift();
        let a = solve(&scale.values(), &factor.values());
        Covariance.unconstrain(&CholeskyFactor::<f64, K>::from_fn(|i, j| a[i][j]), out);
    }
}

super::cholesky_factor::by_reference!(WishartCholesky<N>(0), 1);
