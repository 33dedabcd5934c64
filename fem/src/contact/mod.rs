//! Rigid platens.

mod sliding;

pub(crate) use sliding::SlidingPlatens;
