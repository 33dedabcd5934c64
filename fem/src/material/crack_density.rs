//! Regularised crack surface per volume, (1/(c₀ ℓ₀)) [α(φ) + ℓ₀² |∇φ|²].

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::number::Scalar;

/// Local part α of the crack density.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CrackDensity {
    /// Ambrosio–Tortorelli with α = φ², c₀ = 2: damage grows from the start of loading.
    ///
    /// Reference: Bourdin, Francfort & Marigo, J. Mech. Phys. Solids 48 (2000) 797,
    /// doi:10.1016/S0022-5096(99)00028-9.
    #[default]
    At2,
    /// Ambrosio–Tortorelli with α = φ, c₀ = 8/3: elastic up to a threshold, and damage vanishes at a finite distance
    /// from a crack. α′(0) > 0 would drive φ below zero, so φ is bounded: from above by one, and from below by zero
    /// or, with [`Irreversibility::ActiveSet`](super::Irreversibility::ActiveSet), by its previous value.
    ///
    /// Reference: Pham, Amor, Marigo & Maurini, Int. J. Damage Mech. 20 (2011) 618,
    /// doi:10.1177/1056789510386852.
    At1,
}

impl CrackDensity {
    /// Returns the normalising constant c₀, which makes the crack energy per area equal to the toughness.
    pub fn normaliser(self) -> f64 {
        match self {
            CrackDensity::At2 => 2.0,
            CrackDensity::At1 => 8.0 / 3.0,
        }
    }

    /// Returns α(φ), α′(φ), α″(φ).
    #[inline(always)]
    pub fn local<T: Scalar>(self, phi: T) -> [T; 3] {
        match self {
            CrackDensity::At2 => [phi * phi, phi + phi, phi.constant(2.0)],
            CrackDensity::At1 => [phi, phi.constant(1.0), phi.constant(0.0)],
        }
    }
}
