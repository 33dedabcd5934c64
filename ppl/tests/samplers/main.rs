//! The samplers against targets that are known exactly.

mod control;
mod delayed;
mod moments;
mod smc;
mod targets;
mod tuning;
mod walks;
