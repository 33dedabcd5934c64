//! Error of the correction at the wall.
//!
//! The position of the wall is known to some hundredths of a voxel. This error, times the difference between matrix
//! and air, remains in the corrected image at the wall. If the contrast of the grains is much smaller than this
//! difference, the error looks like grain. Where the wall is intact matrix without grains, the corrected image minus
//! the matrix's grey value is this error. The error depends only on the depth below the wall, the bottom or the top.

use rayon::prelude::*;

use crate::locate::fit::Fit;
use crate::volume::voxel_at;

/// Distance from the wall (voxels) up to which the blur of the wall changes grey values. The specimen is continued up
/// to this distance beyond the wall.
pub(super) const REACH: f64 = 4.0;
/// Number of depths below a surface (wall, bottom or top), from −`REACH` to `REACH` voxels, at which the error of the
/// corrected grey value is measured.
const DEPTHS: usize = 16;
/// Smallest number of voxels from which the error at a depth is measured.
const ENOUGH: usize = 200;
/// Number of surfaces: wall, bottom and top.
const SURFACES: usize = 3;

/// Error of the corrected grey values at each depth below each surface. An error is the median over the voxels at this
/// depth.
pub(super) struct WallError([[f64; DEPTHS]; SURFACES]);

impl WallError {
    /// Measures the errors. For a voxel in which the wall is intact matrix, `excess` returns the corrected grey value
    /// minus the grey value of the matrix; for all other voxels, `excess` returns `None`.
    pub(super) fn measure(
        fit: &Fit,
        shape: [usize; 3],
        excess: impl Fn(usize) -> Option<f64> + Sync,
    ) -> Self {
        let voxels = (0..shape.iter().product()).into_par_iter().with_min_len(1 << 12);
        let shown: Vec<([usize; 2], f64)> = voxels
            .filter_map(|at| {
                let excess = excess(at)?;
                Some((surface_and_depth(fit, voxel_at(shape, at)), excess))
            })
            .collect();
        let mut groups = [const { [const { Vec::new() }; DEPTHS] }; SURFACES];
        for ([surface, depth], excess) in shown {
            groups[surface][depth].push(excess);
        }
        WallError(groups.map(|surface| surface.map(median)))
    }

    /// Returns the error of the corrected grey value of a voxel.
    pub(super) fn at(&self, fit: &Fit, voxel: [usize; 3]) -> f64 {
        let [surface, depth] = surface_and_depth(fit, voxel);
        self.0[surface][depth]
    }
}

/// Returns the median of the values, or 0 if there are fewer than [`ENOUGH`] values.
fn median(mut values: Vec<f64>) -> f64 {
    if values.len() < ENOUGH {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Returns the nearest surface of the cylinder (0 wall, 1 bottom, 2 top), and the index of the voxel's depth below this
/// surface.
fn surface_and_depth(fit: &Fit, voxel: [usize; 3]) -> [usize; 2] {
    let depths = depths(fit, voxel);
    let mut nearest = 0;
    for surface in 1..SURFACES {
        if depths[surface] < depths[nearest] {
            nearest = surface;
        }
    }
    let depth = (depths[nearest] + REACH) / (2.0 * REACH) * DEPTHS as f64;
    [nearest, (depth.max(0.0) as usize).min(DEPTHS - 1)]
}

/// Returns the depths (voxels) of a voxel below the wall, the bottom and the top. A depth is negative outside the
/// cylinder.
pub(super) fn depths(fit: &Fit, voxel: [usize; 3]) -> [f64; 3] {
    let [square, height] = fit.radius_squared_and_height(voxel);
    [fit.radius - square.sqrt(), height - fit.bottom, fit.top - height]
}
