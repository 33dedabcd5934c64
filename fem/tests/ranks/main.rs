//! Runs that several ranks share: here threads in the place of processes.

#[path = "../support/mod.rs"]
#[expect(dead_code, reason = "each user takes a part")]
mod support;

mod curve;
mod resume;
