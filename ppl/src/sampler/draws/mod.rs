//! Draws of the chains, and the file of the chains.

pub(crate) mod chains;
pub(crate) mod store;
