//! Stacks of slices in any format: order of files, types of grey values, voxel sizes, continuity, and averages over
//! blocks of voxels.
//!
//! The modules in the order of their layers; a module imports from lower layers only.
//!
//! 1. `sample`: number type of a voxel
//! 2. `voxel_size`: voxel sizes stated in files
//! 3. `names`: order of files by their names
//! 4. `stack`: a stack whose headers have been read
//! 5. `raw`: values without a header
//! 6. `header`: description of a stack
//! 7. `values`: values of a stack
//! 8. `continuity`: faulty sequences of slices

pub(crate) mod continuity;
pub(crate) mod header;
pub(crate) mod names;
pub(crate) mod raw;
pub(crate) mod sample;
pub(crate) mod stack;
pub(crate) mod values;
pub(crate) mod voxel_size;
