//! Grains found in images whose grains are known.

mod lean;
#[path = "../support/phantom.rs"]
mod phantom;
mod scenes;
mod segment;
