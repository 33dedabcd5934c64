//! Toughness of a band around a crack, for a given effective toughness.
//!
//! One-dimensional problem: a crack lies in the middle of a band of half-width w and toughness G̃, in a body of
//! toughness G_b. On a mesh, φ = 1 in one row of elements of thickness t on one side of the middle, and the profile
//! starts at the end of this row. The crack energy per area of one side is
//! E(G̃) = k t G̃ + H(G̃, w − t), where H is the minimum of (1/c₀) ∫ G(x) (α(φ)/ℓ + ℓ φ′²) dx with φ = 1 at the start.
//! Here, c₀ is 2 for AT2 and 8/3 for AT1, and k = 1/(c₀ ℓ) is the energy of a fully damaged layer per thickness and
//! toughness. For one toughness everywhere, H = G/2.
//!
//! AT2, with T = tanh(w/ℓ): H = ½ G̃ (G̃ T + G_b)/(G̃ + G_b T).
//! AT1: φ is quadratic in x, and zero beyond a finite distance; see [`half_energy`].
//!
//! Idea: Hansen-Dörr, de Borst, Hennig & Kästner, Comput. Methods Appl. Mech. Engrg. 346 (2019) 25,
//! doi:10.1016/j.cma.2018.11.028.

use crate::material::CrackDensity;

/// Number of halvings of the interval of ln G̃ for AT1; more do not change a number of double precision.
const HALVINGS: u32 = 80;

/// One side of a crack along the middle of a band. Lengths are relative to ℓ.
#[derive(Clone, Copy, Debug)]
pub(super) struct BandSide {
    /// Toughness G_b of the region, N/mm.
    pub(super) bulk: f64,
    /// Half-width w/ℓ of the band.
    pub(super) half_width: f64,
    /// Thickness t/ℓ of the broken elements; less than the half-width, or zero without mesh.
    pub(super) broken: f64,
}

impl BandSide {
    /// Returns the crack energy per area of this side, N/mm, if the band has the toughness `band` (N/mm).
    pub(super) fn energy(&self, density: CrackDensity, band: f64) -> f64 {
        let row = self.broken * band / density.normaliser();
        row + half_energy(density, band, self.bulk, self.half_width - self.broken)
    }

    /// Returns the toughness of the band (N/mm) for which the crack energy per area of this side is `energy` (N/mm).
    /// `energy` and the toughness of the region must be positive.
    pub(super) fn toughness(&self, density: CrackDensity, energy: f64) -> f64 {
        match density {
            CrackDensity::At2 => self.at2(energy),
            CrackDensity::At1 => self.at1(energy),
        }
    }

    /// Solves the quadratic equation k t G̃ (G̃ + G_b T) + ½ G̃ (G̃ T + G_b) = E (G̃ + G_b T).
    fn at2(&self, energy: f64) -> f64 {
        let tanh = (self.half_width - self.broken).tanh();
        let row = self.broken / CrackDensity::At2.normaliser();
        let square = row + 0.5 * tanh;
        let linear = row * self.bulk * tanh + 0.5 * self.bulk - energy;
        let constant = energy * self.bulk * tanh;
        let root = linear.hypot(2.0 * (square * constant).sqrt());
        // of two equal expressions, the one without cancellation
        if linear > 0.0 {
            2.0 * constant / (linear + root)
        } else {
            (root - linear) / (2.0 * square)
        }
    }

    /// Finds the toughness by bisection: the energy increases with the toughness of the band.
    fn at1(&self, energy: f64) -> f64 {
        let mut low = (1e-12 * energy.min(self.bulk)).ln();
        let mut high = (1e12 * energy.max(self.bulk)).ln();
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let is_below = self.energy(CrackDensity::At1, middle.exp()) < energy;
            if is_below { low = middle } else { high = middle }
        }
        (0.5 * (low + high)).exp()
    }
}

/// Returns H, the minimum of the crack energy per area of one side, N/mm, for a band of the width `width` (relative to
/// ℓ) and the toughness `band` in front of a region of the toughness `bulk`, N/mm.
fn half_energy(density: CrackDensity, band: f64, bulk: f64, width: f64) -> f64 {
    match density {
        CrackDensity::At2 => {
            let tanh = width.tanh();
            0.5 * band * (band * tanh + bulk) / (band + bulk * tanh)
        }
        // the profile φ = (1 − x/2ℓ)² ends within the band
        CrackDensity::At1 if width >= 2.0 => 0.5 * band,
        CrackDensity::At1 => {
            // beyond the band, φ′ = −√φ/ℓ. In the band, at the distance s ℓ from its end, φ = p + r √p s + s²/4 with
            // r = G_b/G̃, from G̃ φ′ = G_b φ′ at the end; p follows from φ = 1 at the start
            let ratio = bulk / band;
            let root = (ratio * width).hypot((4.0 - width * width).sqrt());
            let slope = 0.5 * (4.0 - width * width) / (ratio * width + root);
            let inner = slope * slope * width * (1.0 + ratio * ratio)
                + ratio * slope * width * width
                + width.powi(3) / 6.0;
            0.375 * band * inner + 0.5 * bulk * slope.powi(3)
        }
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/band_toughness.rs"]
mod tests;
