//! Something that was found on a curve.

/// How much a finding matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// To be looked up.
    Note,
    /// To be told.
    Warning,
    /// Quantities of interest would be wrong.
    Error,
}

/// Something that was found on a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Its name in tables.
    pub name: &'static str,
    /// The number behind it; its unit is in the words.
    pub value: f64,
    /// What was found, a clause.
    pub problem: String,
    /// What to do, whole sentences.
    pub help: &'static str,
    pub weight: Weight,
}

/// Index of the largest value.
pub(super) fn largest(values: &[f64]) -> usize {
    (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0)
}
