//! Images of specimens: voxels from files, and grains from voxels.
//!
//! [`read`] reads a stack into a [`Volume`]; [`Segmentation`] finds the specimen, its phases and its grains in a
//! volume. Grey values are rounded to 16 bits once. Later decisions depend only on sums of integers. Therefore results
//! depend neither on the number of threads nor on the orientation of the image. The crate `fem` re-exports all items of
//! this crate.
//!
//! ```
//! use fem_image::{Segmentation, SpecimenForm, Volume};
//!
//! // a bright ball with a radius of 14 voxels in a dark block
//! let side = 48;
//! let mut grey = vec![8000.0_f32; side * side * side];
//! for (i, value) in grey.iter_mut().enumerate() {
//!     let centred = [i % side, i / side % side, i / (side * side)].map(|c| c as f64 - 23.5);
//!     if centred.iter().map(|c| c * c).sum::<f64>() < 196.0 {
//!         *value = 30_000.0;
//!     }
//! }
//! let volume = Volume::new([side; 3], 0.05, grey)?;
//! let segmentation = Segmentation { specimen: SpecimenForm::Block, ..Segmentation::default() };
//! let segmented = segmentation.run(&volume, &mut |_| ())?;
//! assert_eq!(segmented.regions.len(), 1);
//! # Ok::<(), fem_image::ImageError>(())
//! ```
//!
//! # Modules
//!
//! The modules in the order of their layers. A module imports from lower layers only, and no two files import each
//! other.
//!
//! 1. `error`, `listing`: errors of reading, writing and segmenting images; lists of examples in messages
//! 2. `volume`: voxels, filters, distances, connected components
//! 3. `slices`: order of slices, types of values, voxel sizes, continuity
//! 4. `tiff`: stacks in TIFF files
//! 5. `formats`: other formats, and the choice by content
//! 6. `locate`: location of the specimen in the image
//! 7. `classify`: classification of voxels as air, matrix and grain
//! 8. `grains`: single grains, their sizes, and scores against a reference segmentation
//! 9. `segment`: the sequence of steps from grey values to grains
//! 10. `labels`: specimens with labels given by the user

mod classify;
mod error;
mod formats;
mod grains;
mod labels;
mod listing;
mod locate;
mod segment;
mod slices;
pub mod tiff;
mod volume;

pub use error::ImageError;
pub use formats::read::{files_of, read, read_label_values, read_labels};
pub use grains::regions::Region;
pub use grains::score::{Score, score};
pub use grains::statistics::SpecimenStatistics;
pub use labels::rules::{LabelPhase, LabelRules, MATRIX, VOID};
pub use labels::specimen::LabelledSpecimen;
#[doc(hidden)] // `fem-mesh` lists examples in the same words
pub use listing::listed;
pub use locate::region::SpecimenRegion;
pub use locate::specimen::SpecimenForm;
pub use segment::Segmented;
pub use segment::outline::{RgbSlice, outlined_slice};
pub use segment::settings::{SeedRule, Segmentation};
pub use slices::header::{ReadOptions, StackHeader};
pub use slices::values::Reading;
pub use volume::Volume;
pub use volume::contrast::Contrast;
pub use volume::cylinder::Cylinder;
#[doc(hidden)] // `fem-mesh` uses the same union–find
pub use volume::disjoint_sets::DisjointSets;
