//! Samplers and optimisers on targets with exactly known moments or modes.

mod calibration;
mod control;
mod delayed;
#[allow(dead_code)] // the bench `warmup` uses all of them
mod kinds;
mod moments;
mod optimize;
mod own_kernel;
mod prior_starts;
mod resume;
mod starts;
mod targets;
mod tuning;
