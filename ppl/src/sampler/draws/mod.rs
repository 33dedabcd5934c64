//! Draws of the chains, the report of the warmup, and the file of the chains.

pub(crate) mod chains;
pub(crate) mod encoding;
pub(crate) mod report;
pub(crate) mod store;
