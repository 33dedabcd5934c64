//! Grey values at the wall of a cylinder as they would be if the specimen went on beyond it.
//!
//! The blur of the image mixes air into the voxels at the wall, so that a grain there is as dark as matrix. Which share
//! of a voxel the image shows as specimen follows from the cylinder and the blur of its wall; the grey value above air is
//! divided by this share. Voxels just outside are given the values of the nearest ones inside, so that filters find a neighbourhood
//! there.

use rayon::prelude::*;

use crate::Volume;
use crate::classify::blurred::{FULL, share};
use crate::locate::fit::Fit;
use crate::volume::voxel_at;

/// How far the blur of the wall reaches, and how far the specimen is continued (voxels).
const REACH: f64 = 4.0;
/// Voxels beyond the mirror image of a voxel at which air is not blurred.
const CLEAR: f64 = 2.0;
/// Depth of the voxels whose values go on outside.
const DEPTH: f64 = 0.75;
/// Noise is not raised by more than the inverse of this share.
const LEAST: f64 = 0.4;

/// Continues the specimen beyond its wall and ends. Gives the set of voxels whose values then are the specimen's: those
/// inside and those that were filled.
pub(crate) fn continue_beyond(
    grey: &mut Volume<u16>,
    fit: &Fit,
    inside: &[u8],
    [air, void]: [f64; 2],
) -> Vec<u8> {
    let shape = grey.shape;
    let [nx, ny, _] = shape;
    let wide = fit.inside(shape, -REACH);
    let deep = fit.inside(shape, REACH);
    let ring: Vec<u8> = wide.par_iter().zip(&deep).map(|(&wide, &deep)| wide & !deep).collect();
    drop(deep);
    let Some(share) = share(grey, inside, &ring) else { return inside.to_vec() };
    let full = f64::from(FULL);
    let raw = grey.values.clone();
    // a specimen that is cut by the edge of the image, or goes on beyond its region, is not darker there
    let is_in_air = |at: usize| {
        beyond(fit, voxel_at(shape, at), shape)
            .is_some_and(|[x, y, z]| f64::from(raw[x + nx * (y + ny * z)]) < void)
    };
    grey.values.par_iter_mut().enumerate().for_each(|(at, value)| {
        if inside[at] != 0 && ring[at] != 0 && is_in_air(at) {
            let part = (f64::from(share[at]) / full).clamp(LEAST, 1.0);
            let bright = air + (f64::from(*value) - air) / part;
            *value = bright.round().clamp(0.0, 65535.0) as u16;
        }
    });
    drop((share, raw));
    let mut set = inside.to_vec();
    let filled: Vec<(usize, u16)> = (0..wide.len())
        .into_par_iter()
        .filter(|&at| wide[at] != 0 && inside[at] == 0)
        .filter_map(|at| {
            let [x, y, z] = nearest(fit, voxel_at(shape, at), shape)?;
            let from = x + nx * (y + ny * z);
            (inside[from] != 0).then(|| (at, grey.values[from]))
        })
        .collect();
    for (at, value) in filled {
        grey.values[at] = value;
        set[at] = 1;
    }
    set
}

/// The voxel beyond the nearer of wall and end, as far outside as a voxel is inside and `CLEAR` further.
fn beyond(fit: &Fit, voxel: [usize; 3], shape: [usize; 3]) -> Option<[usize; 3]> {
    let [square, height] = fit.place(voxel);
    let off = square.sqrt();
    let (to_wall, to_top, to_bottom) = (fit.radius - off, fit.top - height, height - fit.bottom);
    let to_end = to_top.min(to_bottom);
    if to_wall <= to_end {
        moved(fit, voxel, shape, (fit.radius + to_wall + CLEAR) / off.max(1e-9), 0.0)
    } else {
        let side = if to_top < to_bottom { 1.0 } else { -1.0 };
        moved(fit, voxel, shape, 1.0, side * (2.0 * to_end + CLEAR))
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
