//! Models, the contexts that evaluate them, and models bound to their data.

pub(crate) mod backend;
pub(crate) mod bound;
pub(crate) mod context;
pub(crate) mod erased;
pub(crate) mod evaluation;
pub(crate) mod inspect;
pub(crate) mod start;
pub(crate) mod submodel;
pub(crate) mod trace;
pub(crate) mod unknowns_from;
