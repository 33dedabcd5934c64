//! Check of labels that have no label of the background: the corners of the image may be air.

use rayon::prelude::*;

use crate::Volume;

/// Share of the area of a slice that is outside the largest ellipse in the slice, 1 − π/4.
const CORNERS: f64 = 1.0 - std::f64::consts::FRAC_PI_4;
/// Corners without grains are reported only if their probability is below this value for grains at random positions.
const CHANCE: f64 = 0.05;

/// Returns a warning if an image, all of which counts as specimen, has no grain outside the largest upright elliptic
/// cylinder in the image, as an image of a cylindrical specimen in air.
pub(super) fn empty_corners(labels: &Volume<u32>, grains: usize) -> Option<String> {
    if (1.0 - CORNERS).powi(grains.min(10_000) as i32) >= CHANCE {
        return None;
    }
    let [nx, ny, _] = labels.shape;
    let relative = |at: usize, side: usize| ((2 * at + 1) as f64 - side as f64) / side as f64;
    let is_corner: Vec<bool> = (0..nx * ny)
        .map(|n| relative(n % nx, nx).powi(2) + relative(n / nx, ny).powi(2) > 1.0)
        .collect();
    let slices = labels.values.par_chunks_exact(nx * ny);
    let has_grain = slices.any(|slice| {
        slice.iter().zip(&is_corner).any(|(label, is_corner)| *is_corner && *label != 0)
    });
    (!has_grain).then(|| {
        "the grain fraction is too small if the corners of the image are air: the whole image counts as specimen, but all four \
         corners of all slices have no grain, as in an image of a cylinder in which air and matrix have the same label: give the \
         label of air as background, or give the cylinder in [specimen.image.region]"
            .to_owned()
    })
}
