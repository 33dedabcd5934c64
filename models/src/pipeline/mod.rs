//! What a running stage gets: inputs that are recorded when they are read, and the products that it may write.
//!
//! A stage is a [`stage::Stage`] of the table in `stages/table.rs`. It runs as a [`task::Task`], which has its
//! [`inputs::Inputs`]. The recorded inputs decide whether the stage has to run again (`freshness`), and whether a
//! neighbouring results folder has the same products (`neighbours`).

pub(crate) mod adoption;
pub(crate) mod extensions;
pub(crate) mod freshness;
pub(crate) mod gate;
pub(crate) mod inputs;
pub(crate) mod neighbours;
pub(crate) mod run_key;
pub(crate) mod stage;
pub(crate) mod task;
