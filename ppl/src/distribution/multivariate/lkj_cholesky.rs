//! The LKJ distribution of correlation matrices, over their Cholesky factors.

use std::f64::consts::PI;

use rand::Rng;

use super::cholesky_factor::{Angles, CholeskyFactor, Whole};
use super::dirichlet::ln_gamma_draw;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::{Distribution, Unknown, lift};
use crate::parameter::Parameter;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::{Hyperbolic, digamma, ln_beta, ln_gamma};
use crate::terms::Terms;

/// Cholesky factor L of a K×K correlation matrix R = L Lᵀ with p(R) ∝ det(R)^(η − 1).
///
/// ln p(L) = ln c_K + Σᵢ (K − i + 2η − 2) ln Lᵢᵢ (i from 2, counted from 1), for η > 0, with
/// ln c_K = (K−1) ln Γ(η + (K−1)/2) − Σₖ [(k/2) ln π + ln Γ(η + (K−1−k)/2)], k = 1 … K−1.
/// Each correlation has a beta distribution on (−1, 1) with both shapes η − 1 + K/2; η = 1 is
/// uniform over correlation matrices.
///
/// η is a number, `LkjCholesky::<3>(2.0)`, or an unknown: `LkjCholesky::<3, _>(eta)`.
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
pub struct LkjCholesky<const K: usize, E = f64>(pub E);

impl<const K: usize, E: Parameter> Family for LkjCholesky<K, E> {}

impl<const K: usize, E: Parameter> LkjCholesky<K, E> {
    /// ln c_K.
    fn ln_normaliser(&self) -> f64 {
        let (eta, last) = (self.0.number(), K as f64 - 1.0);
        let gamma = |k: f64| ln_gamma(eta + 0.5 * (last - k));
        (1..K).fold(0.0, |sum, k| {
            let k = k as f64;
            sum + gamma(0.0) - 0.5 * k * PI.ln() - gamma(k)
        })
    }

    /// ∂ ln c_K/∂η.
    fn normaliser_slope(&self) -> f64 {
        let (eta, last) = (self.0.number(), K as f64 - 1.0);
        let psi = |k: f64| digamma(eta + 0.5 * (last - k));
        (1..K).map(|k| psi(0.0) - psi(k as f64)).sum()
    }

    /// The constant of the density over coordinates: −Σ [ln B(½, bⱼ) + ½ ln 2bⱼ].
    fn ln_coordinate_normaliser(&self) -> f64 {
        let term = |j| ln_beta(0.5, self.shape(j)) + self.scale(j).ln();
        -Self::columns().map(|(j, entries)| entries * term(j)).sum::<f64>()
    }

    /// Its derivative in η.
    fn coordinate_normaliser_slope(&self) -> f64 {
        let term = |b: f64| digamma(b) - digamma(b + 0.5) + 0.5 / b;
        -Self::columns().map(|(j, entries)| entries * term(self.shape(j))).sum::<f64>()
    }

    /// The columns that hold coordinates, with the number of these.
    fn columns() -> impl Iterator<Item = (usize, f64)> {
        (1..K).map(|j| (j - 1, (K - j) as f64))
    }

    /// Power of Lᵢᵢ in the density over factors (i from 0).
    #[inline]
    fn power(&self, i: usize) -> f64 {
        (K - 1 - i) as f64 + 2.0 * (self.0.number() - 1.0)
    }

    /// The shape bⱼ of the partial correlations of column j.
    #[inline]
    fn shape(&self, j: usize) -> f64 {
        self.0.number() + 0.5 * (K as f64 - 2.0 - j as f64)
    }

    /// Scale of the coordinates of column j: x = √(2 bⱼ) y.
    #[inline]
    fn scale(&self, j: usize) -> f64 {
        (2.0 * self.shape(j)).sqrt()
    }
}

/// Up to which K a factor keeps the coordinates that its entries are functions of: densities send
/// their partials there without a step on the tape for every entry.
const SMALL: usize = 8;

/// Rows of a correlation factor must have length 1 to this tolerance when they are data.
const UNIT_TOLERANCE: f64 = 1e-8;

impl<R, const K: usize, E> Distribution<R> for LkjCholesky<K, E>
where
    R: Scalar,
    E: Parameter + Datum<R>,
{
    type Value = CholeskyFactor<R, K>;

    fn ln_density(&self, factor: &CholeskyFactor<R, K>) -> R {
        let l = factor.values();
        let lengths = l.map(|row| row.iter().map(|entry| entry.powi(2)).sum::<f64>());
        if lengths.iter().any(|s| (s - 1.0).abs() > UNIT_TOLERANCE) {
            return R::from(f64::NEG_INFINITY);
        }
        let eta: R = lift(self.0);
        let (mut value, mut in_eta, mut slopes) = (self.ln_normaliser(), 0.0, [[0.0; K]; K]);
        for i in 1..K {
            let (entry, power) = (l[i][i], self.power(i));
            value += power * entry.ln();
            slopes[i][i] = power / entry;
            in_eta += 2.0 * entry.ln();
        }
        if !eta.is_constant() {
            in_eta += self.normaliser_slope();
        }
        R::gather(value, Whole { factor, weights: slopes, other: (eta, in_eta) })
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("LkjCholesky", "eta", self.0.number())
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

impl<R, const K: usize, E> Unknown<R> for LkjCholesky<K, E>
where
    R: Scalar,
    E: Parameter + Datum<R>,
{
    fn dim(&self) -> usize {
        K * K.saturating_sub(1) / 2
    }

    #[inline(always)]
    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Terms<R>,
    ) -> CholeskyFactor<R, K> {
        let inverse: [f64; K] = std::array::from_fn(|j| self.scale(j).recip());
        let eta: R = lift(self.0);
        let varies = !eta.is_constant();
        // ln p = constant − Σ weight ln cosh y, where weight and y = x/√(2 bⱼ) move with η
        let (mut value, mut in_eta) = match (jacobian, varies) {
            // the same at every point
            (_, false) if terms.leave_out_constants() => (0.0, 0.0),
            (true, false) => (self.ln_coordinate_normaliser(), 0.0),
            (true, true) => (self.ln_coordinate_normaliser(), self.coordinate_normaliser_slope()),
            (false, false) => (self.ln_normaliser(), 0.0),
            (false, true) => (self.ln_normaliser(), self.normaliser_slope()),
        };
        let weight = |i: usize, j: usize| {
            if jacobian { 2.0 * self.shape(j) } else { self.power(i) }
        };
        // of ln cosh y what shares a weight: the sum of the sizes, and one logarithm of a product
        let (mut sizes, mut shrinks) = ([0.0; K], [1.0; K]);
        let mut x = [[R::from(0.0); K]; K];
        let mut angles = Angles::zero();
        for i in 0..K {
            for j in 0..i {
                x[i][j] = next();
                let y = x[i][j].value() * inverse[j];
                let at = Hyperbolic::at(y);
                angles.set(i, j, at, inverse[j]);
                let slope = -weight(i, j) * at.tanh;
                let same = if jacobian { j } else { i };
                sizes[same] += at.size;
                shrinks[same] *= at.shrink;
                in_eta -= slope * y * inverse[j] * inverse[j];
                terms.add(0.0, ((x[i][j], slope * inverse[j]),));
            }
        }
        for k in if jacobian { 0..K.saturating_sub(1) } else { 1..K } {
            let ln_cosh = sizes[k] + shrinks[k].ln();
            value -= weight(k, k) * ln_cosh;
            in_eta -= 2.0 * ln_cosh;
        }
        terms.add(value, ((eta, in_eta),));
        if K <= SMALL && !varies && R::DIFFERENTIABLE {
            return CholeskyFactor::from_angles(x, angles);
        }
        CholeskyFactor::from_rows(angles.unfold(&x, (eta, inverse.map(|slope| -slope * slope))))
    }

    fn unconstrain(&self, factor: &CholeskyFactor<R, K>, out: &mut Vec<f64>) {
        // sinh yᵢⱼ = Lᵢⱼ/|(Lᵢ,ⱼ₊₁ … Lᵢᵢ)|
        for (i, row) in factor.values().iter().enumerate() {
            for j in 0..i {
                let rest: f64 = row[j + 1..=i].iter().map(|entry| entry.powi(2)).sum();
                out.push(self.scale(j) * (row[j] / rest.sqrt()).asinh());
            }
        }
    }
}
