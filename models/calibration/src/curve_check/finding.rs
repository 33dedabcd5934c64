//! Findings of the checks of a curve.

/// Severity of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// Information, which is not shown as a warning.
    Note,
    /// Shown as a warning.
    Warning,
    /// The quantities of interest would be wrong.
    Error,
}

/// Finding of a check of a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Name of the finding in tables.
    pub name: &'static str,
    /// Value on which the finding is based; `problem` states its unit.
    pub value: f64,
    /// Description of the finding: a clause without subject.
    pub problem: String,
    /// Advice to the user in whole sentences.
    pub help: &'static str,
    pub weight: Weight,
}

/// Index of the largest value.
pub(super) fn largest(values: &[f64]) -> usize {
    (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0)
}
