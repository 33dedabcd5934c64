//! The specimen of a simulation: image, grains and mesh. The stages `segment` and `mesh` are two files of this module.

pub(crate) mod block;
pub(crate) mod build;
pub(crate) mod coarse_body;
pub(crate) mod damage_of;
pub(crate) mod image_inputs;
pub(crate) mod images;
pub(crate) mod levels;
pub(crate) mod mesh;
pub(crate) mod packings;
pub(crate) mod segment;
pub(crate) mod segmented_grains;
pub(crate) mod specimen_grains;
pub(crate) mod specimen_images;
pub(crate) mod virtual_bodies;
