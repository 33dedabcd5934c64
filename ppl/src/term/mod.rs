//! Terms of a log density: formulas with their partial derivatives, and the accumulators that add them.

pub(crate) mod accumulator;
pub(crate) mod dot;
pub(crate) mod formula;
pub(crate) mod literal;
pub(crate) mod operand;
pub(crate) mod parameter;
pub(crate) mod plate;
