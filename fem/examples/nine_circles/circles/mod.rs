//! The nine problems, the three laws, and the criteria.

pub(crate) mod growth;
pub(crate) mod law;
pub(crate) mod mediated;
pub(crate) mod plate;
pub(crate) mod uniform;
pub(crate) mod viscosity;

use std::error::Error;

pub(crate) use law::Law;

/// Computation of a problem with a law.
pub(crate) type Run = fn(Law) -> Result<Verdict, Box<dyn Error>>;

/// Names of the problems, in the order of the table.
pub(crate) const PROBLEMS: [(&str, Run); 9] = [
    ("uniaxial", uniform::uniaxial),
    ("biaxial", uniform::biaxial),
    ("torsion", uniform::torsion),
    ("pure-shear", growth::pure_shear),
    ("double-cantilever", growth::double_cantilever),
    ("trousers", growth::trousers),
    ("edge-notch", mediated::edge_notch),
    ("indentation", mediated::indentation),
    ("poker-chip", mediated::poker_chip),
];

/// Result of a problem with a law, and its comparison with the reference.
#[derive(Clone, Debug)]
pub(crate) struct Verdict {
    /// Computed value.
    pub(crate) value: f64,
    /// Unit of value and reference.
    pub(crate) unit: &'static str,
    /// Exact value, or the bound with which the deviation is computed.
    pub(crate) reference: f64,
    /// Whether the criterion of the problem is met.
    pub(crate) passed: bool,
    /// Reason in a few words.
    pub(crate) reason: String,
}

impl Verdict {
    pub(crate) const HEADER: &'static str = "| problem | law | value | reference | deviation | result | reason |\n|---|---|---|---|---|---|---|";

    /// Compares a value with an exact reference; `tolerance` is relative.
    pub(crate) fn compare(
        value: f64,
        unit: &'static str,
        reference: f64,
        tolerance: f64,
        reason: String,
    ) -> Self {
        let passed = (value - reference).abs() <= tolerance * reference;
        Self { value, unit, reference, passed, reason }
    }

    /// Returns the row of the table.
    pub(crate) fn row(&self, problem: &str, law: Law) -> String {
        let Self { value, unit, reference, passed, reason } = self;
        let deviation = 100.0 * (value / reference - 1.0);
        let result = if *passed { "passed" } else { "failed" };
        format!(
            "| {problem} | {} | {value:.4} {unit} | {reference:.4} {unit} | {deviation:+.1} % | {result} | {reason} |",
            law.name()
        )
    }
}
