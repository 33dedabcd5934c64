//! Volumes from TIFF stacks.

use std::path::{Path, PathBuf};

use super::stack::{scan, slices_of};
use crate::slices::header::ReadOptions;
use crate::slices::names::order;
use crate::slices::stack::Stack;
use crate::slices::values;
use crate::{ImageError, Volume};

/// Reads a stack of grey values: a file of many pages, or a folder whose `.tif` and `.tiff` files are
/// the slices in the order of the numbers in their names (`slice9` before `slice10`).
///
/// Page after page is z. The edge of a voxel is `voxel_mm`, or stands in the tags of the first page.
/// Pages that are marked as smaller copies of others are left out. Pages are decoded in parallel.
///
/// # Errors
/// [`ImageError`] with file and page: no pages, pages of unlike size or type, colours, pages cut short, fewer
/// pages than are declared, several channels or times, slices that are missing or named by no single series,
/// values that are no numbers, voxels that are no cubes, no voxel size, more voxels than can be numbered.
///
/// # References
/// TIFF, revision 6.0, Adobe 1992.
pub fn read(path: &Path, voxel_mm: Option<f64>) -> Result<Volume<f32>, ImageError> {
    read_binned(path, voxel_mm, 1)
}

/// Reads a stack of grey values, see [`read`], and takes the mean of each block of `bin` × `bin` × `bin`
/// voxels for one voxel, for stacks that are larger than the memory or finer than they need be.
///
/// `voxel_mm` and the tags are those of the stack; the voxels that come back are `bin` times as wide. Along
/// each axis the last voxels that fill no block, fewer than `bin`, are left out: so every voxel is a cube
/// that is wholly known, and its distance from the corner of the image is true.
///
/// The stack is read in slabs of `bin` pages, of which only the sums are kept. So the memory is that of the
/// reduced volume (4 bytes a voxel) and, for each thread, of one page as it is stored, the same page as
/// numbers of 12 bytes, and one reduced slice of 8 bytes a voxel, however large the stack is.
///
/// # Errors
/// As of [`read`], where only the voxels that are left are counted; a `bin` of 0, and one that is larger
/// than the shortest edge.
pub fn read_binned(
    path: &Path,
    voxel_mm: Option<f64>,
    bin: usize,
) -> Result<Volume<f32>, ImageError> {
    Ok(values::grey(&stack(path)?, &ReadOptions { voxel_mm, bin })?.volume)
}

/// Reads a stack of labels; see [`read`].
///
/// # Errors
/// As of [`read`], and values that are no whole numbers from 0 to 2³² − 1.
pub fn read_labels(path: &Path, voxel_mm: Option<f64>) -> Result<Volume<u32>, ImageError> {
    Ok(values::labels(&stack(path)?, voxel_mm)?.volume)
}

fn stack(path: &Path) -> Result<Stack, ImageError> {
    if !path.is_dir() {
        return scan(path, vec![PathBuf::from(path)], None);
    }
    let ordered = order(path, slices_of(path)?)?;
    scan(path, ordered.paths.clone(), Some(&ordered))
}
