//! Reader of volumes from TIFF stacks.

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
/// Pages follow each other along z. The edge of a voxel is `voxel_mm`, or is read from the tags of the first page.
/// Pages that are marked as reduced copies of other pages are omitted. Pages are decoded in parallel.
///
/// # Errors
/// [`ImageError`] with file and page: no pages, pages of different size or type, colours, truncated pages, fewer pages
/// than declared, several channels or times, missing slices or slices of several series, values that are not finite,
/// voxels that are not cubes, no voxel size, more voxels than can be numbered.
///
/// # References
/// TIFF, revision 6.0, Adobe 1992.
pub fn read(path: &Path, voxel_mm: Option<f64>) -> Result<Volume<f32>, ImageError> {
    read_binned(path, voxel_mm, 1)
}

/// Reads a stack of grey values, see [`read`], and averages each block of `bin` × `bin` × `bin` voxels to one voxel,
/// for stacks that exceed the memory or have a finer resolution than necessary.
///
/// `voxel_mm` and the tags refer to the stored stack; the edge of the returned voxels is `bin` times as long. Along
/// each axis the last voxels that do not fill a block (fewer than `bin`) are omitted. Every returned voxel is therefore
/// a cube averaged from a complete block, and its distance from the corner of the image is exact.
///
/// The stack is read in slabs of `bin` pages, and only the sums of a slab are stored. Apart from the reduced volume (4
/// bytes per voxel), the memory does not depend on the number of pages. Each thread needs memory for one page as
/// stored, the same page as numbers (12 bytes per voxel), and one reduced slice (8 bytes per voxel).
///
/// # Errors
/// The errors of [`read`], where the limit on the number of voxels applies to the reduced volume; a `bin` of 0 or
/// larger than the shortest edge.
pub fn read_binned(
    path: &Path,
    voxel_mm: Option<f64>,
    bin: usize,
) -> Result<Volume<f32>, ImageError> {
    Ok(values::grey(&stack(path)?, &ReadOptions { voxel_mm, bin, dataset: None })?.volume)
}

/// Reads a stack of labels; see [`read`].
///
/// # Errors
/// The errors of [`read`], and an error for values that are not integers from 0 to 2³² − 1.
pub fn read_labels(path: &Path, voxel_mm: Option<f64>) -> Result<Volume<u32>, ImageError> {
    let options = ReadOptions { voxel_mm, ..ReadOptions::default() };
    Ok(values::labels(&stack(path)?, &options)?.volume)
}

fn stack(path: &Path) -> Result<Stack, ImageError> {
    if !path.is_dir() {
        return scan(path, vec![PathBuf::from(path)], None);
    }
    let ordered = order(path, slices_of(path)?)?;
    scan(path, ordered.paths.clone(), Some(&ordered))
}
