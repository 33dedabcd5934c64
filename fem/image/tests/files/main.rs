//! Stacks of slices in files.

mod binning;
mod labels;
mod tiff;
