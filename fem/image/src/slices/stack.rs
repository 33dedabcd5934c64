//! A stack whose headers have been read, and the reader of its slices.

use std::fmt::Debug;
use std::path::PathBuf;

use super::sample::SampleType;
use super::voxel_size::VoxelSize;
use crate::ImageError;

/// A stack before its values are read.
#[derive(Debug)]
pub(crate) struct Stack {
    /// The file or folder that was named.
    pub(crate) path: PathBuf,
    /// All files that the values and the headers come from.
    pub(crate) files: Vec<PathBuf>,
    /// Voxels along x, y, z.
    pub(crate) shape: [usize; 3],
    pub(crate) sample: SampleType,
    /// What the files state.
    pub(crate) size: VoxelSize,
    /// Format, files, pages and their order, in words.
    pub(crate) contents: String,
    /// What may make the result wrong.
    pub(crate) notes: Vec<String>,
    pub(crate) source: Box<dyn SliceSource>,
}

/// Files that slices are read from, shared by threads.
pub(crate) trait SliceSource: Debug + Send + Sync {
    /// A reader for one thread.
    fn reader(&self) -> Box<dyn SliceReader + '_>;

    /// The file of a slice and its page there, both for messages.
    fn place(&self, slice: usize) -> (PathBuf, usize);
}

/// Reads slices, fastest in ascending order.
pub(crate) trait SliceReader {
    /// Reads the values of a slice.
    ///
    /// # Errors
    /// [`ImageError`] for a slice that cannot be read or is cut short.
    fn read(&mut self, slice: usize, into: &mut [f64]) -> Result<(), ImageError>;
}
