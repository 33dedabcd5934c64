//! Pictures as slices of a stack: one file for each slice.

use std::path::Path;

use crate::ImageError;
use crate::slices::sample::SampleType;
use crate::slices::voxel_size::VoxelSize;

/// Header of a picture.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Picture {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) sample: SampleType,
    pub(super) size: VoxelSize,
}

/// Returns an error that names the file of a picture.
pub(super) fn refused(path: &Path, message: String, help: &'static str) -> ImageError {
    ImageError::Page { path: path.into(), page: 1, message, help }
}

/// Converts colour pixels to grey values. The three colour values of each pixel must be equal.
///
/// # Errors
/// [`ImageError::Page`] with the first pixel whose colour values differ.
pub(super) fn equal_colours(
    path: &Path,
    colours: &[f64],
    into: &mut [f64],
) -> Result<(), ImageError> {
    for (at, (value, colour)) in into.iter_mut().zip(colours.chunks_exact(3)).enumerate() {
        if colour[0] != colour[1] || colour[1] != colour[2] {
            let message =
                format!("pixel {at} has the colours {}, {}, {}", colour[0], colour[1], colour[2]);
            return Err(refused(path, message, "save it in grey"));
        }
        *value = colour[0];
    }
    Ok(())
}
