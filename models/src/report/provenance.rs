//! Date, settings and input files of the results.

/// Date of the results, version of the program, machine, and input files.
#[derive(Clone, Debug, Default)]
pub(crate) struct Provenance {
    /// Day of the newest result, UTC, as YYYY-MM-DD.
    pub(crate) date: String,
    /// Version of the program.
    pub(crate) version: String,
    /// Operating system, architecture and number of hardware threads of the machine that writes the report.
    pub(crate) machine: String,
    /// Input files: files that a stage has read and that no stage has written.
    pub(crate) inputs: Vec<InputFile>,
}

/// A file from which the results were computed.
#[derive(Clone, Debug)]
pub(crate) struct InputFile {
    /// Name relative to the results folder; the file name alone if the file is outside of the results folder.
    pub(crate) name: String,
    /// Hash of the content.
    pub(crate) hash: String,
}

/// A key of the case whose value differs from its default.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ChangedKey {
    /// Key with its tables, separated by dots.
    pub(crate) key: String,
    /// Value as TOML.
    pub(crate) value: String,
    /// Default as TOML; `None` if the key has no default.
    pub(crate) default: Option<String>,
}

/// Settings that the methods paragraph states.
#[derive(Clone, Debug, Default)]
pub(crate) struct Methods {
    /// Version of the program.
    pub(crate) version: String,
    /// Sentence on the source of runs from outside this program; `None` for the built-in simulation.
    pub(crate) outside: Option<String>,
    /// Damage model; `None` if all regions are elastic.
    pub(crate) damage: Option<DamageModel>,
    /// Order of the elements in words.
    pub(crate) elements: String,
    /// Method of the design.
    pub(crate) design: String,
    /// Selection of the terms of the surrogate.
    pub(crate) terms: String,
    /// Rule that chose the order.
    pub(crate) order_rule: String,
    pub(crate) chains: usize,
    pub(crate) warmup: usize,
    pub(crate) draws: usize,
    /// Burn-in and thinning in words; empty without them.
    pub(crate) thinning: String,
    pub(crate) target_accept: f64,
    pub(crate) seed: u64,
}

/// Settings of the phase-field model.
#[derive(Clone, Debug, Default)]
pub(crate) struct DamageModel {
    /// Local part of the crack density.
    pub(crate) model: String,
    /// Part of the energy that damage degrades.
    pub(crate) split: String,
    pub(crate) irreversibility: String,
    /// Regularisation length, mm.
    pub(crate) length_mm: f64,
}
