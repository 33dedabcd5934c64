//! Reports of a chain: statistics of its draws and of its warmup, and the reason why it stopped.

pub(crate) mod encoding;
pub(crate) mod report;
pub(crate) mod stop;
