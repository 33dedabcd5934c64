//! A Prony series, its moduli and its lines in a case.

use std::fmt::Write as _;

/// Prony series G(t) = G∞ + Σ G_i e^(−t/τ_i) of a relaxation modulus.
#[derive(Clone, Debug, PartialEq)]
pub struct PronySeries {
    /// Long-term modulus G∞ in MPa.
    pub long_term_mpa: f64,
    /// Terms, in the order of their times.
    pub terms: Vec<PronyTerm>,
}

/// Term of a Prony series.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PronyTerm {
    /// Modulus G_i in MPa.
    pub modulus_mpa: f64,
    /// Relaxation time τ_i in s.
    pub time_s: f64,
}

impl PronySeries {
    /// Returns the instantaneous modulus G(0) in MPa.
    pub fn instantaneous_mpa(&self) -> f64 {
        self.long_term_mpa + self.terms.iter().map(|term| term.modulus_mpa).sum::<f64>()
    }

    /// Returns the relaxation modulus G(t) in MPa.
    pub fn relaxation_mpa(&self, time_s: f64) -> f64 {
        let decaying = |term: &PronyTerm| term.modulus_mpa * (-time_s / term.time_s).exp();
        self.long_term_mpa + self.terms.iter().map(decaying).sum::<f64>()
    }

    /// Returns storage and loss modulus in MPa at the angular frequency ω in 1/s:
    /// G′ = G∞ + Σ G_i ω²τ_i²/(1 + ω²τ_i²) and G″ = Σ G_i ωτ_i/(1 + ω²τ_i²).
    pub fn complex_mpa(&self, angular_frequency_per_s: f64) -> [f64; 2] {
        let mut moduli = [self.long_term_mpa, 0.0];
        for term in &self.terms {
            let x = angular_frequency_per_s * term.time_s;
            moduli[0] += term.modulus_mpa * x * x / (1.0 + x * x);
            moduli[1] += term.modulus_mpa * x / (1.0 + x * x);
        }
        moduli
    }

    /// Returns the series as lines of a table `[material.<region>]` of a case, with four digits. The fractions refer
    /// to the instantaneous modulus; their sum is below 1.
    pub fn to_toml(&self) -> String {
        let whole = self.instantaneous_mpa();
        let mut text = format!("# instantaneous modulus {} MPa\n", digits(whole));
        text.push_str("viscoelastic.moduli = \"instantaneous\"\nviscoelastic.shear = [\n");
        for term in &self.terms {
            // rounded down, so that the sum of the fractions stays below 1
            let fraction = (1e6 * term.modulus_mpa / whole).floor() / 1e6;
            let time_s = digits(term.time_s);
            let _ = writeln!(text, "  {{ fraction = {fraction:?}, time_s = {time_s} }},");
        }
        text.push_str("]\n");
        text
    }
}

/// Writes a number with four significant digits, as a TOML float.
fn digits(x: f64) -> String {
    let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
    format!("{rounded:?}")
}
