//! Errors of reading, writing and segmenting images.

use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Error in reading, writing or segmenting an image.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// A file or folder that cannot be opened, read or written.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// The action that failed: `read` or `write`.
        action: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: Arc<io::Error>,
    },
    /// A folder without slices, or a file without pages.
    #[error("{}: no {what}; {help}", path.display())]
    Empty {
        /// The file or folder.
        path: PathBuf,
        /// Name of the missing items: slices or pages.
        what: &'static str,
        /// Advice to the user.
        help: &'static str,
    },
    /// A page of a file that cannot be read as a slice of voxels.
    #[error("{}, page {page}: {message}; {help}", path.display())]
    Page {
        /// The file.
        path: PathBuf,
        /// Number of the page, counted from 1.
        page: usize,
        /// Description of the fault, with the value.
        message: String,
        /// Advice to the user.
        help: &'static str,
    },
    /// Files or pages that do not form one volume.
    #[error("{}: {message}; {help}", path.display())]
    Series {
        /// The file or folder.
        path: PathBuf,
        /// Description of the fault, with names and counts.
        message: String,
        /// Advice to the user.
        help: &'static str,
    },
    /// A header line that is invalid.
    #[error("{}:{line}: {message}; {help}", path.display())]
    Header {
        /// The file.
        path: PathBuf,
        /// Number of the line, counted from 1.
        line: usize,
        /// Description of the fault, with key and value.
        message: String,
        /// Advice to the user.
        help: &'static str,
    },
    /// A file in a format that is recognised but not supported.
    #[error("{}: {format} is not supported; {help}", path.display())]
    Format {
        /// The file or folder.
        path: PathBuf,
        /// Name of the format, as detected from the content.
        format: &'static str,
        /// Advice on how to convert the file.
        help: String,
    },
    /// A file that declares far more voxels than its bytes can hold.
    #[error(
        "{}: the file declares {declared_bytes} bytes of voxels, but has {file_bytes} bytes; the file is damaged: write it again",
        path.display()
    )]
    Implausible {
        /// The file.
        path: PathBuf,
        /// Bytes of voxels that the file declares.
        declared_bytes: u64,
        /// Length of the file (bytes).
        file_bytes: u64,
    },
    /// An image with more voxels than this program can number.
    #[error(
        "{} × {} × {} voxels are more than {limit}; crop the image, or average blocks of voxels while it is read: the smallest sufficient value is bin = {bin} in [specimen.image]",
        shape[0], shape[1], shape[2]
    )]
    TooManyVoxels {
        /// Voxels of the stored image along x, y, z.
        shape: [usize; 3],
        /// Largest number of voxels that is accepted.
        limit: u64,
        /// Smallest edge of the averaged blocks, in voxels, for which the number of blocks does not exceed the limit.
        bin: usize,
    },
    /// Neither the file nor the user gives the size of a voxel.
    #[error("{}: {message}; give voxel_mm", path.display())]
    NoVoxelSize {
        /// The file.
        path: PathBuf,
        /// Reason why the voxel size is unknown.
        message: String,
    },
    /// An image whose voxels are not cubes.
    #[error(
        "{}: voxels of {} × {} × {} mm ({} mm from slice to slice, along z) are not cubes. Resample the image to cubes of \
         {} mm, for example by scipy.ndimage.zoom(image, {}, order=1) (labels: order=0) or Image > Scale in Fiji; give \
         voxel_mm if the stated size is wrong",
        path.display(), size_mm[0], size_mm[1], size_mm[2], size_mm[2], smallest(size_mm), zoom_factors(size_mm)
    )]
    Anisotropic {
        /// The file.
        path: PathBuf,
        /// Edges of a voxel (mm).
        size_mm: [f64; 3],
    },
    /// A parameter outside its allowed range.
    #[error("{field} = {value} must be {requirement}")]
    Parameter {
        /// Name of the parameter.
        field: &'static str,
        /// The value given.
        value: f64,
        /// Description of the allowed values.
        requirement: &'static str,
    },
    /// The number of values differs from the number of voxels of the volume's shape.
    #[error("{shape:?} voxels, but {values} values: give one value to each voxel")]
    Shape {
        /// Voxels along x, y, z.
        shape: [usize; 3],
        /// Number of values given.
        values: usize,
    },
    /// A specimen size given by the user that is larger than the specimen in the image.
    #[error(
        "specimen.{key} = {given_mm} is larger than the specimen in the image ({shown_mm:.4} mm), and the volume outside the image would be meshed as matrix: remove the key, correct voxel_mm, or give [specimen.image.region]"
    )]
    Larger {
        /// `radius_mm` or `height_mm`.
        key: &'static str,
        /// The size given (mm).
        given_mm: f64,
        /// Size of the specimen in the image (mm).
        shown_mm: f64,
    },
    /// A mask whose shape differs from the shape of the image.
    #[error(
        "region.mask has {} × {} × {} voxels, but the image has {} × {} × {} voxels; give one value to each voxel of the image",
        mask[0], mask[1], mask[2], image[0], image[1], image[2]
    )]
    Mask {
        /// Voxels of the mask along x, y, z.
        mask: [usize; 3],
        /// Voxels of the image along x, y, z.
        image: [usize; 3],
    },
    /// A grey value that is infinite or not a number.
    #[error("voxel {voxel:?} has the grey value {value}; replace such values in the image")]
    NotFinite {
        /// Position of the voxel along x, y, z, counted from 0.
        voxel: [usize; 3],
        /// Grey value of the voxel.
        value: f32,
    },
    /// An image with only one grey value or only one phase.
    #[error("{what}; {help}")]
    NoContrast {
        /// Description of the missing contrast, with the values.
        what: String,
        /// Advice to the user.
        help: &'static str,
    },
    /// An image that shows neither a specimen in air nor a block cut out of a specimen.
    #[error("{what}; {help}")]
    Scene {
        /// Description of the image's content.
        what: String,
        /// Advice to the user.
        help: &'static str,
    },
    /// Labels of an image that contradict the label rules, or rules that contradict each other.
    #[error("{what}; {help}")]
    Labels {
        /// Description of the contradiction, with the values.
        what: String,
        /// Advice to the user.
        help: &'static str,
    },
    /// An image to which no cylinder can be fitted.
    #[error("no cylinder in air fits the specimen: {message}; {help}")]
    NoCylinder {
        /// Description of why the fit failed.
        message: String,
        /// Advice to the user.
        help: &'static str,
    },
}

impl ImageError {
    pub(crate) fn io(action: &'static str, path: &Path, source: io::Error) -> Self {
        ImageError::Io { action, path: path.into(), source: Arc::new(source) }
    }
}

/// Returns the smallest edge of a voxel (mm).
fn smallest(size_mm: &[f64; 3]) -> f64 {
    size_mm.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Returns the factors by which the number of voxels grows if the image is resampled to cubes of the smallest edge. The
/// factors are in the order z, y, x, as in NumPy.
fn zoom_factors(size_mm: &[f64; 3]) -> String {
    let [x, y, z] = size_mm.map(|edge| {
        // round the factor, so that the message does not show the rounding error of the division
        (edge / smallest(size_mm) * 1e4).round() / 1e4
    });
    format!("({z}, {y}, {x})")
}
