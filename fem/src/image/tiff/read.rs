//! Stacks from files.

use std::cmp::Ordering;
use std::ops::Range;
use std::path::{Path, PathBuf};

use ::tiff::decoder::DecodingResult;
use rayon::prelude::*;

use super::page::{Declared, declared, open, refused, samples};
use super::resolution::{VoxelSize, declared_images, voxel_size};
use crate::image::volume::MAX_VOXELS;
use crate::image::{ImageError, Volume};

/// No compression that is read packs more bytes into one than this.
const DENSEST: u64 = 3000;

/// Reads a stack of grey values: a file of many pages, or a folder whose `.tif` and `.tiff` files are
/// the slices in the natural order of their names (`slice9` before `slice10`).
///
/// Page after page is z. The edge of a voxel is `voxel_mm`, or stands in the tags of the first page.
/// Pages that are marked as smaller copies of others are left out. Pages are decoded in parallel.
///
/// # Errors
/// [`ImageError`] with file and page: no pages, pages of unlike size, colours, pages cut short,
/// values that are no numbers, voxels that are no cubes, no voxel size.
///
/// # References
/// TIFF, revision 6.0, Adobe 1992.
pub fn read(path: &Path, voxel_mm: Option<f64>) -> Result<Volume<f32>, ImageError> {
    read_as(path, voxel_mm, &|samples, slice: &mut [f32]| {
        fill(samples, slice)?;
        match slice.iter().position(|value| !value.is_finite()) {
            Some(at) => Err((at, f64::from(slice[at]))),
            None => Ok(()),
        }
    })
}

/// Reads a stack of labels; see [`read`].
///
/// # Errors
/// As of [`read`], and values that are no whole numbers from 0 to 2³² − 1.
pub fn read_labels(path: &Path, voxel_mm: Option<f64>) -> Result<Volume<u32>, ImageError> {
    read_as(path, voxel_mm, &|samples, slice: &mut [u32]| {
        let mut numbers = vec![0.0_f64; slice.len()];
        fill(samples, &mut numbers)?;
        for (at, (label, &number)) in slice.iter_mut().zip(&numbers).enumerate() {
            *label = number as u32;
            if f64::from(*label) != number {
                return Err((at, number));
            }
        }
        Ok(())
    })
}

/// Puts the samples of a page into a slice; the place and value of the first that cannot be.
type Convert<T> = dyn Fn(&DecodingResult, &mut [T]) -> Result<(), (usize, f64)> + Sync;

fn read_as<T: Copy + Default + Send>(
    path: &Path,
    voxel_mm: Option<f64>,
    convert: &Convert<T>,
) -> Result<Volume<T>, ImageError> {
    let stack = Stack::scan(path, voxel_mm)?;
    let [width, height, depth] = stack.shape;
    let area = width * height;
    let mut values = vec![T::default(); area * depth];

    let tasks = stack.tasks();
    let mut rest = values.as_mut_slice();
    let mut work = Vec::with_capacity(tasks.len());
    for (source, pages) in tasks {
        let (own, others) = rest.split_at_mut(area * pages.len());
        rest = others;
        work.push((source, pages, own));
    }
    // the first error in the order of the slices, whichever thread was the fastest
    let done: Vec<Result<(), ImageError>> = work
        .into_par_iter()
        .map(|(source, pages, own)| source.decode(pages, area, own, convert))
        .collect();
    done.into_iter().collect::<Result<(), _>>()?;
    Ok(Volume { shape: stack.shape, voxel_mm: stack.voxel_mm, values })
}

/// A file and its pages.
#[derive(Debug)]
struct Source {
    path: PathBuf,
    bytes: u64,
    /// Numbers (from 0) of the pages that are slices.
    pages: Vec<usize>,
}

/// All files of a stack and what they declare.
#[derive(Debug)]
struct Stack {
    sources: Vec<Source>,
    shape: [usize; 3],
    voxel_mm: f64,
}

impl Stack {
    fn scan(path: &Path, voxel_mm: Option<f64>) -> Result<Stack, ImageError> {
        let files = if path.is_dir() { slices_of(path)? } else { vec![path.to_owned()] };
        let mut sources = Vec::with_capacity(files.len());
        let mut first: Option<Declared> = None;
        let mut size = voxel_mm.map(VoxelSize::Cube);
        let (mut declared_bytes, mut file_bytes, mut depth) = (0_u64, 0_u64, 0_usize);
        for file in files {
            let meta =
                std::fs::metadata(&file).map_err(|error| ImageError::io("read", &file, error))?;
            let bytes = meta.len();
            file_bytes += bytes;
            let mut decoder = open(&file, bytes.saturating_mul(DENSEST))?;
            let images = declared_images(&mut decoder).unwrap_or(1);
            let mut pages = Vec::new();
            for number in 0.. {
                if number > 0 {
                    if !decoder.more_images() {
                        break;
                    }
                    decoder.next_image().map_err(|error| refused(&file, number + 1, &error))?;
                }
                let this = declared(&file, number + 1, &mut decoder, bytes)?;
                if this.preview {
                    continue;
                }
                size.get_or_insert_with(|| voxel_size(&mut decoder));
                same_size(&file, number, first.get_or_insert(this), &this)?;
                declared_bytes = declared_bytes.saturating_add(this.bytes());
                pages.push(number);
            }
            if pages.len() == 1 && images > 1 {
                return Err(ImageError::Page {
                    path: file,
                    page: 1,
                    message: format!("it is the only page, but {images} images are declared"),
                    help: "save the stack as BigTIFF, or as one file for each slice",
                });
            }
            if declared_bytes > file_bytes.saturating_mul(DENSEST) {
                return Err(ImageError::Implausible { path: file, declared_bytes, file_bytes });
            }
            depth += pages.len();
            sources.push(Source { path: file, bytes, pages });
        }
        let (Some(page), Some(size)) = (first, size) else {
            let help = "give a file or folder of slices";
            return Err(ImageError::Empty { path: path.into(), what: "page", help });
        };
        let shape = [page.width, page.height, depth];
        let voxels = shape.iter().fold(1_u64, |n, &side| n.saturating_mul(side as u64));
        if voxels > MAX_VOXELS {
            return Err(ImageError::TooManyVoxels { voxels, limit: MAX_VOXELS });
        }
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
        Ok(Stack { sources, shape, voxel_mm })
    }

    /// Portions of pages of one file each, in order, for the threads to share.
    fn tasks(&self) -> Vec<(&Source, Range<usize>)> {
        let threads = rayon::current_num_threads();
        let mut tasks = Vec::new();
        for source in &self.sources {
            let portion = source.pages.len().div_ceil(2 * threads).max(1);
            for start in (0..source.pages.len()).step_by(portion) {
                tasks.push((source, start..(start + portion).min(source.pages.len())));
            }
        }
        tasks
    }
}

impl Source {
    fn decode<T>(
        &self,
        pages: Range<usize>,
        area: usize,
        values: &mut [T],
        convert: &Convert<T>,
    ) -> Result<(), ImageError> {
        let mut decoder = open(&self.path, self.bytes.saturating_mul(DENSEST))?;
        for (&number, slice) in self.pages[pages].iter().zip(values.chunks_exact_mut(area)) {
            let page = number + 1;
            decoder.seek_to_image(number).map_err(|error| refused(&self.path, page, &error))?;
            let samples = samples(&self.path, page, &mut decoder)?;
            convert(&samples, slice).map_err(|(at, value)| ImageError::Page {
                path: self.path.clone(),
                page,
                message: format!("voxel {at} has the value {value}"),
                help: "replace such voxels before",
            })?;
        }
        Ok(())
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

/// Samples of any kind as numbers of one kind; the place of a missing one.
fn fill<T: FromSample>(samples: &DecodingResult, slice: &mut [T]) -> Result<(), (usize, f64)> {
    fn copy<S: Copy, T>(from: &[S], to: &mut [T], number: impl Fn(S) -> T) -> usize {
        to.iter_mut().zip(from).for_each(|(to, &from)| *to = number(from));
        from.len()
    }
    let length = match samples {
        DecodingResult::U8(from) => copy(from, slice, |v| T::from_f64(f64::from(v))),
        DecodingResult::U16(from) => copy(from, slice, |v| T::from_f64(f64::from(v))),
        DecodingResult::U32(from) => copy(from, slice, |v| T::from_f64(f64::from(v))),
        DecodingResult::U64(from) => copy(from, slice, |v| T::from_f64(v as f64)),
        DecodingResult::I8(from) => copy(from, slice, |v| T::from_f64(f64::from(v))),
        DecodingResult::I16(from) => copy(from, slice, |v| T::from_f64(f64::from(v))),
        DecodingResult::I32(from) => copy(from, slice, |v| T::from_f64(f64::from(v))),
        DecodingResult::I64(from) => copy(from, slice, |v| T::from_f64(v as f64)),
        DecodingResult::F16(from) => copy(from, slice, |v| T::from_f64(f64::from(v))),
        DecodingResult::F32(from) => copy(from, slice, |v| T::from_f64(f64::from(v))),
        DecodingResult::F64(from) => copy(from, slice, |v| T::from_f64(v)),
    };
    if length < slice.len() { Err((length, f64::NAN)) } else { Ok(()) }
}

trait FromSample {
    fn from_f64(value: f64) -> Self;
}

impl FromSample for f32 {
    fn from_f64(value: f64) -> Self {
        value as f32
    }
}

impl FromSample for f64 {
    fn from_f64(value: f64) -> Self {
        value
    }
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
