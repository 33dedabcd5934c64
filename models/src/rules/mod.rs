//! Rules on the results, which restrict the verdict "identified" for reasons that sampler diagnostics cannot show.
//!
//! Each rule is a module in this folder and an entry in [`RULES`]. The tests of a rule check its threshold from both
//! sides.

pub(crate) mod fit;
mod influence;
mod mesh;
mod microstructure;
pub(crate) mod rule;
mod toe;
mod unusable_runs;
mod validation;
pub(crate) mod warnings;

use rule::Rule;

/// All rules, in the order of their warnings.
pub(crate) const RULES: [Rule; 8] = [
    fit::AT_THE_SURROGATE,
    fit::SIMULATED,
    toe::RULE,
    unusable_runs::RULE,
    mesh::RULE,
    microstructure::RULE,
    influence::RULE,
    validation::RULE,
];
