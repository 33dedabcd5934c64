//! Stacks of slices in files.

mod binning;
mod formats;
mod labels;
mod stacks;
mod tiff;
mod zstd;
