//! Rules on the results, which restrict the verdict "identified" for reasons that sampler diagnostics cannot show.
//!
//! Each rule is a module in this folder and an entry in [`RULES`]. The tests of a rule check its threshold from both
//! sides.

pub(super) mod fit;
mod influence;
mod mesh;
mod microstructure;
mod toe;
mod unusable_runs;
mod validation;

use super::rule::Rule;

/// All rules, in the order of their warnings.
pub(super) const RULES: [Rule; 8] = [
    fit::AT_THE_SURROGATE,
    fit::SIMULATED,
    toe::RULE,
    unusable_runs::RULE,
    mesh::RULE,
    microstructure::RULE,
    influence::RULE,
    validation::RULE,
];
