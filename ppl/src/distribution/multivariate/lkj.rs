//! LKJ distribution, for sizes known at compile time or at run time.

use std::f64::consts::PI;

use rand::Rng;

use super::factor::{Angles, Factor, Whole};
use super::size::Size;
use crate::number::scalar::Scalar;
use crate::special::{Hyperbolic, ln_beta, ln_gamma};
use crate::term::accumulator::Accumulator;

/// Largest accepted deviation from 1 of the squared length of a row of an observed correlation factor.
const UNIT_TOLERANCE: f64 = 1e-8;

/// Parameter η and size K of an LKJ distribution. Rows i and columns j are counted from 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lkj<S> {
    pub(super) eta: f64,
    pub(super) size: S,
}

impl<S: Size> Lkj<S> {
    /// Number of coordinates: one per entry below the diagonal.
    pub(super) fn dim(self) -> usize {
        let size = self.size.get();
        size * size.saturating_sub(1) / 2
    }

    /// Log of the normalising constant, ln c_K.
    fn ln_normaliser(self) -> f64 {
        let last = self.size.get() as f64 - 1.0;
        let gamma = |k: f64| ln_gamma(self.eta + 0.5 * (last - k));
        (1..self.size.get()).fold(0.0, |sum, k| {
            let k = k as f64;
            sum + gamma(0.0) - 0.5 * k * PI.ln() - gamma(k)
        })
    }

    /// Constant term of the log density over coordinates, −Σ [ln B(½, bⱼ) + ½ ln 2bⱼ].
    fn ln_coordinate_normaliser(self) -> f64 {
        let size = self.size.get();
        let term = |j| ln_beta(0.5, self.shape(j)) + self.scale(j).ln();
        -(1..size).map(|j| (size - j) as f64 * term(j - 1)).sum::<f64>()
    }

    /// Exponent of the diagonal entry Lᵢᵢ in the density of the factor L.
    #[inline(always)]
    fn power(self, i: usize) -> f64 {
        (self.size.get() - 1 - i) as f64 + 2.0 * (self.eta - 1.0)
    }

    /// Beta shape bⱼ of the partial correlations in column j.
    #[inline(always)]
    fn shape(self, j: usize) -> f64 {
        self.eta + 0.5 * (self.size.get() as f64 - 2.0 - j as f64)
    }

    /// Scale of the coordinates x = √(2 bⱼ) y in column j.
    #[inline(always)]
    fn scale(self, j: usize) -> f64 {
        (2.0 * self.shape(j)).sqrt()
    }

    /// Log density of a factor; −∞ if its rows do not have length 1.
    pub(super) fn ln_density<R: Scalar>(self, factor: &Factor<R, S>) -> R {
        if factor.size() != self.size.get() {
            return R::from(f64::NEG_INFINITY);
        }
        let (l, mut weights) = (factor.values(), self.size.filled(0.0));
        let mut value = self.ln_normaliser();
        for i in 0..self.size.get() {
            let square: f64 = (0..=i).map(|j| l[i][j] * l[i][j]).sum();
            if (square - 1.0).abs() > UNIT_TOLERANCE {
                return R::from(f64::NEG_INFINITY);
            }
            if i > 0 {
                value += self.power(i) * l[i][i].ln();
                weights[i][i] = self.power(i) / l[i][i];
            }
        }
        R::gather(value, Whole { factor: factor.clone(), weights })
    }

    pub(super) fn draw<R: Scalar, G: Rng + ?Sized>(self, rng: &mut G) -> Factor<R, S> {
        let mut rest = 1.0;
        Factor::from_fn(self.size, |i, j| {
            if j == 0 {
                rest = 1.0;
            }
            if i == j {
                return R::from(rest);
            }
            // z = 2 Beta(b, b) − 1 = tanh(½ ln(G/G')) for two independent gamma variables G and G'
            let y = 0.5 * (ln_gamma_draw(self.shape(j), rng) - ln_gamma_draw(self.shape(j), rng));
            let entry = rest * y.tanh();
            rest /= y.cosh();
            R::from(entry)
        })
    }

    #[inline(always)]
    pub(super) fn constrain<R: Scalar>(
        self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Accumulator<R>,
    ) -> Factor<R, S> {
        let (size, k) = (self.size, self.size.get());
        let inverse = size.vector(|j| self.scale(j).recip());
        let weight = |i: usize, j: usize| {
            if jacobian { 2.0 * self.shape(j) } else { self.power(i) }
        };
        // ln p = constant − Σ weight ln cosh y. Terms with the same weight are combined: ln cosh y = `size` + ln
        // `shrink`, and the sum of the logarithms of `shrink` is computed as the logarithm of a product.
        let (mut sizes, mut shrinks) = (size.vector(|_| 0.0), size.vector(|_| 1.0));
        let mut x = size.filled(R::from(0.0));
        let mut angles = Angles::zero(size);
        for i in 0..k {
            for j in 0..i {
                x[i][j] = next();
                let at = Hyperbolic::at(x[i][j].value() * inverse[j]);
                angles.set(i, j, at, inverse[j]);
                let same = if jacobian { j } else { i };
                sizes[same] += at.size;
                shrinks[same] *= at.shrink;
                terms.add(0.0, ((x[i][j], -weight(i, j) * at.tanh * inverse[j]),));
            }
        }
        let mut value = match (terms.leave_out_constants(), jacobian) {
            (true, _) => 0.0,
            (false, true) => self.ln_coordinate_normaliser(),
            (false, false) => self.ln_normaliser(),
        };
        for same in if jacobian { 0..k.saturating_sub(1) } else { 1..k } {
            value -= weight(same, same) * (sizes[same] + shrinks[same].ln());
        }
        terms.add_number(R::from(value));
        if !R::DIFFERENTIABLE {
            let entry = |i: usize, j: usize| R::from(angles.entry(i, j));
            return Factor::from_fn(size, entry);
        }
        Factor { size, rows: x, angles: Some(angles), scale: None }
    }

    /// Appends the coordinates of a factor, from sinh yᵢⱼ = Lᵢⱼ/|(Lᵢ,ⱼ₊₁ … Lᵢᵢ)|.
    pub(super) fn unconstrain<R: Scalar>(self, factor: &Factor<R, S>, out: &mut Vec<f64>) {
        let l = factor.values();
        for i in 0..self.size.get() {
            for j in 0..i {
                let rest: f64 = (j + 1..=i).map(|k| l[i][k] * l[i][k]).sum();
                out.push(self.scale(j) * (l[i][j] / rest.sqrt()).asinh());
            }
        }
    }
}

/// Logarithm of a gamma draw with the given shape b and unit rate. The logarithm is computed as ln G + (ln U)/b, with
/// a gamma draw G of shape b + 1 and a uniform draw U. This computation does not underflow for small shapes.
fn ln_gamma_draw<G: Rng + ?Sized>(shape: f64, rng: &mut G) -> f64 {
    let ln_larger = rand_distr::Gamma::new(shape + 1.0, 1.0)
        .map_or(f64::NAN, |gamma| rng.sample::<f64, _>(gamma).ln());
    let exponential: f64 = rng.sample(rand_distr::Exp1);
    ln_larger - exponential / shape
}
