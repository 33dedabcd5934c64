//! Reader of volumes from files of all supported formats.

use std::path::{Path, PathBuf};

use super::folder::{Contents, contents};
use super::kind::{Kind, header_lines, kind_of};
use super::picture_stack::{self, PictureFormat};
use super::{hdf5, metaimage, nrrd};
use crate::ImageError;
use crate::slices::continuity::doubts;
use crate::slices::header::{ReadOptions, StackHeader};
use crate::slices::names::{file_name, order};
use crate::slices::stack::Stack;
use crate::slices::values::{self, Reading};
use crate::tiff::stack as tiff;

/// Reads a stack of grey values from a file or a folder; the format is detected from the content.
///
/// Supported formats: TIFF (see [`tiff::read`](crate::tiff::read)), MetaImage, NRRD, HDF5, and folders of TIFF, PNG and
/// BMP slices. The returned header describes the stack: the files and their order, the number type of the values, the
/// voxel size and the source of the voxel size. The warnings in the header report jumps of grey values between
/// neighbouring slices and other possible causes of a wrong result.
///
/// With `bin` above 1 each block of voxels is averaged, see [`tiff::read_binned`](crate::tiff::read_binned).
///
/// # Errors
/// [`ImageError`] with file, page or line, and advice: an unsupported format (with advice on how to convert the file);
/// files that do not form one volume (several channels or times, missing slices, names of several series, fewer pages
/// than declared); slices of different size or type; voxels of unknown or implausible size, or that are not cubes;
/// damaged files.
///
/// # Example
/// ```
/// # let folder = std::env::temp_dir().join(format!("fem-doc-raw-{}", std::process::id()));
/// # std::fs::create_dir_all(&folder).unwrap();
/// use fem_image::{ReadOptions, read};
///
/// std::fs::write(folder.join("scan.raw"), [0, 1, 2, 3, 4, 5, 6, 7]).unwrap();
/// let header = "NDims = 3\nDimSize = 2 2 2\nElementType = MET_UCHAR\nElementSpacing = 0.01 0.01 0.01\nElementDataFile = scan.raw\n";
/// std::fs::write(folder.join("scan.mhd"), header).unwrap();
/// let reading = read(&folder.join("scan.mhd"), &ReadOptions::default())?;
/// assert_eq!(*reading.volume.at([1, 0, 1]), 5.0);
/// assert_eq!(reading.header.voxel_mm, 0.01);
/// # std::fs::remove_dir_all(&folder).unwrap();
/// # Ok::<(), fem_image::ImageError>(())
/// ```
pub fn read(path: &Path, options: &ReadOptions) -> Result<Reading<f32>, ImageError> {
    let mut reading = values::grey(&scan(path, options)?, options)?;
    reading.header.warnings.extend(doubts(&reading.volume));
    Ok(reading)
}

/// Reads a stack of labels in any format that [`read`] supports.
///
/// # Errors
/// The errors of [`read`], and an error for values that are not integers from 0 to 2³² − 1.
pub fn read_labels(path: &Path, options: &ReadOptions) -> Result<Reading<u32>, ImageError> {
    values::labels(&scan(path, options)?, options)
}

/// Reads a stack of labels of any signed or unsigned integer type, in any format that [`read`] supports. Floating-point
/// values are allowed if they are integers, because some programs save labels in this way.
///
/// # Errors
/// The errors of [`read`], and an error for values that are not integers between −2⁵³ and 2⁵³.
pub fn read_label_values(path: &Path, options: &ReadOptions) -> Result<Reading<i64>, ImageError> {
    values::label_values(&scan(path, options)?, options)
}

/// Returns the files and folders on which the result of [`read`] depends: the folder of a stack of slices; a header and
/// its file of values; otherwise the file itself.
pub fn files_of(path: &Path) -> Vec<PathBuf> {
    let only_path = vec![path.to_owned()];
    if path.is_dir() {
        return only_path;
    }
    let data = match kind_of(path) {
        Ok(Kind::MetaImage) => metaimage::header(path).map(|header| header.data),
        Ok(Kind::Nrrd) => nrrd::header(path).map(|header| header.data),
        _ => return only_path,
    };
    match data {
        Ok(data) if data != path => vec![path.to_owned(), data],
        _ => only_path,
    }
}

impl StackHeader {
    /// Reads the headers of a stack that [`read`] supports, but not its grey values.
    ///
    /// # Errors
    /// The errors of [`read`] that can be detected from headers.
    pub fn read(path: &Path, options: &ReadOptions) -> Result<Self, ImageError> {
        Self::of(&scan(path, options)?, options)
    }
}

fn scan(path: &Path, options: &ReadOptions) -> Result<Stack, ImageError> {
    if !path.is_dir() {
        return file(path, kind_of(path)?, options);
    }
    let (stack_contents, note) = contents(path)?;
    if !matches!(stack_contents, Contents::Volume(..)) {
        check_no_dataset(path, options)?;
    }
    let mut stack = match stack_contents {
        Contents::Tiff(paths) => {
            let ordered = order(path, paths)?;
            tiff::scan(path, ordered.paths.clone(), Some(&ordered))?
        }
        Contents::Png(paths) => picture_stack::scan(path, PictureFormat::Png, order(path, paths)?)?,
        Contents::Bmp(paths) => picture_stack::scan(path, PictureFormat::Bmp, order(path, paths)?)?,
        Contents::Volume(volume, kind) => file(&volume, kind, options)?,
    };
    stack.notes.extend(note);
    Ok(stack)
}

/// Returns an error if the options name a dataset, which only HDF5 files have.
fn check_no_dataset(path: &Path, options: &ReadOptions) -> Result<(), ImageError> {
    let Some(dataset) = &options.dataset else { return Ok(()) };
    Err(ImageError::Series {
        path: path.into(),
        message: format!("this is not an HDF5 file, but dataset = \"{dataset}\" is given"),
        help: "remove dataset from [specimen.image], or name the HDF5 file",
    })
}

fn file(path: &Path, kind: Kind, options: &ReadOptions) -> Result<Stack, ImageError> {
    let one = || order(path, vec![path.to_owned()]);
    let extension = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    if kind != Kind::Hdf5 {
        check_no_dataset(path, options)?;
    }
    match kind {
        Kind::Tiff => tiff::scan(path, vec![path.to_owned()], None),
        Kind::Png => picture_stack::scan(path, PictureFormat::Png, one()?),
        Kind::Bmp => picture_stack::scan(path, PictureFormat::Bmp, one()?),
        Kind::MetaImage => metaimage::scan(path),
        Kind::Nrrd => nrrd::scan(path),
        Kind::Hdf5 => hdf5::scan(path, options.dataset.as_deref()),
        Kind::Foreign(format, help) => Err(ImageError::Format { path: path.into(), format, help }),
        // the TIFF decoder reports the error in the file
        Kind::Unknown if matches!(extension.as_str(), "tif" | "tiff") => {
            tiff::scan(path, vec![path.to_owned()], None)
        }
        Kind::Unknown => Err(ImageError::Format {
            path: path.into(),
            format: "an unknown format",
            help: format!("raw values need a header: {}", header_lines(&file_name(path))),
        }),
    }
}
