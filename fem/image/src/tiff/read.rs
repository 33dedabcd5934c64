//! Values of stacks: as they are, or averaged over blocks of voxels on the way.

use ::tiff::decoder::DecodingResult;
use rayon::prelude::*;

use std::path::Path;

use super::page::{Reader, open, refused, samples};
use super::stack::Stack;
use crate::{ImageError, Volume};

/// Reads a stack of grey values: a file of many pages, or a folder whose `.tif` and `.tiff` files are
/// the slices in the natural order of their names (`slice9` before `slice10`).
///
/// Page after page is z. The edge of a voxel is `voxel_mm`, or stands in the tags of the first page.
/// Pages that are marked as smaller copies of others are left out. Pages are decoded in parallel.
///
/// # Errors
/// [`ImageError`] with file and page: no pages, pages of unlike size, colours, pages cut short,
/// values that are no numbers, voxels that are no cubes, no voxel size, more voxels than can be numbered.
///
/// # References
/// TIFF, revision 6.0, Adobe 1992.
pub fn read(path: &Path, voxel_mm: Option<f64>) -> Result<Volume<f32>, ImageError> {
    read_as(path, voxel_mm, &grey)
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
/// numbers of 4 bytes, and one reduced slice of 8 bytes a voxel, however large the stack is.
///
/// # Errors
/// As of [`read`], where only the voxels that are left are counted; a `bin` of 0, and one that is larger
/// than the shortest edge.
pub fn read_binned(
    path: &Path,
    voxel_mm: Option<f64>,
    bin: usize,
) -> Result<Volume<f32>, ImageError> {
    if bin == 1 {
        return read(path, voxel_mm);
    }
    let stack = Stack::scan(path, voxel_mm, bin)?;
    let [width, height, _] = stack.shape;
    let shape = stack.shape.map(|side| side / bin);
    let area = shape[0] * shape[1];
    let mut values = vec![0.0_f32; area * shape[2]];
    let slab_at_a_time = |first: usize, slabs: &mut [f32]| -> Result<(), ImageError> {
        let mut slices = Slices::new(&stack);
        let (mut page, mut sums) = (vec![0.0_f32; width * height], vec![0.0_f64; area]);
        for (slab, means) in (first..).zip(slabs.chunks_exact_mut(area)) {
            sums.fill(0.0);
            for slice in bin * slab..bin * (slab + 1) {
                slices.read(slice, &mut page, &grey)?;
                // rows beyond the last whole block fall away with the end of `sums`
                let bands = page.chunks_exact(width * bin).zip(sums.chunks_exact_mut(shape[0]));
                for (band, sums) in bands {
                    for row in band.chunks_exact(width) {
                        let blocks = row.chunks_exact(bin).zip(sums.iter_mut());
                        blocks.for_each(|(block, sum)| {
                            *sum += block.iter().copied().map(f64::from).sum::<f64>();
                        });
                    }
                }
            }
            let voxels = bin.pow(3) as f64;
            means.iter_mut().zip(&sums).for_each(|(mean, sum)| *mean = (sum / voxels) as f32);
        }
        Ok(())
    };
    in_portions(&mut values, area, slab_at_a_time)?;
    Ok(Volume { shape, voxel_mm: stack.voxel_mm * bin as f64, values })
}

/// What the pages of a stack declare.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StackHeader {
    /// Voxels along x, y, z, after binning.
    pub shape: [usize; 3],
    /// Edge of a voxel in mm, after binning.
    pub voxel_mm: f64,
}

impl StackHeader {
    /// Reads the headers of a stack that [`read_binned`] would read, and no grey values.
    ///
    /// # Errors
    /// As of [`read_binned`] where headers show it.
    pub fn read(path: &Path, voxel_mm: Option<f64>, bin: usize) -> Result<Self, ImageError> {
        let Stack { shape, voxel_mm, .. } = Stack::scan(path, voxel_mm, bin)?;
        Ok(Self { shape: shape.map(|side| side / bin), voxel_mm: voxel_mm * bin as f64 })
    }

    /// Edges of the image in mm.
    pub fn size_mm(&self) -> [f64; 3] {
        self.shape.map(|side| side as f64 * self.voxel_mm)
    }
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

/// Reads a stack of labels of any integer type, with a sign or without; see [`read`]. Floating-point pages may hold whole
/// numbers, as some programs save labels.
///
/// # Errors
/// As of [`read`], and values that are no whole numbers between −2⁵³ and 2⁵³.
pub fn read_label_values(path: &Path, voxel_mm: Option<f64>) -> Result<Volume<i64>, ImageError> {
    const LARGEST: f64 = 9_007_199_254_740_992.0;
    read_as(path, voxel_mm, &|samples, slice: &mut [i64]| {
        let mut numbers = vec![0.0_f64; slice.len()];
        fill(samples, &mut numbers)?;
        for (at, (label, &number)) in slice.iter_mut().zip(&numbers).enumerate() {
            if number.fract() != 0.0 || number.abs() >= LARGEST {
                return Err((at, number));
            }
            *label = number as i64;
        }
        Ok(())
    })
}

/// Puts the samples of a page into a slice; the place and value of the first that cannot be.
type Convert<T> = dyn Fn(&DecodingResult, &mut [T]) -> Result<(), (usize, f64)> + Sync;

fn grey(samples: &DecodingResult, slice: &mut [f32]) -> Result<(), (usize, f64)> {
    fill(samples, slice)?;
    match slice.iter().position(|value| !value.is_finite()) {
        Some(at) => Err((at, f64::from(slice[at]))),
        None => Ok(()),
    }
}

fn read_as<T: Copy + Default + Send>(
    path: &Path,
    voxel_mm: Option<f64>,
    convert: &Convert<T>,
) -> Result<Volume<T>, ImageError> {
    let stack = Stack::scan(path, voxel_mm, 1)?;
    let [width, height, depth] = stack.shape;
    let area = width * height;
    let mut values = vec![T::default(); area * depth];
    in_portions(&mut values, area, |first, portion| {
        let mut slices = Slices::new(&stack);
        let mut own = (first..).zip(portion.chunks_exact_mut(area));
        own.try_for_each(|(slice, into)| slices.read(slice, into, convert))
    })?;
    Ok(Volume { shape: stack.shape, voxel_mm: stack.voxel_mm, values })
}

/// Shares slices of `area` values among the threads, each portion with the number of its first slice.
///
/// # Errors
/// The first in the order of the slices, whichever thread was the fastest.
fn in_portions<T: Send>(
    values: &mut [T],
    area: usize,
    each: impl Fn(usize, &mut [T]) -> Result<(), ImageError> + Sync,
) -> Result<(), ImageError> {
    let slices = values.len() / area;
    let portion = slices.div_ceil(2 * rayon::current_num_threads()).max(1);
    let done: Vec<Result<(), ImageError>> = values
        .par_chunks_mut(portion * area)
        .enumerate()
        .map(|(number, values)| each(number * portion, values))
        .collect();
    done.into_iter().collect()
}

/// Slices of a stack one after the other; a file stays open as long as slices come from it.
struct Slices<'a> {
    stack: &'a Stack,
    /// A file, by its number, and its decoder.
    open: Option<(usize, Reader)>,
}

impl<'a> Slices<'a> {
    fn new(stack: &'a Stack) -> Self {
        Slices { stack, open: None }
    }

    fn read<T>(
        &mut self,
        slice: usize,
        into: &mut [T],
        convert: &Convert<T>,
    ) -> Result<(), ImageError> {
        let (file, number) = self.stack.slices[slice];
        let source = &self.stack.files[file];
        let (path, page) = (&source.path, number + 1);
        let decoder = match &mut self.open {
            Some((open, decoder)) if *open == file => decoder,
            other => &mut other.insert((file, open(path, source.most_bytes())?)).1,
        };
        decoder.seek_to_image(number).map_err(|error| refused(path, page, &error))?;
        let samples = samples(path, page, decoder)?;
        convert(&samples, into).map_err(|(at, value)| ImageError::Page {
            path: path.clone(),
            page,
            message: format!("voxel {at} has the value {value}"),
            help: "replace such voxels before",
        })
    }
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
