//! Correction of grey values at the wall of a cylinder, as if matrix instead of air surrounded the cylinder.
//!
//! The blur of the image mixes air into the voxels at the wall, so that a grain at the wall is as dark as matrix.
//! Blur also mixes grain into the voxels just outside the wall. The grey value minus the grey value of air is m (k ∗
//! C) + c (k ∗ S). Here C is the set of voxels in the cylinder, S the set of grain voxels, k the kernel of the blur,
//! m the difference between the grey values of matrix and air, and c the contrast between grain and matrix. The blur
//! of the wall determines k ∗ C, and the correction adds m (1 − k ∗ C). The result is the image of grains in an
//! unbounded matrix, in which each grain is complete. The error of the cylinder's surface is subtracted
//! ([`WallError`]).

use rayon::prelude::*;

use crate::Volume;
use crate::classify::blurred::{FULL, share_at};
use crate::classify::wall_error::{REACH, WallError, depths};
use crate::locate::fit::Fit;
use crate::volume::filter::dilate;
use crate::volume::grey::rounded;
use crate::volume::voxel_at;

/// A voxel is compared with air at its mirror image beyond the wall, moved outward by this distance (voxels), because
/// blur does not affect the air there.
const CLEAR: f64 = 2.0;
/// Depth below the wall (voxels) of the voxels whose values are copied to voxels outside the specimen.
const DEPTH: f64 = 0.75;
/// Distance from a grain (voxels) up to which the blur of the grain changes grey values.
const BLUR: usize = 3;
/// Smallest number of voxels to which the blur of the wall is fitted.
const FEW: usize = 2000;

/// Sets of voxels of the image after the air beyond the wall was replaced by matrix, as if the specimen were larger.
pub(crate) struct Continued {
    /// The specimen, and voxels in the air outside the specimen, which now contain matrix with blur of the specimen's
    /// grains. Voxels outside a cut are not in this set: their grains are not part of the specimen.
    pub(crate) shown: Vec<u8>,
    /// The voxels that may be grain: the specimen, and voxels outside the specimen that are not in air.
    pub(crate) solid: Vec<u8>,
    /// The voxels whose grey values were changed.
    pub(crate) changed: Vec<u8>,
}

/// Replaces the air beyond the specimen's wall and ends by matrix. Where the edge of the image or of the specimen's
/// region cuts the specimen, there is no air to replace. At such a cut, voxels just outside get the values of the
/// nearest voxels inside. `matrix` is the matrix's grey value; `grains` are the voxels classified as grain; `sample`
/// are the voxels away from the wall and from voids. The blur and the error of the wall are measured where the wall has no
/// grains, or everywhere if `bare_image` is given: the image without the contribution of the grains.
pub(crate) fn continue_beyond(
    grey: &mut Volume<u16>,
    fit: &Fit,
    [inside, grains, sample]: [&[u8]; 3],
    [air, void, matrix]: [f64; 3],
    bare_image: Option<&Volume<u16>>,
) -> Continued {
    let shape = grey.shape;
    let [nx, ny, _] = shape;
    let wide = fit.inside(shape, -REACH);
    let deep = fit.inside(shape, REACH);
    let ring: Vec<u8> = wide.par_iter().zip(&deep).map(|(&wide, &deep)| wide & !deep).collect();
    drop(deep);
    let bare = bare(fit, shape, &ring, [grains, sample]);
    let covered = covered(fit, shape, inside, &ring);
    // `None` if the wall shows no air, for example if the whole specimen is cut out of a larger specimen
    let wall_image = bare_image.unwrap_or(grey);
    let share = share_at(wall_image, covered, bare.as_ref().unwrap_or(&ring), &ring);
    let raw = grey.values.clone();
    let is_air_beyond = |at: usize| {
        beyond(fit, voxel_at(shape, at), shape)
            .is_some_and(|[x, y, z]| f64::from(raw[x + nx * (y + ny * z)]) < void)
    };
    let is_in_air = |at: usize| share.is_some() && is_air_beyond(at);
    let with_matrix = |at: usize| {
        let covered = share.as_ref().map_or(1.0, |share| f64::from(share[at]) / f64::from(FULL));
        f64::from(raw[at]) + (matrix - air) * (1.0 - covered)
    };
    let error = WallError::measure(fit, shape, |at| {
        let is_bare = bare.as_ref().is_some_and(|bare| bare[at] != 0);
        let grains = bare_image.map_or(0.0, |bare| f64::from(raw[at]) - f64::from(bare.values[at]));
        (is_bare && is_in_air(at)).then(|| with_matrix(at) - grains - matrix)
    });
    let continued: Vec<(usize, u16, u8)> = (0..wide.len())
        .into_par_iter()
        .filter(|&at| ring[at] != 0)
        .filter_map(|at| {
            if is_in_air(at) {
                let value = with_matrix(at) - error.at(fit, voxel_at(shape, at));
                return Some((at, value.round().clamp(0.0, 65535.0) as u16, inside[at]));
            }
            if is_air_beyond(at) {
                return None;
            }
            let [x, y, z] = below_wall(fit, voxel_at(shape, at), shape, DEPTH)?;
            let from = x + nx * (y + ny * z);
            (inside[at] == 0 && inside[from] != 0).then(|| (at, raw[from], 1))
        })
        .collect();
    let (mut shown, mut solid) = (inside.to_vec(), inside.to_vec());
    let mut changed = vec![0; inside.len()];
    for (at, value, is_solid) in continued {
        grey.values[at] = value;
        changed[at] = 1;
        shown[at] |= 1 - is_solid;
        solid[at] = is_solid;
    }
    Continued { shown, solid, changed }
}

/// Returns the fraction of each voxel's volume that the specimen occupies, in units of 1/[`FULL`]. Only voxels of
/// `ring` can lie partly in the specimen.
fn covered(fit: &Fit, shape: [usize; 3], inside: &[u8], ring: &[u8]) -> Vec<u16> {
    let part = |at: usize| {
        let depths = depths(fit, voxel_at(shape, at));
        depths.map(|depth| (0.5 + depth).clamp(0.0, 1.0)).iter().product::<f64>()
    };
    (0..inside.len())
        .into_par_iter()
        .with_min_len(1 << 12)
        .map(|at| {
            let part = if ring[at] != 0 { part(at) } else { 1.0 };
            match part < 1.0 {
                true => rounded(f64::from(FULL) * part) as u16,
                // a mask given by the user may exclude voxels of the cylinder
                false => u16::from(inside[at]) * FULL,
            }
        })
        .collect()
}

/// Returns the voxels of a ring in which the wall is intact matrix: voxels that the blur of grains does not reach, and
/// that have no void behind them. `None` if there are fewer such voxels than [`FEW`].
///
/// Voxels with blur of grains would make the fitted blur of the wall too large. Where a piece of the specimen is
/// chipped off, the voxels of the ring are air.
fn bare(
    fit: &Fit,
    shape: [usize; 3],
    ring: &[u8],
    [grains, sample]: [&[u8]; 2],
) -> Option<Vec<u8>> {
    let near = (1..BLUR).fold(dilate(shape, grains), |near, _| dilate(shape, &near));
    let is_intact = |at: usize| {
        below_wall(fit, voxel_at(shape, at), shape, REACH)
            .is_some_and(|[x, y, z]| sample[x + shape[0] * (y + shape[1] * z)] != 0)
    };
    let bare: Vec<u8> = (0..ring.len())
        .into_par_iter()
        .with_min_len(1 << 12)
        .map(|at| u8::from(ring[at] != 0 && near[at] == 0 && is_intact(at)))
        .collect();
    let count = bare.par_iter().map(|&voxel| usize::from(voxel)).sum::<usize>();
    (count >= FEW).then_some(bare)
}

/// Returns the voxel in the air that corresponds to a given voxel: the mirror image at the wall or at an end (whichever
/// is nearer), moved outward by `CLEAR` voxels. A voxel that is already outside the cylinder is only moved outward by
/// `CLEAR` voxels. `None` if the result is outside the image.
fn beyond(fit: &Fit, voxel: [usize; 3], shape: [usize; 3]) -> Option<[usize; 3]> {
    let [square, height] = fit.radius_squared_and_height(voxel);
    let off = square.sqrt();
    let (to_wall, to_top, to_bottom) = (fit.radius - off, fit.top - height, height - fit.bottom);
    let to_end = to_top.min(to_bottom);
    if to_wall <= to_end {
        moved(fit, voxel, shape, (fit.radius + to_wall.abs() + CLEAR) / off.max(1e-9), 0.0)
    } else {
        let side = if to_top < to_bottom { 1.0 } else { -1.0 };
        moved(fit, voxel, shape, 1.0, side * (to_end + to_end.abs() + CLEAR))
    }
}

/// Returns the nearest voxel that is at least `depth` voxels below the wall and the ends; `None` if this voxel is
/// outside the image.
fn below_wall(fit: &Fit, voxel: [usize; 3], shape: [usize; 3], depth: f64) -> Option<[usize; 3]> {
    let [square, height] = fit.radius_squared_and_height(voxel);
    let (off, least) = (square.sqrt(), (fit.radius - depth).max(0.0));
    let stretch = if off > least { least / off } else { 1.0 };
    let (low, high) = (fit.bottom + depth, fit.top - depth);
    let within = if low < high { height.clamp(low, high) } else { (low + high) / 2.0 };
    moved(fit, voxel, shape, stretch, within - height)
}

/// Moves a voxel: multiplies its distance from the axis within the slice by `stretch`, and increases z by `rise`
/// (voxels). Returns `None` if the result is outside the image.
fn moved(
    fit: &Fit,
    voxel: [usize; 3],
    shape: [usize; 3],
    stretch: f64,
    rise: f64,
) -> Option<[usize; 3]> {
    let middle = (fit.bottom + fit.top) / 2.0;
    let centre = [0, 1].map(|k| fit.centre[k] + fit.lean[k] * (voxel[2] as f64 + 0.5 - middle));
    let [x, y] = [0, 1].map(|k| centre[k] + stretch * (voxel[k] as f64 + 0.5 - centre[k]));
    let at = [x, y, voxel[2] as f64 + 0.5 + rise].map(f64::floor);
    let is_in = (0..3).all(|k| at[k] >= 0.0 && at[k] < shape[k] as f64);
    is_in.then(|| at.map(|c| c as usize))
}
