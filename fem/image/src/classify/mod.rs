//! Classification of voxels as air, matrix and grain.

pub(crate) mod blurred;
pub(crate) mod curvature;
pub(crate) mod dark;
pub(crate) mod exchanged;
pub(crate) mod hardening;
pub(crate) mod level;
pub(crate) mod refine;
pub(crate) mod solid;
pub(crate) mod wall;
mod wall_error;
