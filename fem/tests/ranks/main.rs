//! Runs on several ranks. In these tests, the ranks are threads instead of processes.

#[path = "../support/mod.rs"]
#[expect(dead_code, reason = "each test uses only some of the functions")]
mod support;

mod curve;
mod resume;
