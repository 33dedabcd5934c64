//! Stacks of slices in any format: order of files, types of grey values, voxel sizes, continuity, and averages over
//! blocks of voxels.

pub(crate) mod continuity;
pub(crate) mod header;
pub(crate) mod names;
pub(crate) mod raw;
pub(crate) mod sample;
pub(crate) mod stack;
pub(crate) mod values;
pub(crate) mod voxel_size;
