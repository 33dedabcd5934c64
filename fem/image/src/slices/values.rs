//! Reader of the values of stacks, either unchanged or averaged over blocks of voxels.

use rayon::prelude::*;

use super::header::{ReadOptions, StackHeader};
use super::stack::{SliceReader, Stack};
use crate::{ImageError, Volume};

/// A volume, and the description of its files.
#[derive(Clone, Debug, PartialEq)]
pub struct Reading<T> {
    /// The voxels.
    pub volume: Volume<T>,
    /// Files, pages, order, type, voxel size and warnings.
    pub header: StackHeader,
}

/// Reads the grey values of a stack.
///
/// # Errors
/// The errors of [`StackHeader::of`], and errors for slices that cannot be read or values that are not finite.
pub(crate) fn grey(stack: &Stack, options: &ReadOptions) -> Result<Reading<f32>, ImageError> {
    let header = StackHeader::of(stack, options)?;
    let finite = |value: f64| Some(value as f32).filter(|value| value.is_finite());
    let volume = match options.bin {
        1 => whole(stack, &header, &finite)?,
        bin => binned(stack, &header, bin, &finite)?,
    };
    Ok(Reading { volume, header })
}

/// Reads a stack of labels.
///
/// # Errors
/// The errors of [`grey`], and an error for values that are not integers from 0 to 2³² − 1.
pub(crate) fn labels(stack: &Stack, options: &ReadOptions) -> Result<Reading<u32>, ImageError> {
    let header = unaveraged(stack, options)?;
    let label = |value: f64| Some(value as u32).filter(|label| f64::from(*label) == value);
    Ok(Reading { volume: whole(stack, &header, &label)?, header })
}

/// Reads a stack of labels that may be negative or exceed 32 bits.
///
/// # Errors
/// The errors of [`grey`], and an error for values that are not integers between −2⁵³ and 2⁵³.
pub(crate) fn label_values(
    stack: &Stack,
    options: &ReadOptions,
) -> Result<Reading<i64>, ImageError> {
    /// The number 2⁵³. A 64-bit floating-point number represents all integers below this number
    /// exactly.
    const LARGEST: f64 = 9_007_199_254_740_992.0;
    let header = unaveraged(stack, options)?;
    let label = |value: f64| {
        let is_label = value.fract() == 0.0 && value.abs() < LARGEST;
        is_label.then_some(value as i64)
    };
    Ok(Reading { volume: whole(stack, &header, &label)?, header })
}

/// Returns the header of a stack of labels; `bin` is ignored, because labels cannot be averaged.
fn unaveraged(stack: &Stack, options: &ReadOptions) -> Result<StackHeader, ImageError> {
    StackHeader::of(stack, &ReadOptions { bin: 1, ..options.clone() })
}

/// Function that converts a stored number to the value of a voxel; `None` if the number is not allowed.
type Convert<T> = dyn Fn(f64) -> Option<T> + Sync;

/// Reader of the slices of a stack that converts each value.
struct Slices<'a, T> {
    stack: &'a Stack,
    reader: Box<dyn SliceReader + 'a>,
    numbers: Vec<f64>,
    convert: &'a Convert<T>,
}

impl<'a, T> Slices<'a, T> {
    fn new(stack: &'a Stack, convert: &'a Convert<T>) -> Self {
        let [width, height, _] = stack.shape;
        Slices { stack, reader: stack.source.reader(), numbers: vec![0.0; width * height], convert }
    }

    fn read(&mut self, slice: usize, into: &mut [T]) -> Result<(), ImageError> {
        self.reader.read(slice, &mut self.numbers)?;
        for (at, (value, &number)) in into.iter_mut().zip(&self.numbers).enumerate() {
            *value = (self.convert)(number).ok_or_else(|| {
                let (path, page) = self.stack.source.file_and_page(slice);
                let message = format!("voxel {at} has the value {number}");
                ImageError::Page { path, page, message, help: "replace such values in the file" }
            })?;
        }
        Ok(())
    }
}

/// Reads all values of a stack.
fn whole<T: Copy + Default + Send>(
    stack: &Stack,
    header: &StackHeader,
    convert: &Convert<T>,
) -> Result<Volume<T>, ImageError> {
    let [width, height, depth] = stack.shape;
    let area = width * height;
    let mut values = vec![T::default(); area * depth];
    in_portions(&mut values, area, |first, portion| {
        let mut slices = Slices::new(stack, convert);
        let mut numbered = (first..).zip(portion.chunks_exact_mut(area));
        numbered.try_for_each(|(slice, into)| slices.read(slice, into))
    })?;
    Ok(Volume { shape: stack.shape, voxel_mm: header.voxel_mm, values })
}

/// Reads a stack and averages over blocks of voxels. The stack is read in slabs of `bin` slices, and only the sums of a
/// slab are stored.
fn binned(
    stack: &Stack,
    header: &StackHeader,
    bin: usize,
    convert: &Convert<f32>,
) -> Result<Volume<f32>, ImageError> {
    let ([width, height, _], shape) = (stack.shape, header.shape);
    let area = shape[0] * shape[1];
    let mut values = vec![0.0_f32; area * shape[2]];
    let slab_at_a_time = |first: usize, slabs: &mut [f32]| -> Result<(), ImageError> {
        let mut slices = Slices::new(stack, convert);
        let (mut page, mut sums) = (vec![0.0_f32; width * height], vec![0.0_f64; area]);
        for (slab, means) in (first..).zip(slabs.chunks_exact_mut(area)) {
            sums.fill(0.0);
            for slice in bin * slab..bin * (slab + 1) {
                slices.read(slice, &mut page)?;
                // rows beyond the last complete block are ignored, because `zip` ends at the end of `sums`
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
    Ok(Volume { shape, voxel_mm: header.voxel_mm, values })
}

/// Distributes slices of `area` values among the threads. `each` processes one portion of slices, and gets the index of
/// the first slice of this portion.
///
/// # Errors
/// The first error in the order of the slices, independent of the threads.
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
