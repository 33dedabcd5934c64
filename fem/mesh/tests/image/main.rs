//! Tests of the segmentation of images with known grains.

#[path = "../support/agreement.rs"]
mod agreement;
mod known_volumes;
mod lean;
#[path = "../support/phantom.rs"]
mod phantom;
mod scenes;
mod segment;
#[path = "../support/specimen.rs"]
mod specimen;
#[path = "../support/specimens.rs"]
mod specimens;
