//! Curves, fields of a run, and directories of runs.

mod curve;
mod ensemble;
mod shared_ensemble;
mod vtu;
