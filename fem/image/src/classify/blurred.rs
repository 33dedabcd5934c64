//! A model of an image as two materials and blur.
//!
//! Small grains have hardly any voxels far from their surface, so the grey value of the grain material cannot be
//! computed as a mean over voxels. The image is modelled instead: a set of voxels S is grain, all other voxels are
//! matrix, and the grey value is m + c (k ∗ S), with the matrix's grey value m, the contrast c and a kernel k. The
//! kernel k is a mixture of binomial kernels kᵢ, k = Σ aᵢ kᵢ with aᵢ ≥ 0 and Σ aᵢ = 1. The values m and c aᵢ follow from
//! linear least squares, without an assumption about the width of the blur or the form of the grains. Then m and c are
//! computed again from the *purest* voxels, which the blur of the other material affects least and in which an error of
//! S hardly matters. The values of k ∗ S identify these voxels.
//!
//! The condition aᵢ ≥ 0 is necessary, because S comes from the filtered image and is therefore smoother than the grains.
//! Without the condition, least squares compensate this difference by a negative weight of the widest kernel. Then k ∗ S
//! is negative beside a grain, and the purest voxels are voxels at interfaces, whose grey values are between the two
//! materials.
//!
//! The sum over all voxels of (grey value − m) equals the grains' volume times c. S is the set of voxels above a level
//! in the filtered image, and the level is chosen such that S has the grains' volume. With the level half way between
//! the materials, blur and median filter would shrink convex grains.

use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;

use crate::Volume;
use crate::volume::filter::{binomial, binomial_at, dilate};
use crate::volume::grey::rounded;
use crate::volume::threshold::{histogram, level_of};

/// Number of kernels in the mixture that represents the blur.
const KERNELS: usize = 3;
/// Number of passes of the filter with the weights 1–2–1 for each kernel. The kernels have variances of 0, 0.5 and 1.5
/// voxels².
const PASSES: [usize; KERNELS] = [0, 1, 3];
/// Fixed-point value of a voxel that consists of grain only.
pub(crate) const FULL: u16 = 16384;
/// Largest number of iterations in the search for the level, the grey value that separates matrix from grain.
const ROUNDS: usize = 8;
/// The level has converged if it changes by less than this value in an iteration, as a share of the contrast.
const STILL: f64 = 0.004;
/// Lower and upper limit of the level between matrix and grain, as shares of the contrast above the matrix's grey
/// value.
const LEVEL_RANGE: [f64; 2] = [0.15, 0.85];
/// Smallest number of voxels above the level from which the contrast is computed.
const LEAST: u64 = 150;
/// The grey value of a material is computed from this share of its voxels, the *purest* voxels, which the blur of the
/// other material affects least. If grains are large, the blur does not reach these voxels.
const PUREST: f64 = 0.1;
/// Limits to which shares of grain are clamped before they are summed. Noise lies within the limits; only pores are
/// clamped.
const CUT: [f64; 2] = [-0.5, 1.5];

/// Result of the model: grey values of matrix and grains, and the set of grain voxels.
#[derive(Clone, Debug)]
pub(crate) struct Blurred {
    /// Grey value of the matrix.
    pub(crate) matrix: f64,
    /// Grey value of the grains.
    pub(crate) grain: f64,
    /// Grey level of the filtered image. The number of voxels above this level equals the volume of the grains.
    pub(crate) level: f64,
    /// Voxels whose value in the filtered image is at least the level.
    pub(crate) set: Vec<u8>,
    /// Share of grain in each voxel of the unfiltered image according to the model, in units of 1/[`FULL`].
    pub(crate) share: Vec<i16>,
    /// Largest share of grain among the purest matrix voxels, and smallest share of grain among the purest grain
    /// voxels.
    pub(crate) purest: [i16; 2],
}

impl Blurred {
    /// Fits the model to the voxels of `sample`, which contain no air. `inside` are the voxels that may be grain, and
    /// `start` is the initial level. Returns `None` if no level between two materials is found.
    pub(crate) fn fit(
        smooth: &Volume<u16>,
        grey: &Volume<u16>,
        inside: &[u8],
        sample: &[u8],
        start: f64,
    ) -> Option<Self> {
        let counts = histogram(&smooth.values, sample);
        let mut level = start;
        let mut last = None;
        for round in 0..ROUNDS {
            let set = above(smooth, inside, level);
            let share = share(grey, &set, sample)?;
            let purest = purest(&share, &set, sample);
            let [matrix, contrast] = materials(&grey.values, &share, purest, sample)?;
            let volume = volume(&grey.values, &share, &set, sample, [matrix, contrast]);
            let limits = LEVEL_RANGE.map(|way| matrix + way * contrast);
            let next = level_of(&counts, volume).clamp(limits[0], limits[1]);
            if (next - level).abs() <= STILL * contrast || round + 1 == ROUNDS {
                return Some(Blurred {
                    matrix,
                    grain: matrix + contrast,
                    level,
                    set,
                    share,
                    purest,
                });
            }
            // secant method for the level at which `next` equals `level`
            let move_by = next - level;
            let slope =
                last.map_or(-1.0, |[before, moved]: [f64; 2]| (move_by - moved) / (level - before));
            last = Some([level, move_by]);
            level -= move_by / slope.clamp(-1.0, -0.45);
        }
        None
    }

    /// Returns the grey value half way between matrix and grain.
    pub(crate) fn middle(&self) -> f64 {
        (self.matrix + self.grain) / 2.0
    }
}

/// Returns 1 for each voxel of a set whose value is at least `level`, and 0 for all other voxels.
pub(crate) fn above(smooth: &Volume<u16>, inside: &[u8], level: f64) -> Vec<u8> {
    let values = smooth.values.par_iter().zip(inside);
    values.map(|(&value, &inside)| u8::from(f64::from(value) >= level) & inside).collect()
}

/// Returns the share of a set in each voxel of the blurred image, in units of 1/[`FULL`]. The blur is fitted to the
/// image in the voxels of `sample`. `None` if the image is not brighter in the set than outside the set.
pub(crate) fn share(grey: &Volume<u16>, set: &[u8], sample: &[u8]) -> Option<Vec<i16>> {
    mixed(&grey.values, whole(set), sample, |_, blurred| binomial(grey.shape, blurred))
}

/// Returns the shares of a set without blur, in units of 1/[`FULL`]: the share is [`FULL`] in each voxel of the set,
/// and 0 in all other voxels.
pub(crate) fn whole(set: &[u8]) -> Vec<u16> {
    set.par_iter().map(|&voxel| u16::from(voxel) * FULL).collect()
}

/// Computes the shares of [`share`] only at the voxels of `region`, which contains `sample`; the values at all other
/// voxels are unspecified. `covered` is the fraction of each voxel's volume that a body occupies, in units of
/// 1/[`FULL`].
pub(crate) fn share_at(
    grey: &Volume<u16>,
    covered: Vec<u16>,
    sample: &[u8],
    region: &[u8],
) -> Option<Vec<i16>> {
    // each pass of the filter reads the result of the previous pass in one more layer of voxels
    let near = dilate(grey.shape, region);
    let wide = dilate(grey.shape, &near);
    let regions: [&[u8]; PASSES[KERNELS - 1]] = [&wide, &near, region];
    mixed(&grey.values, covered, sample, |pass, blurred| {
        binomial_at(grey.shape, blurred, regions[pass])
    })
}

/// Fits the mixture of kernels to the grey values of a sample. `sharp` are the shares without blur; `blur` applies one
/// pass of the filter 1–2–1.
fn mixed(
    grey: &[u16],
    sharp: Vec<u16>,
    sample: &[u8],
    blur: impl Fn(usize, &[u16]) -> Vec<u16>,
) -> Option<Vec<i16>> {
    let mut kernels = [const { Vec::new() }; KERNELS];
    let count = sharp.len();
    kernels[0] = sharp;
    let mut passes = 0;
    for (k, &until) in PASSES.iter().enumerate().skip(1) {
        let mut blurred = blur(passes, &kernels[k - 1]);
        for pass in passes + 1..until {
            blurred = blur(pass, &blurred);
        }
        (passes, kernels[k]) = (until, blurred);
    }
    let weights = weights(grey, &kernels, sample)?;
    let mixed =
        |at: usize| -> f64 { (0..KERNELS).map(|k| weights[k] * f64::from(kernels[k][at])).sum() };
    Some((0..count).into_par_iter().map(|at| rounded(mixed(at)) as i16).collect())
}

/// Returns the weights of the kernels by least squares over the voxels of a sample. No weight is negative, and the sum of
/// the weights is 1. `None` if the grey value does not increase with the share.
fn weights(grey: &[u16], kernels: &[Vec<u16>; KERNELS], sample: &[u8]) -> Option<[f64; KERNELS]> {
    // number of terms of the normal equations: 1, the kernels and the grey value; all their pairwise products are
    // summed
    const TERMS: usize = KERNELS + 2;
    let portion = 1 << 16;
    // sum integers, so that the result does not depend on the order of summation
    let sums = (0..sample.len().div_ceil(portion))
        .into_par_iter()
        .map(|part| {
            let mut sums = [[0_u64; TERMS]; TERMS];
            let voxels = portion * part..(portion * (part + 1)).min(sample.len());
            for n in voxels.filter(|&n| sample[n] != 0) {
                let terms: [u64; TERMS] = std::array::from_fn(|k| match k {
                    0 => 1,
                    k if k <= KERNELS => u64::from(kernels[k - 1][n]),
                    _ => u64::from(grey[n]),
                });
                // compute only the upper triangle of the symmetric matrix of sums
                for i in 0..TERMS {
                    for j in i..TERMS {
                        sums[i][j] += terms[i] * terms[j];
                    }
                }
            }
            sums.map(|row| row.map(u128::from))
        })
        .reduce(
            || [[0_u128; TERMS]; TERMS],
            |a, b| std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + b[i][j])),
        );
    if sums[0][1] < u128::from(LEAST) * u128::from(FULL) {
        return None;
    }
    // the products are exact, so that the differences do not depend on the mean grey value
    let covariance = |i: usize, j: usize| {
        let [product, means] = [sums[0][0] * sums[i.min(j)][i.max(j)], sums[0][i] * sums[0][j]];
        product as i128 - means as i128
    };
    let normal = SMatrix::from_fn(|i, j| covariance(i + 1, j + 1) as f64);
    let right = SVector::from_fn(|i, _| covariance(i + 1, TERMS - 1) as f64);
    let parts = non_negative(&normal, &right)?;
    let contrast = parts.sum();
    Some(std::array::from_fn(|k| parts[k] / contrast))
}

/// Solves a least-squares problem with the condition that no unknown is negative, by trying all sets of unknowns that
/// may differ from 0. `normal` and `right` are the normal equations. Returns `None` if all unknowns are 0.
fn non_negative(
    normal: &SMatrix<f64, KERNELS, KERNELS>,
    right: &SVector<f64, KERNELS>,
) -> Option<SVector<f64, KERNELS>> {
    let candidates = (1_usize..1 << KERNELS).filter_map(|set| {
        let is_free = |k: usize| set >> k & 1 == 1;
        let reduced =
            SMatrix::<f64, KERNELS, KERNELS>::from_fn(|i, j| match is_free(i) && is_free(j) {
                true => normal[(i, j)],
                false => f64::from(u8::from(i == j)),
            });
        let reduced_right =
            SVector::<f64, KERNELS>::from_fn(|i, _| if is_free(i) { right[i] } else { 0.0 });
        let solution = reduced.cholesky()?.solve(&reduced_right);
        solution.iter().all(|&value| value >= 0.0).then_some(solution)
    });
    // the sum of squared residuals decreases by this product
    let decrease = |solution: &SVector<f64, KERNELS>| solution.dot(right);
    let best = candidates.max_by(|a, b| decrease(a).total_cmp(&decrease(b)))?;
    (decrease(&best) > 0.0).then_some(best)
}

/// Returns the grey value of the matrix and the contrast, computed from the purest voxels.
fn materials(
    grey: &[u16],
    share: &[i16],
    [most, least]: [i16; 2],
    sample: &[u8],
) -> Option<[f64; 2]> {
    let full = f64::from(FULL);
    // number of the purest voxels, sum of their shares and sum of their grey values, for matrix and for grains
    let sums = (0..share.len())
        .into_par_iter()
        .with_min_len(1 << 16)
        .filter(|&n| sample[n] != 0)
        .fold(
            || [[0_i64; 3]; 2],
            |mut sums, n| {
                let class = match (share[n] <= most, share[n] >= least) {
                    (true, _) => 0,
                    (_, true) => 1,
                    _ => return sums,
                };
                let terms = [1, i64::from(share[n]), i64::from(grey[n])];
                sums[class].iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
                sums
            },
        )
        .reduce(|| [[0; 3]; 2], |a, b| [0, 1].map(|k| std::array::from_fn(|n| a[k][n] + b[k][n])));
    let [dark, bright] = sums.map(|sums| sums.map(|sum| sum as f64));
    if dark[0] == 0.0 || bright[0] == 0.0 {
        return None;
    }
    let mean = |sums: [f64; 3]| [sums[1] / sums[0] / full, sums[2] / sums[0]];
    let [[dark_share, dark], [bright_share, bright]] = [mean(dark), mean(bright)];
    let contrast = (bright - dark) / (bright_share - dark_share);
    (contrast > 0.0).then_some([dark - contrast * dark_share, contrast])
}

/// Returns the largest share of grain among the purest matrix voxels, and the smallest share of grain among the purest
/// grain voxels.
fn purest(share: &[i16], set: &[u8], sample: &[u8]) -> [i16; 2] {
    // number of bins of the histogram of shares; a bin has the width 1/256, and the first bin starts at the share −0.5
    const BINS: usize = 512;
    let width = i32::from(FULL / 256);
    let first = -i32::from(FULL / 2);
    let counts = (0..share.len())
        .into_par_iter()
        .with_min_len(1 << 16)
        .filter(|&n| sample[n] != 0)
        .fold(
            || vec![0_u64; 2 * BINS],
            |mut counts, n| {
                let bin = ((i32::from(share[n]) - first) / width).clamp(0, BINS as i32 - 1);
                counts[BINS * usize::from(set[n]) + bin as usize] += 1;
                counts
            },
        )
        .reduce(|| vec![0; 2 * BINS], crate::volume::grey::sum);
    let (matrix, grain) = counts.split_at(BINS);
    let bound = |bin: usize| (first + bin as i32 * width) as i16;
    let reversed: Vec<u64> = grain.iter().rev().copied().collect();
    [bound(bins_of(matrix)) - 1, bound(BINS - bins_of(&reversed))]
}

/// Returns how many bins, counted from the first bin, are needed to contain the share [`PUREST`] of all counts.
fn bins_of(counts: &[u64]) -> usize {
    let wanted = PUREST * counts.iter().sum::<u64>() as f64;
    let mut over = 0;
    let last = counts.iter().position(|&count| {
        over += count;
        count > 0 && over as f64 >= wanted
    });
    last.map_or(counts.len(), |bin| bin + 1)
}

/// Returns the volume of the grains in the sample (voxels): the volume of the set, plus the difference between the
/// volumes in the image and in the model.
fn volume(
    grey: &[u16],
    share: &[i16],
    set: &[u8],
    sample: &[u8],
    [matrix, contrast]: [f64; 2],
) -> f64 {
    let unit = 65536.0;
    let sum: i64 = (0..share.len())
        .into_par_iter()
        .with_min_len(1 << 16)
        .filter(|&n| sample[n] != 0 && share[n] > 0)
        .map(|n| {
            let shown = (f64::from(grey[n]) - matrix) / contrast;
            let beyond = shown.clamp(CUT[0], CUT[1]) - f64::from(share[n]) / f64::from(FULL);
            rounded((f64::from(set[n]) + beyond) * unit) as i64
        })
        .sum();
    sum as f64 / unit
}
