//! The inverse Wishart distribution, over Cholesky factors.

use rand::Rng;

use super::triangular::{product_transposed, solve, solve_transposed};
use super::wishart_cholesky::{Bartlett, fuse, ln_scaling, validate};
use super::{CholeskyFactor, Distribution, Family, Parameter, Unknown, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::terms::Terms;
use crate::transform::Covariance;

/// Cholesky factor L of a K×K covariance matrix Σ = L Lᵀ with the inverse Wishart distribution:
/// ν degrees of freedom, ν > K − 1, and scale matrix S Sᵀ by its factor S, so that
/// E Σ = S Sᵀ/(ν − K − 1) for ν > K + 1, and Σ⁻¹ is Wishart with scale matrix (S Sᵀ)⁻¹.
///
/// With C = L⁻¹ S, the entries of C are independent: Cᵢᵢ has a chi distribution with
/// ν − K + 1 + i degrees of freedom (i from 0), those below the diagonal are standard normal.
/// The density is over the entries of L: that of Σ times 2ᴷ Π Lᵢᵢ^(K − i), whose logarithm is
/// Σ [ln χ(Cᵢᵢ) + Σⱼ﹤ᵢ ln φ(Cᵢⱼ) + (K + 1) ln Cᵢᵢ − (i + 1) ln Sᵢᵢ].
///
/// The coordinates are those of C ([`Covariance`]), so that prior draws are exact.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// // K = 1: 1/L² is gamma with shape ν/2 and rate S²/2, and d(1/L²) = 2/L³ dL
/// let (l, scale) = (CholeskyFactor::new([[0.5]])?, CholeskyFactor::new([[2.0]])?);
/// let by_factor: f64 = InverseWishartCholesky(5.0, scale).ln_density(&l);
/// let by_gamma: f64 = Gamma(2.5, 2.0).ln_density(&4.0) + 16.0f64.ln();
/// assert!((by_factor - by_gamma).abs() < 1e-13);
/// # Ok::<(), ppl::DomainError>(())
/// ```
///
/// # References
/// Muirhead (1982), *Aspects of Multivariate Statistical Theory*, ch. 3.
#[derive(Clone, Copy, Debug)]
pub struct InverseWishartCholesky<N, L>(pub N, pub L);

impl<N: Parameter, L: Clone> Family for InverseWishartCholesky<N, L> {}

impl<N: Parameter, T, const K: usize> InverseWishartCholesky<N, CholeskyFactor<T, K>> {
    fn degrees(&self) -> impl Fn(usize) -> f64 + use<N, T, K> {
        let lowest = self.0.number() - K as f64 + 1.0;
        move |i| lowest + i as f64
    }
}

/// The L with L C = S.
fn divide<R: Scalar, const K: usize>(
    s: &CholeskyFactor<R, K>,
    c: &CholeskyFactor<R, K>,
) -> CholeskyFactor<R, K> {
    let mut l = [[R::from(0.0); K]; K];
    for i in 0..K {
        for j in (0..=i).rev() {
            let known = || (j + 1..=i).map(|k| (l[i][k], c.get(k, j)));
            let inner: f64 = known().map(|(l, c)| l.value() * c.value()).sum();
            let inverse = c.get(j, j).value().recip();
            let value = (s.get(i, j).value() - inner) * inverse;
            let terms =
                known().flat_map(|(l, c)| [(l, -c.value() * inverse), (c, -l.value() * inverse)]);
            let own = [(s.get(i, j), inverse), (c.get(j, j), -value * inverse)];
            l[i][j] = R::fuse_iter(value, own.into_iter().chain(terms));
        }
    }
    CholeskyFactor::from_fn(|i, j| l[i][j])
}

impl<R, N, T, const K: usize> Distribution<R> for InverseWishartCholesky<N, CholeskyFactor<T, K>>
where
    R: Scalar,
    N: Parameter + Datum<R>,
    T: Datum<R> + Clone,
{
    type Value = CholeskyFactor<R, K>;

    fn ln_density(&self, factor: &CholeskyFactor<R, K>) -> R {
        let scale: CholeskyFactor<R, K> = self.1.lift();
        let (l, s) = (factor.values(), scale.values());
        let c = solve(&l, &s);
        let bartlett = Bartlett::new(&c, self.degrees(), K as f64 + 1.0);
        let value = bartlett.value - ln_scaling(&s);
        if !R::DIFFERENTIABLE {
            return R::from(value);
        }
        // dC = L⁻¹ dS − L⁻¹ dL C
        let mut in_s = solve_transposed(&l, &bartlett.slopes);
        let in_l = product_transposed(&in_s, &c).map(|row| row.map(|x| -x));
        (0..K).for_each(|i| in_s[i][i] -= (i + 1) as f64 / s[i][i]);
        fuse(value, [(factor, in_l), (&scale, in_s)], (lift(self.0), bartlett.in_nu))
    }

    fn validate(&self) -> Result<(), DomainError> {
        let scale: CholeskyFactor<R, K> = self.1.lift();
        validate("InverseWishartCholesky", self.0.number(), &scale)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> CholeskyFactor<R, K> {
        let scale: CholeskyFactor<R, K> = self.1.lift();
        let c = Bartlett::<K>::draw(self.degrees(), rng);
        divide(&scale, &CholeskyFactor::from_fn(|i, j| R::from(c[i][j])))
    }
}

impl<R, N, T, const K: usize> Unknown<R> for InverseWishartCholesky<N, CholeskyFactor<T, K>>
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
        let (c, _) = Covariance.constrain::<R, K>(next);
        let factor = divide(&self.1.lift(), &c);
        terms.add_number(if jacobian {
            // the Jacobian of Cᵢᵢ = exp y is one power
            Bartlett::new(&c.values(), self.degrees(), 1.0).fuse(&c, lift(self.0))
        } else {
            self.ln_density(&factor)
        });
        factor
    }

    fn unconstrain(&self, factor: &CholeskyFactor<R, K>, out: &mut Vec<f64>) {
        let scale: CholeskyFactor<R, K> = self.1.lift();
        let c = solve(&factor.values(), &scale.values());
        Covariance.unconstrain(&CholeskyFactor::<f64, K>::from_fn(|i, j| c[i][j]), out);
    }
}

super::cholesky_factor::by_reference!(InverseWishartCholesky<N>(0), 1);
