//! The formulas of the LKJ distribution, for any size.

use std::f64::consts::PI;

use rand::Rng;

use super::dirichlet::ln_gamma_draw;
use crate::special::{digamma, ln_beta, ln_gamma};

/// Rows of a correlation factor must have length 1 to this tolerance when they are data.
const UNIT_TOLERANCE: f64 = 1e-8;

/// η and K as numbers. Rows i and columns j count from 0.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lkj {
    pub(super) eta: f64,
    pub(super) size: usize,
}

impl Lkj {
    /// ln c_K.
    pub(super) fn ln_normaliser(self) -> f64 {
        let last = self.size as f64 - 1.0;
        let gamma = |k: f64| ln_gamma(self.eta + 0.5 * (last - k));
        (1..self.size).fold(0.0, |sum, k| {
            let k = k as f64;
            sum + gamma(0.0) - 0.5 * k * PI.ln() - gamma(k)
        })
    }

    /// ∂ ln c_K/∂η.
    pub(super) fn normaliser_slope(self) -> f64 {
        let last = self.size as f64 - 1.0;
        let psi = |k: f64| digamma(self.eta + 0.5 * (last - k));
        (1..self.size).map(|k| psi(0.0) - psi(k as f64)).sum()
    }

    /// The constant of the density over coordinates: −Σ [ln B(½, bⱼ) + ½ ln 2bⱼ].
    pub(super) fn ln_coordinate_normaliser(self) -> f64 {
        let term = |j| ln_beta(0.5, self.shape(j)) + self.scale(j).ln();
        -self.columns().map(|(j, entries)| entries * term(j)).sum::<f64>()
    }

    /// Its derivative in η.
    pub(super) fn coordinate_normaliser_slope(self) -> f64 {
        let term = |b: f64| digamma(b) - digamma(b + 0.5) + 0.5 / b;
        -self.columns().map(|(j, entries)| entries * term(self.shape(j))).sum::<f64>()
    }

    /// The constant of the density over coordinates or over factors, and its derivative in η if that
    /// is asked for.
    pub(super) fn constant(self, over_coordinates: bool, varies: bool) -> (f64, f64) {
        match (over_coordinates, varies) {
            (true, false) => (self.ln_coordinate_normaliser(), 0.0),
            (true, true) => (self.ln_coordinate_normaliser(), self.coordinate_normaliser_slope()),
            (false, false) => (self.ln_normaliser(), 0.0),
            (false, true) => (self.ln_normaliser(), self.normaliser_slope()),
        }
    }

    /// The columns that hold coordinates, with the number of these.
    fn columns(self) -> impl Iterator<Item = (usize, f64)> {
        (1..self.size).map(move |j| (j - 1, (self.size - j) as f64))
    }

    /// Power of Lᵢᵢ in the density over factors.
    #[inline(always)]
    pub(super) fn power(self, i: usize) -> f64 {
        (self.size - 1 - i) as f64 + 2.0 * (self.eta - 1.0)
    }

    /// The shape bⱼ of the partial correlations of column j.
    #[inline(always)]
    pub(super) fn shape(self, j: usize) -> f64 {
        self.eta + 0.5 * (self.size as f64 - 2.0 - j as f64)
    }

    /// Scale of the coordinates of column j: x = √(2 bⱼ) y.
    #[inline(always)]
    pub(super) fn scale(self, j: usize) -> f64 {
        (2.0 * self.shape(j)).sqrt()
    }

    /// ln p of the factor with these rows; −∞ unless they have length 1.
    pub(super) fn ln_density<'r>(self, rows: impl Iterator<Item = &'r [f64]>) -> f64 {
        let mut value = self.ln_normaliser();
        for (i, row) in rows.enumerate() {
            let square: f64 = row.iter().map(|entry| entry * entry).sum();
            if (square - 1.0).abs() > UNIT_TOLERANCE {
                return f64::NEG_INFINITY;
            }
            if i > 0 {
                value += self.power(i) * row[i].ln();
            }
        }
        value
    }

    /// Appends the coordinates of the factor with these rows: sinh yᵢⱼ = Lᵢⱼ/|(Lᵢ,ⱼ₊₁ … Lᵢᵢ)|.
    pub(super) fn unconstrain<'r>(self, rows: impl Iterator<Item = &'r [f64]>, out: &mut Vec<f64>) {
        for (i, row) in rows.enumerate() {
            for j in 0..i {
                let rest: f64 = row[j + 1..=i].iter().map(|entry| entry * entry).sum();
                out.push(self.scale(j) * (row[j] / rest.sqrt()).asinh());
            }
        }
    }

    /// Entry (i, j) of a draw, asked for row by row; `rest` is what is left of the row's length.
    pub(super) fn draw_entry<G: Rng + ?Sized>(
        self,
        (i, j): (usize, usize),
        rest: &mut f64,
        rng: &mut G,
    ) -> f64 {
        if j == 0 {
            *rest = 1.0;
        }
        if i == j {
            return *rest;
        }
        // z = 2 Beta(b, b) − 1 = tanh(½ ln(G/G')) for two gamma variables
        let y = 0.5 * (ln_gamma_draw(self.shape(j), rng) - ln_gamma_draw(self.shape(j), rng));
        let entry = *rest * y.tanh();
        *rest /= y.cosh();
        entry
    }
}
