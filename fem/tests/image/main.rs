//! Images: stacks from files, and grains from stacks.

#[path = "../support/phantom.rs"]
mod phantom;
mod segment;
mod tiff;
