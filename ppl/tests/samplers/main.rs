//! The samplers against targets that are known exactly.

mod control;
mod moments;
mod targets;
mod tuning;
