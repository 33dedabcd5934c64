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

    /// Returns the series as lines of a table `[material.<region>]` of a case: the modulus and the times with four
    /// significant digits, the fractions with six. The fractions refer to the instantaneous modulus; their sum is below 1.
    pub fn to_toml(&self) -> String {
        let whole = self.instantaneous_mpa();
        let mut text = format!("# instantaneous modulus {} MPa\n", digits(whole));
        text.push_str("viscoelastic.moduli = \"instantaneous\"\nviscoelastic.shear = [\n");
        let moduli: Vec<f64> = self.terms.iter().map(|term| term.modulus_mpa / whole).collect();
        for (term, fraction) in self.terms.iter().zip(rounded_down(&moduli)) {
            let time_s = digits(term.time_s);
            let _ = writeln!(text, "  {{ fraction = {fraction:?}, time_s = {time_s} }},");
        }
        text.push_str("]\n");
        text
    }
}

/// Number of significant digits of a fraction.
const DIGITS: i32 = 6;
/// Smallest difference of 1 and the sum of the written fractions; a case with a smaller difference is refused.
const LEAST_REST: f64 = 1e-8;

/// Rounds fractions down to six significant digits, so that their sum stays below 1.
fn rounded_down(fractions: &[f64]) -> Vec<f64> {
    let mut rounded: Vec<f64> = fractions.iter().map(|&x| below(x, x)).collect();
    while 1.0 - rounded.iter().sum::<f64>() < LEAST_REST {
        let Some(largest) = rounded.iter_mut().max_by(|a, b| a.total_cmp(b)) else { break };
        *largest = below(*largest, *largest * (1.0 - 0.1f64.powi(DIGITS)));
    }
    rounded
}

/// Returns the largest number that is at most `most` and has as many decimals as `x` has with six significant digits.
fn below(x: f64, most: f64) -> f64 {
    let decimals = DIGITS - 1 - x.log10().floor() as i32;
    let unit = 10f64.powi(decimals);
    // the shortest text of the quotient has at most six digits
    let written = |steps: f64| format!("{steps:.0}e{}", -decimals).parse().unwrap_or(most);
    let steps = (most * unit).floor();
    let candidates = [steps + 1.0, steps, steps - 1.0].map(written);
    candidates.into_iter().find(|&candidate| candidate <= most).unwrap_or(most)
}

/// Writes a number with four significant digits, as a TOML float.
fn digits(x: f64) -> String {
    let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
    format!("{rounded:?}")
}
