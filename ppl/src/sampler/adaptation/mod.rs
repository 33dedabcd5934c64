//! Adaptation of proposals and of the screening, and the adapted state of every sampler, from which a run can be resumed.

pub(crate) mod proposal;
pub(crate) mod screening;
pub(crate) mod tuning;
