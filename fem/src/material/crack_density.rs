//! The regularised crack surface per volume, (1/(c₀ ℓ₀)) [α(φ) + ℓ₀² |∇φ|²].

/// The local part α of the crack density.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CrackDensity {
    /// Ambrosio–Tortorelli with α = φ², c₀ = 2: damage grows from the first load on.
    ///
    /// Reference: Bourdin, Francfort & Marigo, J. Mech. Phys. Solids 48 (2000) 797,
    /// doi:10.1016/S0022-5096(99)00028-9.
    At2,
}

impl CrackDensity {
    /// c₀, which makes the crack energy per area equal to the toughness.
    pub(crate) fn normaliser(self) -> f64 {
        match self {
            CrackDensity::At2 => 2.0,
        }
    }

    /// α(φ), α′(φ), α″(φ).
    pub(crate) fn local(self, phi: f64) -> [f64; 3] {
        match self {
            CrackDensity::At2 => [phi * phi, 2.0 * phi, 2.0],
        }
    }
}
