//! Header data of a stack: shape, files, and the voxel size that is used.

use std::path::PathBuf;

use super::stack::Stack;
use super::voxel_size::resolve;
use crate::ImageError;
use crate::volume::check_count;

/// Options for reading a stack.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadOptions {
    /// Edge of a voxel of the stored stack (mm). This value replaces the size stated in the file.
    pub voxel_mm: Option<f64>,
    /// Edge, in voxels, of a block that is averaged to one voxel; 1 reads the stack without averaging.
    pub bin: usize,
    /// Path of a dataset in an HDF5 file; required if the file has several volumes, and not
    /// allowed for other formats.
    pub dataset: Option<String>,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self { voxel_mm: None, bin: 1, dataset: None }
    }
}

/// Header data of a stack.
#[derive(Clone, Debug, PartialEq)]
pub struct StackHeader {
    /// Numbers of voxels along x, y, z after the averaging over blocks.
    pub shape: [usize; 3],
    /// Edge of a voxel after the averaging over blocks (mm).
    pub voxel_mm: f64,
    /// Source of the voxel size (such as a tag of the file), as text for messages.
    pub voxel_origin: String,
    /// Format, files, pages, their order and the type of the grey values, as text for messages.
    pub contents: String,
    /// Edge, in voxels, of a block that is averaged to one voxel.
    pub bin: usize,
    /// All files that are read.
    pub files: Vec<PathBuf>,
    /// Possible causes of a wrong result, one sentence each.
    pub warnings: Vec<String>,
}

impl StackHeader {
    /// Returns the edges of the image (mm).
    pub fn size_mm(&self) -> [f64; 3] {
        self.shape.map(|side| side as f64 * self.voxel_mm)
    }

    /// Returns a summary in one line: files, pages, order, type, shape, and the voxel size with its source.
    pub fn in_words(&self) -> String {
        let ([nx, ny, nz], [x, y, z]) = (self.shape, self.size_mm());
        let binned = match self.bin {
            1 => String::new(),
            bin => format!(", after binning by {bin}"),
        };
        format!(
            "{}; {nx} × {ny} × {nz} voxels of {:.6} mm ({}), {x:.3} × {y:.3} × {z:.3} mm{binned}",
            self.contents, self.voxel_mm, self.voxel_origin
        )
    }

    /// Creates the header of a stack that is read with the given options.
    ///
    /// # Errors
    /// [`ImageError`]: no voxel size, voxels that are not cubes, too many voxels, or an invalid `bin`.
    pub(crate) fn of(stack: &Stack, options: &ReadOptions) -> Result<Self, ImageError> {
        let (shape, bin) = (stack.shape, options.bin);
        if bin == 0 || shape.iter().any(|&side| side < bin && bin > 1) {
            return Err(ImageError::Parameter {
                field: "bin",
                value: bin as f64,
                requirement: "a whole number from 1 to the voxels along the shortest edge",
            });
        }
        check_count(shape, bin)?;
        let resolved = resolve(&stack.path, &stack.size, options.voxel_mm)?;
        let mut warnings = stack.notes.clone();
        warnings.extend(resolved.warning);
        Ok(Self {
            shape: shape.map(|side| side / bin),
            voxel_mm: resolved.edge_mm * bin as f64,
            voxel_origin: resolved.origin,
            contents: format!("{}, {}", stack.contents, stack.sample),
            bin,
            files: stack.files.clone(),
            warnings,
        })
    }
}
