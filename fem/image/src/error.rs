//! What can be wrong with an image or with what is asked of it.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Why an image cannot be read, written or segmented.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// A file or folder that cannot be opened, read or written.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// `read` or `write`.
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What the operating system says.
        source: Arc<io::Error>,
    },
    /// A folder without slices, or a file without pages.
    #[error("{}: no {what}; {help}", path.display())]
    Empty {
        /// The file or folder.
        path: PathBuf,
        /// What is absent.
        what: &'static str,
        /// What helps.
        help: &'static str,
    },
    /// A page that cannot be taken for a slice of voxels.
    #[error("{}, page {page}: {message}; {help}", path.display())]
    Page {
        /// The file.
        path: PathBuf,
        /// The page, from 1.
        page: usize,
        /// What is wrong, with the value.
        message: String,
        /// What helps.
        help: &'static str,
    },
    /// A file that declares far more voxels than its bytes can hold.
    #[error(
        "{}: declares {declared_bytes} bytes of voxels in {file_bytes} bytes of file; it is damaged, write it again",
        path.display()
    )]
    Implausible {
        /// The file.
        path: PathBuf,
        /// Bytes of voxels that its pages declare.
        declared_bytes: u64,
        /// Its length.
        file_bytes: u64,
    },
    /// More voxels than can be numbered.
    #[error(
        "{} × {} × {} voxels are more than {limit}; crop the image, or average blocks of voxels while it is read: bin = {bin} in [specimen.image] is the least that fits",
        shape[0], shape[1], shape[2]
    )]
    TooManyVoxels {
        /// Voxels along x, y, z of the image as it is stored.
        shape: [usize; 3],
        /// The most voxels that are taken.
        limit: u64,
        /// The least number of voxels along the edge of a block that makes few enough of them.
        bin: usize,
    },
    /// No voxel size in the file and none given.
    #[error("{}: {message}; give voxel_mm", path.display())]
    NoVoxelSize {
        /// The file.
        path: PathBuf,
        /// What the tags say.
        message: String,
    },
    /// Voxels that are no cubes.
    #[error(
        "{}: voxels of {} × {} × {} mm are no cubes; resample the image to cubic voxels, or give voxel_mm if the tags are wrong",
        path.display(), size_mm[0], size_mm[1], size_mm[2]
    )]
    Anisotropic {
        /// The file.
        path: PathBuf,
        /// Edges of a voxel (mm).
        size_mm: [f64; 3],
    },
    /// A parameter out of its range.
    #[error("{field} = {value} must be {requirement}")]
    Parameter {
        /// Its name.
        field: &'static str,
        /// The value given.
        value: f64,
        /// What is accepted.
        requirement: &'static str,
    },
    /// A shape that does not fit the values.
    #[error("{shape:?} voxels, but {values} values: give one value to each voxel")]
    Shape {
        /// Voxels along x, y, z.
        shape: [usize; 3],
        /// Values given.
        values: usize,
    },
    /// A specimen that is said to be larger than the image shows.
    #[error(
        "specimen.{key} = {given_mm} is larger than the {shown_mm:.4} mm that the image shows; what is outside would be meshed as matrix: leave the key out, correct voxel_mm, or give [specimen.image.region]"
    )]
    Larger {
        /// `radius_mm` or `height_mm`.
        key: &'static str,
        /// The size given (mm).
        given_mm: f64,
        /// The size that was found (mm).
        shown_mm: f64,
    },
    /// A mask of another shape than the image.
    #[error(
        "region.mask has {} × {} × {} voxels and the image {} × {} × {}; give one value to each voxel of the image",
        mask[0], mask[1], mask[2], image[0], image[1], image[2]
    )]
    Mask {
        /// Voxels of the mask along x, y, z.
        mask: [usize; 3],
        /// Voxels of the image along x, y, z.
        image: [usize; 3],
    },
    /// A grey value that is no number.
    #[error("voxel {voxel:?} has the grey value {value}; replace such voxels before")]
    NotFinite {
        /// Its position along x, y, z, from 0.
        voxel: [usize; 3],
        /// The value.
        value: f32,
    },
    /// An image of one grey value, or of one phase.
    #[error("{what}; {help}")]
    NoContrast {
        /// What is missing, with the values.
        what: String,
        /// What helps.
        help: &'static str,
    },
    /// An image that shows neither a specimen in air nor a block cut out of one.
    #[error("{what}; {help}")]
    Scene {
        /// What it shows.
        what: String,
        /// What helps.
        help: &'static str,
    },
    /// A specimen in which no cylinder can be found.
    #[error("the specimen is no upright cylinder in air: {message}; {help}")]
    NoCylinder {
        /// What was found.
        message: String,
        /// What helps.
        help: &'static str,
    },
}

impl ImageError {
    pub(crate) fn io(action: &'static str, path: &Path, source: io::Error) -> Self {
        ImageError::Io { action, path: path.into(), source: Arc::new(source) }
    }
}
