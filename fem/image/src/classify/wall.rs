//! Grey values at the wall of a cylinder as they would be if there were matrix instead of air beyond it.
//!
//! The blur of the image mixes air into the voxels at the wall, so that a grain there is as dark as matrix, and mixes
//! grain into the voxels just outside. The image is m (k ∗ C) + c (k ∗ S) above air, with the cylinder C, the grains S,
//! the blur k and the grey values m of the matrix and c of the contrast. The blur of the wall gives k ∗ C, and
//! m (1 − k ∗ C) is added: what remains is the image of grains in a matrix without end, and each grain is shown whole.

use rayon::prelude::*;

use crate::Volume;
use crate::classify::blurred::{FULL, share_at};
use crate::locate::fit::Fit;
use crate::volume::filter::dilate;
use crate::volume::voxel_at;

/// How far the blur of the wall reaches, and how far the specimen is continued (voxels).
const REACH: f64 = 4.0;
/// Voxels beyond the mirror image of a voxel at which air is not blurred.
const CLEAR: f64 = 2.0;
/// Depth of the voxels whose values go on outside.
const DEPTH: f64 = 0.75;
/// How far the blur of grains reaches (voxels).
const BLUR: usize = 3;
/// Fewer voxels than this do not show the blur of the wall.
const FEW: usize = 2000;

/// Voxels at which the specimen's image was continued.
pub(crate) struct Continued {
    /// The specimen, and the voxels beyond it whose values are now those of matrix and of the blur of grains.
    pub(crate) shown: Vec<u8>,
    /// The voxels that may be grain: the specimen, and what lies beyond it where there is no air.
    pub(crate) solid: Vec<u8>,
    /// The voxels whose grey values changed.
    pub(crate) changed: Vec<u8>,
}

/// Puts matrix in the place of the air beyond the specimen's wall and ends. Where there is no air, as the specimen is cut
/// by the edge of the image or by its region, voxels just outside get the values of the nearest ones inside. `matrix` is
/// the matrix's grey value; `grains` are the voxels that are brighter.
pub(crate) fn continue_beyond(
    grey: &mut Volume<u16>,
    fit: &Fit,
    [inside, grains]: [&[u8]; 2],
    [air, void, matrix]: [f64; 3],
) -> Continued {
    let shape = grey.shape;
    let [nx, ny, _] = shape;
    let wide = fit.inside(shape, -REACH);
    let deep = fit.inside(shape, REACH);
    let ring: Vec<u8> = wide.par_iter().zip(&deep).map(|(&wide, &deep)| wide & !deep).collect();
    drop(deep);
    let Some(share) = share_at(grey, inside, &bare(shape, &ring, grains), &ring) else {
        let changed = vec![0; inside.len()];
        return Continued { shown: inside.to_vec(), solid: inside.to_vec(), changed };
    };
    let full = f64::from(FULL);
    let raw = grey.values.clone();
    let is_in_air = |at: usize| {
        beyond(fit, voxel_at(shape, at), shape)
            .is_some_and(|[x, y, z]| f64::from(raw[x + nx * (y + ny * z)]) < void)
    };
    let continued: Vec<(usize, u16, u8)> = (0..wide.len())
        .into_par_iter()
        .filter(|&at| ring[at] != 0)
        .filter_map(|at| {
            if is_in_air(at) {
                let missing = 1.0 - f64::from(share[at]) / full;
                let value = f64::from(raw[at]) + (matrix - air) * missing;
                return Some((at, value.round().clamp(0.0, 65535.0) as u16, inside[at]));
            }
            let [x, y, z] = nearest(fit, voxel_at(shape, at), shape)?;
            let from = x + nx * (y + ny * z);
            (inside[at] == 0 && inside[from] != 0).then(|| (at, raw[from], 1))
        })
        .collect();
    let (mut shown, mut solid) = (inside.to_vec(), inside.to_vec());
    let mut changed = vec![0; inside.len()];
    for (at, value, is_solid) in continued {
        grey.values[at] = value;
        changed[at] = 1;
        shown[at] = 1;
        solid[at] = is_solid;
    }
    Continued { shown, solid, changed }
}

/// The voxels of a ring that the blur of grains does not reach, or the whole ring where these are few. The wall of a
/// packing is a skin of matrix, and with the grains behind it the wall would seem to be blurred more than it is.
fn bare(shape: [usize; 3], ring: &[u8], grains: &[u8]) -> Vec<u8> {
    let near = (1..BLUR).fold(dilate(shape, grains), |near, _| dilate(shape, &near));
    let bare: Vec<u8> = ring.par_iter().zip(&near).map(|(&ring, &near)| ring & !near).collect();
    let count = |set: &[u8]| set.par_iter().map(|&voxel| usize::from(voxel)).sum::<usize>();
    if count(&bare) < FEW { ring.to_vec() } else { bare }
}

/// The voxel beyond the nearer of wall and end, `CLEAR` further outside than a voxel is inside or outside.
fn beyond(fit: &Fit, voxel: [usize; 3], shape: [usize; 3]) -> Option<[usize; 3]> {
    let [square, height] = fit.place(voxel);
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

/// The voxel just inside that is nearest to one outside.
fn nearest(fit: &Fit, voxel: [usize; 3], shape: [usize; 3]) -> Option<[usize; 3]> {
    let [square, height] = fit.place(voxel);
    let (off, least) = (square.sqrt(), fit.radius - DEPTH);
    let stretch = if off > least { least / off } else { 1.0 };
    let within = height.clamp(fit.bottom + DEPTH, fit.top - DEPTH);
    moved(fit, voxel, shape, stretch, within - height)
}

/// The voxel where another comes to lie, with its distance from the axis stretched within the slice, and then raised.
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
