//! The LKJ distribution of correlation matrices, over their Cholesky factors.

use std::f64::consts::PI;

use rand::Rng;

use super::{CholeskyFactor, Distribution, Family, Unknown};
use crate::density::DomainError;
use crate::scalar::Scalar;
use crate::special::{ln_beta, ln_cosh, ln_gamma};

/// Cholesky factor L of a K×K correlation matrix R = L Lᵀ with p(R) ∝ det(R)^(η − 1).
///
/// ln p(L) = ln c_K + Σᵢ (K − i + 2η − 2) ln Lᵢᵢ (i from 2, counted from 1), for η > 0, with
/// ln c_K = (K−1) ln Γ(η + (K−1)/2) − Σₖ [(k/2) ln π + ln Γ(η + (K−1−k)/2)], k = 1 … K−1.
/// Each correlation has a beta distribution on (−1, 1) with both shapes η − 1 + K/2; η = 1 is
/// uniform over correlation matrices.
///
/// # Coordinates
/// Row i > column j from 0: y = x/√(2 bⱼ) with bⱼ = η + (K − 2 − j)/2, zᵢⱼ = tanh yᵢⱼ a partial
/// correlation, Lᵢⱼ = zᵢⱼ Πₖ﹤ⱼ sech yᵢₖ. Density times Jacobian separates,
/// Σ [−2 bⱼ ln cosh yᵢⱼ − ln B(½, bⱼ) − ½ ln 2bⱼ], so that prior draws are exact and nothing
/// like 1 − Σ L² is formed; the scale makes every x about standard normal, also for K = 40.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let identity = CholeskyFactor::new([[1.0, 0.0], [0.0, 1.0]])?;
/// let uniform: f64 = LkjCholesky::<2>(1.0).ln_density(&identity);
/// assert!((uniform - 0.5f64.ln()).abs() < 1e-14);
/// # Ok::<(), ppl::DomainError>(())
/// ```
///
/// # References
/// Lewandowski, Kurowicka & Joe (2009), doi:10.1016/j.jmva.2009.04.008.
#[derive(Clone, Copy, Debug)]
pub struct LkjCholesky<const K: usize>(pub f64);

impl<const K: usize> Family for LkjCholesky<K> {}

impl<const K: usize> LkjCholesky<K> {
    /// ln c_K.
    fn ln_normaliser(&self) -> f64 {
        let (eta, last) = (self.0, K as f64 - 1.0);
        let gamma = |k: f64| ln_gamma(eta + 0.5 * (last - k));
        (1..K).fold(0.0, |sum, k| {
            let k = k as f64;
            sum + gamma(0.0) - 0.5 * k * PI.ln() - gamma(k)
        })
    }

    /// Power of Lᵢᵢ in the density over factors (i from 0).
    #[inline]
    fn power(&self, i: usize) -> f64 {
        (K - 1 - i) as f64 + 2.0 * (self.0 - 1.0)
    }

    /// The shape bⱼ of the partial correlations of column j.
    #[inline]
    fn shape(&self, j: usize) -> f64 {
        self.0 + 0.5 * (K as f64 - 2.0 - j as f64)
    }

    /// Scale of the coordinates of column j: x = √(2 bⱼ) y.
    #[inline]
    fn scale(&self, j: usize) -> f64 {
        (2.0 * self.shape(j)).sqrt()
    }
}

/// Rows of a correlation factor must have length 1 to this tolerance when they are data.
const UNIT_TOLERANCE: f64 = 1e-8;

impl<R: Scalar, const K: usize> Distribution<R> for LkjCholesky<K> {
    type Value = CholeskyFactor<R, K>;

    fn ln_density(&self, factor: &CholeskyFactor<R, K>) -> R {
        let lengths = factor
            .rows()
            .iter()
            .map(|row| row.iter().map(|entry| entry.value().powi(2)).sum::<f64>());
        if lengths.into_iter().any(|s| (s - 1.0).abs() > UNIT_TOLERANCE) {
            return R::from(f64::NEG_INFINITY);
        }
        let diagonal = || (1..K).map(|i| (factor.get(i, i), self.power(i)));
        let value = diagonal()
            .fold(self.ln_normaliser(), |sum, (entry, power)| sum + power * entry.value().ln());
        R::fuse_iter(value, diagonal().map(|(entry, power)| (entry, power / entry.value())))
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("LkjCholesky", "eta", self.0)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> CholeskyFactor<R, K> {
        let mut remainder = 1.0;
        CholeskyFactor::from_fn(|i, j| {
            if j == 0 {
                remainder = 1.0;
            }
            if i == j {
                return R::from(remainder);
            }
            // z = 2 Beta(b, b) − 1 = tanh(½ ln(G/G')) for two gamma variables
            let y = 0.5 * (ln_gamma_draw(self.shape(j), rng) - ln_gamma_draw(self.shape(j), rng));
            let entry = remainder * y.tanh();
            remainder /= y.cosh();
            R::from(entry)
        })
    }
}

/// The logarithm of a draw from the gamma distribution with this shape and unit rate, as
/// ln G(b + 1) + (ln U)/b: no underflow for small shapes.
fn ln_gamma_draw<G: Rng + ?Sized>(shape: f64, rng: &mut G) -> f64 {
    let ln_larger = rand_distr::Gamma::new(shape + 1.0, 1.0)
        .map_or(f64::NAN, |gamma| rng.sample::<f64, _>(gamma).ln());
    let exponential: f64 = rng.sample(rand_distr::Exp1);
    ln_larger - exponential / shape
}

impl<R: Scalar, const K: usize> Unknown<R> for LkjCholesky<K> {
    fn dim(&self) -> usize {
        K * K.saturating_sub(1) / 2
    }

    fn constrain(&self, next: &mut impl FnMut() -> R, jacobian: bool) -> (CholeskyFactor<R, K>, R) {
        let scales: [f64; K] = std::array::from_fn(|j| self.scale(j));
        // ln p = constant − Σ weight ln cosh y
        let constant = if jacobian {
            (0..K).fold(0.0, |sum, j| {
                let term = ln_beta(0.5, self.shape(j)) + scales[j].ln();
                // the last column holds no coordinate, and no shape
                if j + 1 < K { sum - (K - 1 - j) as f64 * term } else { sum }
            })
        } else {
            self.ln_normaliser()
        };
        let weight = |i: usize, j: usize| {
            if jacobian { scales[j] * scales[j] } else { self.power(i) }
        };
        let mut value = constant;
        // ∂ ln p/∂x, kept in the place of the entry below the diagonal
        let mut slopes = [[(R::from(0.0), 0.0); K]; K];
        let mut remainder = R::from(1.0);
        let factor = CholeskyFactor::from_fn(|i, j| {
            if j == 0 {
                remainder = R::from(1.0);
            }
            if i == j {
                return remainder;
            }
            let x = next();
            let y = x.value() / scales[j];
            let (tanh, sech) = (y.tanh(), y.cosh().recip());
            value -= weight(i, j) * ln_cosh(y);
            slopes[i][j] = (x, -weight(i, j) * tanh / scales[j]);
            let rest = remainder.value();
            let entry =
                R::fuse(rest * tanh, [remainder, x], [tanh, rest * sech * sech / scales[j]]);
            remainder =
                R::fuse(rest * sech, [remainder, x], [sech, -rest * sech * tanh / scales[j]]);
            entry
        });
        let partials = slopes.into_iter().enumerate().flat_map(|(i, row)| row.into_iter().take(i));
        (factor, R::fuse_iter(value, partials))
    }

    fn unconstrain(&self, factor: &CholeskyFactor<R, K>, out: &mut Vec<f64>) {
        for (i, row) in factor.rows().iter().enumerate() {
            for j in 0..i {
                // sinh y = Lᵢⱼ/|(Lᵢ,ⱼ₊₁ … Lᵢᵢ)|
                let rest: f64 = row[j + 1..=i].iter().map(|x| x.value().powi(2)).sum();
                let y = (row[j].value() / rest.sqrt()).asinh();
                out.push(y * self.scale(j));
            }
        }
    }
}
