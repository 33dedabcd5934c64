//! Tests of stacks of slices in files.

mod binning;
mod formats;
mod hdf5;
mod labels;
mod stacks;
mod tiff;
mod zstd;
