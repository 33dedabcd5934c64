//! What a stack consists of: its files, their pages, its shape and the size of a voxel.

use std::cmp::Ordering;
use std::path::{Path, PathBuf};

use super::page::{Declared, declared, open, refused};
use super::resolution::{VoxelSize, declared_images, voxel_size};
use crate::ImageError;
use crate::volume::check_count;

/// No compression that is read packs more bytes into one than this.
const DENSEST: u64 = 3000;

/// A file of a stack.
#[derive(Debug)]
pub(super) struct SliceFile {
    pub(super) path: PathBuf,
    bytes: u64,
}

impl SliceFile {
    /// The most memory that its pages can be worth.
    pub(super) fn most_bytes(&self) -> u64 {
        self.bytes.saturating_mul(DENSEST)
    }
}

/// All files of a stack and what they declare.
#[derive(Debug)]
pub(super) struct Stack {
    pub(super) files: Vec<SliceFile>,
    /// File and page (both from 0) of each slice.
    pub(super) slices: Vec<(usize, usize)>,
    /// Voxels along x, y, z.
    pub(super) shape: [usize; 3],
    /// Edge of a voxel (mm).
    pub(super) voxel_mm: f64,
}

impl Stack {
    /// Looks at all pages of a file or folder, of which blocks of `bin` voxels along each edge are to
    /// become one.
    ///
    /// # Errors
    /// [`ImageError`]; see [`read`](super::read) and [`read_binned`](super::read_binned).
    pub(super) fn scan(
        path: &Path,
        voxel_mm: Option<f64>,
        bin: usize,
    ) -> Result<Stack, ImageError> {
        let paths = if path.is_dir() { slices_of(path)? } else { vec![path.to_owned()] };
        let (mut files, mut slices) = (Vec::with_capacity(paths.len()), Vec::new());
        let mut first: Option<Declared> = None;
        let mut size = voxel_mm.map(VoxelSize::Cube);
        let (mut declared_bytes, mut file_bytes) = (0_u64, 0_u64);
        for path in paths {
            let meta =
                std::fs::metadata(&path).map_err(|error| ImageError::io("read", &path, error))?;
            let file = SliceFile { path, bytes: meta.len() };
            file_bytes += file.bytes;
            let mut decoder = open(&file.path, file.most_bytes())?;
            let images = declared_images(&mut decoder).unwrap_or(1);
            let before = slices.len();
            for number in 0.. {
                if number > 0 {
                    if !decoder.more_images() {
                        break;
                    }
                    let refuse = |error| refused(&file.path, number + 1, &error);
                    decoder.next_image().map_err(refuse)?;
                }
                let this = declared(&file.path, number + 1, &mut decoder, file.bytes)?;
                if this.preview {
                    continue;
                }
                size.get_or_insert_with(|| voxel_size(&mut decoder));
                same_size(&file.path, number, first.get_or_insert(this), &this)?;
                declared_bytes = declared_bytes.saturating_add(this.bytes());
                slices.push((files.len(), number));
            }
            if slices.len() == before + 1 && images > 1 {
                return Err(ImageError::Page {
                    path: file.path,
                    page: 1,
                    message: format!("it is the only page, but {images} images are declared"),
                    help: "save the stack as BigTIFF, or as one file for each slice",
                });
            }
            if declared_bytes > file_bytes.saturating_mul(DENSEST) {
                let path = file.path;
                return Err(ImageError::Implausible { path, declared_bytes, file_bytes });
            }
            files.push(file);
        }
        let (Some(page), Some(size)) = (first, size) else {
            let help = "give a file or folder of slices";
            return Err(ImageError::Empty { path: path.into(), what: "page", help });
        };
        let shape = [page.width, page.height, slices.len()];
        if bin == 0 || shape.iter().any(|&side| side < bin && bin > 1) {
            return Err(ImageError::Parameter {
                field: "bin",
                value: bin as f64,
                requirement: "a whole number from 1 to the voxels along the shortest edge",
            });
        }
        check_count(shape, bin)?;
        let voxel_mm = match size {
            VoxelSize::Cube(edge) if edge.is_finite() && edge > 0.0 => edge,
            VoxelSize::Cube(value) => {
                let requirement = "a length above 0 (mm)";
                return Err(ImageError::Parameter { field: "voxel_mm", value, requirement });
            }
            VoxelSize::Unlike(size_mm) => {
                return Err(ImageError::Anisotropic { path: path.into(), size_mm });
            }
            VoxelSize::Unknown(message) => {
                return Err(ImageError::NoVoxelSize { path: path.into(), message });
            }
        };
        Ok(Stack { files, slices, shape, voxel_mm })
    }
}

fn same_size(
    path: &Path,
    number: usize,
    first: &Declared,
    this: &Declared,
) -> Result<(), ImageError> {
    if (first.width, first.height) == (this.width, this.height) {
        return Ok(());
    }
    Err(ImageError::Page {
        path: path.into(),
        page: number + 1,
        message: format!(
            "{} × {} voxels, but the first page has {} × {}",
            this.width, this.height, first.width, first.height
        ),
        help: "crop all slices alike, and keep other files out of the folder",
    })
}

/// The slices in a folder, in the natural order of their names.
fn slices_of(folder: &Path) -> Result<Vec<PathBuf>, ImageError> {
    let failed = |source| ImageError::io("read", folder, source);
    let mut slices = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        let extension = path.extension().map(|end| end.to_string_lossy().to_ascii_lowercase());
        if !hidden && matches!(extension.as_deref(), Some("tif" | "tiff")) {
            slices.push(path);
        }
    }
    if slices.is_empty() {
        let help = "a folder holds one .tif or .tiff file for each slice";
        return Err(ImageError::Empty { path: folder.into(), what: "slice", help });
    }
    slices.sort_by(|a, b| natural(&name(a), &name(b)).then_with(|| a.cmp(b)));
    Ok(slices)
}

fn name(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// The order in which a person counts: numbers within names by their value.
fn natural(a: &str, b: &str) -> Ordering {
    fn parts(text: &str) -> Vec<&str> {
        let digit = |c: char| c.is_ascii_digit();
        let mut parts = Vec::new();
        let mut rest = text;
        while let Some(first) = rest.chars().next() {
            let end = rest.find(|c| digit(c) != digit(first)).unwrap_or(rest.len());
            let (part, after) = rest.split_at(end);
            parts.push(part);
            rest = after;
        }
        parts
    }
    let key = |part: &str| match part.starts_with(|c: char| c.is_ascii_digit()) {
        true => {
            let digits = part.trim_start_matches('0').to_owned();
            (0, digits.len(), digits)
        }
        false => (1, 0, part.to_owned()),
    };
    parts(a).into_iter().map(key).cmp(parts(b).into_iter().map(key))
}

#[cfg(test)]
mod tests {
    use super::natural;

    #[test]
    fn names_are_counted() {
        let mut names = ["s10.tif", "s9.tif", "s010b.tif", "s1.tif", "a2_10.tif", "a2_9.tif"];
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(names, ["a2_9.tif", "a2_10.tif", "s1.tif", "s9.tif", "s10.tif", "s010b.tif"]);
    }
}
