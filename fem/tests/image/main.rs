//! Images: stacks from files, and grains from stacks.

mod binning;
mod lean;
#[path = "../support/phantom.rs"]
mod phantom;
mod scenes;
mod segment;
mod tiff;
