//! Single grains in the voxels of the grain phase, and their measurements.

pub(crate) mod basins;
pub(crate) mod regions;
pub(crate) mod score;
pub(crate) mod statistics;
