//! Toughness of a band around a crack, for a given effective toughness.
//!
//! One-dimensional problem: a crack lies along the middle of a band of half-width w and toughness G̃, in a body of
//! toughness G_b. On a mesh, φ = 1 in one row of elements of thickness h on one side of the middle, and the profile on
//! this side starts at the end of the row. The crack energy per area is
//! E(G̃) = k h G̃ + H(G̃, w − h) + H(G̃, w), where H is the minimum of (1/c₀) ∫ G(x) (α(φ)/ℓ + ℓ φ′²) dx with φ = 1 at the
//! start. The last term is omitted if the other side of the interface cannot break. Here, c₀ is 2 for AT2 and 8/3 for AT1,
//! and k = 1/(c₀ ℓ). For one toughness everywhere, H = G/2 and E = G (1 + k h): every crack on a mesh has this factor.
//!
//! AT2, with T = tanh(w/ℓ): H = ½ G̃ (G̃ T + G_b)/(G̃ + G_b T).
//! AT1: φ is quadratic in x, and zero beyond a finite distance; see [`half_energy`].
//!
//! Idea: Hansen-Dörr, de Borst, Hennig & Kästner, Comput. Methods Appl. Mech. Engrg. 346 (2019) 25,
//! doi:10.1016/j.cma.2018.11.028.

use crate::material::CrackDensity;

/// Number of halvings of the interval of ln G̃. Further halvings do not change a double-precision
/// number.
const HALVINGS: u32 = 80;

/// Band around a crack. Lengths are relative to ℓ.
#[derive(Clone, Copy, Debug)]
pub(super) struct Band {
    /// Toughness G_b of the region, N/mm.
    pub(super) bulk: f64,
    /// Half-width w/ℓ of the band.
    pub(super) half_width: f64,
    /// Thickness h/ℓ of the row of broken elements; less than the half-width, or zero if there is
    /// no mesh.
    pub(super) row: f64,
    /// Whether the band is on both sides of the crack.
    pub(super) two_sided: bool,
}

impl Band {
    /// Returns the crack energy per area, N/mm, if the band has the toughness `band` (N/mm).
    pub(super) fn energy(&self, density: CrackDensity, band: f64) -> f64 {
        let Self { bulk, half_width, row, two_sided } = *self;
        let broken = row * band / density.normaliser();
        let other = if two_sided { half_energy(density, band, bulk, half_width) } else { 0.0 };
        broken + half_energy(density, band, bulk, half_width - row) + other
    }

    /// Returns the toughness of the band (N/mm) for which a crack has the effective toughness `effective` (N/mm). On a
    /// mesh, the crack energy is `effective` times the factor 1 + k h of every crack. `bulk` and `effective` must be
    /// positive.
    ///
    /// The crack energy increases with the toughness of the band, so that bisection finds the toughness.
    pub(super) fn toughness(&self, density: CrackDensity, effective: f64) -> f64 {
        let energy = effective * (1.0 + self.row / density.normaliser());
        let mut low = (1e-12 * effective.min(self.bulk)).ln();
        let mut high = (1e12 * effective.max(self.bulk)).ln();
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            let is_below = self.energy(density, middle.exp()) < energy;
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
