//! Stacks of slices in files.

mod binning;
mod tiff;
