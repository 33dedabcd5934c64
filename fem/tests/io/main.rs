//! Files: curves, fields for ParaView, and directories of ensembles.

mod curve;
mod ensemble;
mod shared_ensemble;
mod vtu;
