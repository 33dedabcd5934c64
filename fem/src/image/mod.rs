//! Images of specimens: voxels from files, and grains from voxels.
//!
//! Grey values are rounded to 16 bits once; from there on all sums that decide anything are sums of
//! integers. So results depend neither on the number of threads nor on how the image lies.

mod basins;
mod components;
mod cylinder;
mod distance;
mod error;
mod filter;
mod fit;
mod grey;
mod hardening;
mod level;
mod outline;
mod regions;
mod score;
mod segment;
mod settings;
mod solid;
mod statistics;
mod surroundings;
mod threshold;
pub mod tiff;
mod volume;

pub use cylinder::Cylinder;
pub use error::ImageError;
pub use outline::{RgbSlice, outlined_slice};
pub use regions::Region;
pub use score::{Score, score};
pub use segment::Segmented;
pub use settings::{SeedRule, Segmentation, SpecimenForm};
pub use statistics::SpecimenStatistics;
pub use volume::Volume;
