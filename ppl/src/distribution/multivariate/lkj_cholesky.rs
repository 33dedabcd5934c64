//! The LKJ distribution of correlation matrices, over their Cholesky factors.

use rand::Rng;

use super::cholesky_factor::{Angles, CholeskyFactor, Whole};
use super::lkj::Lkj;
use crate::accumulator::Accumulator;
use crate::datum::Datum;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::{Distribution, Unknown, lift};
use crate::parameter::Parameter;
use crate::scalar::Scalar;
use crate::special::Hyperbolic;

/// Cholesky factor L of a K×K correlation matrix R = L Lᵀ with p(R) ∝ det(R)^(η − 1).
///
/// ln p(L) = ln c_K + Σᵢ (K − i + 2η − 2) ln Lᵢᵢ (i from 2, counted from 1), for η > 0, with
/// ln c_K = (K−1) ln Γ(η + (K−1)/2) − Σₖ [(k/2) ln π + ln Γ(η + (K−1−k)/2)], k = 1 … K−1.
/// Each correlation has a beta distribution on (−1, 1) with both shapes η − 1 + K/2; η = 1 is
/// uniform over correlation matrices.
///
/// η is a number, `LkjCholesky::<3>(2.0)`, or an unknown: `LkjCholesky::<3, _>(eta)`. Where K is known
/// at run time only, it is [`LkjCholesky::of(k, eta)`](LkjCholesky::of).
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
    #[inline(always)]
    fn numbers(&self) -> Lkj {
        Lkj { eta: self.0.number(), size: K }
    }
}

/// Up to which K a factor keeps the coordinates that its entries are functions of: densities send
/// their partials there without a step on the tape for every entry.
const SMALL: usize = 8;

impl<R, const K: usize, E> Distribution<R> for LkjCholesky<K, E>
where
    R: Scalar,
    E: Parameter + Datum<R>,
{
    type Value = CholeskyFactor<R, K>;

    fn ln_density(&self, factor: &CholeskyFactor<R, K>) -> R {
        let (l, lkj) = (factor.values(), self.numbers());
        let value = lkj.ln_density(l.iter().map(|row| &row[..]));
        let eta: R = lift(self.0);
        let (mut in_eta, mut slopes) = (0.0, [[0.0; K]; K]);
        for i in 1..K {
            slopes[i][i] = lkj.power(i) / l[i][i];
            in_eta += 2.0 * l[i][i].ln();
        }
        if !eta.is_constant() {
            in_eta += lkj.normaliser_slope();
        }
        if value == f64::NEG_INFINITY {
            return R::from(value);
        }
        R::gather(value, Whole { factor, weights: slopes, other: (eta, in_eta) })
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("LkjCholesky", "eta", self.0.number())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> CholeskyFactor<R, K> {
        let (lkj, mut rest) = (self.numbers(), 1.0);
        CholeskyFactor::from_fn(|i, j| R::from(lkj.draw_entry((i, j), &mut rest, rng)))
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
        terms: &mut impl Accumulator<R>,
    ) -> CholeskyFactor<R, K> {
        let lkj = self.numbers();
        let inverse: [f64; K] = std::array::from_fn(|j| lkj.scale(j).recip());
        let eta: R = lift(self.0);
        let varies = !eta.is_constant();
        // ln p = constant − Σ weight ln cosh y, where weight and y = x/√(2 bⱼ) move with η
        let (mut value, mut in_eta) = match varies {
            // the same at every point
            false if terms.leave_out_constants() => (0.0, 0.0),
            varies => lkj.constant(jacobian, varies),
        };
        let weight = |i: usize, j: usize| {
            if jacobian { 2.0 * lkj.shape(j) } else { lkj.power(i) }
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
        self.numbers().unconstrain(factor.values().iter().map(|row| &row[..]), out);
    }
}
