//! Stacks of slices in files.

mod binning;
mod formats;
mod stacks;
mod tiff;
mod zstd;
