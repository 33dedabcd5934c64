//! Rules on the results: what makes an identified value doubtful although the sampler has nothing to warn of.
//!
//! A rule is a file beside this one and a line in [`RULES`]. Each has one bound, and a test on both sides of it.

mod fit;
mod influence;
mod mesh;
mod microstructure;

use super::rule::Rule;

/// All rules, in the order of their warnings.
pub(super) const RULES: [Rule; 5] =
    [fit::AT_THE_SURROGATE, fit::SIMULATED, mesh::RULE, microstructure::RULE, influence::RULE];
