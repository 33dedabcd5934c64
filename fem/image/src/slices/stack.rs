//! A stack whose headers have been read, and readers of its slices.

use std::fmt::Debug;
use std::path::PathBuf;

use super::sample::SampleType;
use super::voxel_size::VoxelSize;
use crate::ImageError;

/// A stack whose values have not been read yet.
#[derive(Debug)]
pub(crate) struct Stack {
    /// The file or folder given by the user.
    pub(crate) path: PathBuf,
    /// All files from which values and headers are read.
    pub(crate) files: Vec<PathBuf>,
    /// Voxels along x, y, z.
    pub(crate) shape: [usize; 3],
    pub(crate) sample: SampleType,
    /// Voxel size stated in the files.
    pub(crate) size: VoxelSize,
    /// Format, files, pages and their order, as text for messages.
    pub(crate) contents: String,
    /// Possible causes of a wrong result.
    pub(crate) notes: Vec<String>,
    pub(crate) source: Box<dyn SliceSource>,
}

/// Source of the slices of a stack, shared by threads.
pub(crate) trait SliceSource: Debug + Send + Sync {
    /// Creates a reader for one thread.
    fn reader(&self) -> Box<dyn SliceReader + '_>;

    /// Returns the file of a slice and the page number (from 1) in this file, for messages.
    fn file_and_page(&self, slice: usize) -> (PathBuf, usize);
}

/// Reader of slices; reading in ascending order is the fastest.
pub(crate) trait SliceReader {
    /// Reads the values of a slice.
    ///
    /// # Errors
    /// [`ImageError`] for a slice that cannot be read or is truncated.
    fn read(&mut self, slice: usize, into: &mut [f64]) -> Result<(), ImageError>;
}
