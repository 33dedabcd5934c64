//! Wall and ends of a thin cylinder, computed from the image without its grains.
//!
//! In a thin cylinder hardly any voxel is away from grains and wall. The grey value of the matrix is therefore unknown
//! when the cylinder is fitted, and the grey level half way between air and matrix, which defines the wall, is wrong.
//! After a first segmentation the grey values of matrix and grains are known. If the contribution of the grains is
//! subtracted from the image, a blurred cylinder of matrix in air remains. The volume of this cylinder is the sum of
//! (grey value − air) / (matrix − air), whatever the blur is. The wall and the ends are moved until the fitted cylinder
//! has this volume.

use std::f64::consts::TAU;

use rayon::prelude::*;

use crate::Volume;
use crate::classify::blurred::{FULL, above, share};
use crate::classify::level::Level;
use crate::classify::wall_error::{REACH, depths};
use crate::locate::fit::{Fit, median, rounded_length};
use crate::volume::voxel_at;

/// Approximate length of a part of the wall along the axis, and edge of a part of an end (voxels).
const PART: f64 = 6.0;
/// Number of parts of the wall around the axis.
const SECTORS: usize = 12;
/// Smallest number of parts of a surface from which the shift of the surface is computed.
const ENOUGH: usize = 5;
/// A surface is not moved by more than this distance (voxels): a larger difference is another body beyond the surface.
const LARGEST_SHIFT: f64 = 0.6;

/// Grey values of matrix and grains, and the grains' contribution to the grey values.
pub(crate) struct Materials {
    /// Grey value of the matrix.
    pub(crate) matrix: f64,
    /// Difference of the grey values of grains and matrix; negative for dark grains.
    contrast: f64,
    /// Share of grain in each voxel of the blurred image, in units of 1/[`FULL`].
    share: Vec<i16>,
}

impl Materials {
    /// Finds the materials in a corrected image, in which grains are brighter than the matrix. `solid` are the voxels
    /// that may be grain and `sample` the voxels without air. `is_dark` is true if the image was inverted because
    /// grains are darker than the matrix; the materials refer to the image before the inversion. Returns `None` if
    /// there are not two materials.
    pub(crate) fn find(
        smooth: &Volume<u16>,
        grey: &Volume<u16>,
        [solid, sample]: [&[u8]; 2],
        is_dark: bool,
    ) -> Option<Self> {
        let level = Level::find(smooth, grey, solid, sample)?;
        let [matrix, grain] = level.materials;
        let share = match level.model {
            Some(model) => model.share,
            None => share(grey, &above(smooth, solid, level.value), sample)?,
        };
        let contrast = grain - matrix;
        Some(match is_dark {
            false => Materials { matrix, contrast, share },
            true => Materials { matrix: f64::from(u16::MAX) - matrix, contrast: -contrast, share },
        })
    }

    /// Returns the grey value half way between matrix and grains.
    pub(crate) fn middle(&self) -> f64 {
        self.matrix + self.contrast / 2.0
    }

    /// Returns an image without the contribution of the grains.
    pub(crate) fn without_grains(&self, grey: &Volume<u16>) -> Volume<u16> {
        let bare = |(&value, &share): (&u16, &i16)| {
            let grains = self.contrast * f64::from(share) / f64::from(FULL);
            (f64::from(value) - grains).round().clamp(0.0, 65535.0) as u16
        };
        grey.with(grey.values.par_iter().zip(&self.share).map(bare).collect())
    }

    /// Removes the voxels that contain more than a quarter of grain from a set of voxels.
    pub(crate) fn keep_matrix(&self, set: &mut [u8]) {
        set.par_iter_mut().zip(&self.share).for_each(|(voxel, &share)| {
            *voxel &= u8::from(i32::from(share) < i32::from(FULL) / 4);
        });
    }
}

/// Part of a surface: sum over its voxels of the share of matrix in the image minus the share in the fitted cylinder, and
/// the number of voxels.
#[derive(Clone, Copy, Default)]
struct Part {
    excess: f64,
    voxels: usize,
}

impl Part {
    fn add(&mut self, excess: f64) {
        self.excess += excess;
        self.voxels += 1;
    }
}

/// Moves the wall and the ends of a cylinder so that the cylinder has the volume of the matrix in an image without
/// grains. `air` and `matrix` are grey values. Each shift is the median over parts of the surface, so that a chipped edge
/// has no effect.
pub(crate) fn refined(fit: &Fit, bare: &Volume<u16>, [air, matrix]: [f64; 2]) -> Fit {
    let shape = bare.shape;
    // depth below the wall up to which voxels belong to the wall, and beyond which they belong to the ends
    let deep = REACH.min(0.5 * fit.radius);
    let length = fit.top - fit.bottom - 2.0 * REACH;
    let layers = (length / PART).floor().max(1.0) as usize;
    let height = length / layers as f64;
    // with an odd number of cells, no voxel is at the boundary of two cells because of the symmetry of the cylinder
    let cells = (2.0 * fit.radius / PART).ceil() as usize | 1;
    let mut wall = vec![Part::default(); layers * SECTORS];
    let mut ends = [vec![Part::default(); cells * cells], vec![Part::default(); cells * cells]];
    let near = fit.inside(shape, -REACH);
    for at in (0..near.len()).filter(|&at| near[at] != 0) {
        let voxel = voxel_at(shape, at);
        let [below_wall, above_bottom, below_top] = depths(fit, voxel);
        let shown = (f64::from(bare.values[at]) - air) / (matrix - air);
        let excess = |depth: f64| shown - (0.5 + depth).clamp(0.0, 1.0);
        let [x, y] = fit.off_axis(voxel);
        if below_wall < deep {
            if above_bottom.min(below_top) >= REACH {
                // the middle of the first sector is the x axis, so that no voxel is at the boundary of two sectors
                let sector = (y.atan2(x) / TAU * SECTORS as f64).round() as i32;
                let sector = sector.rem_euclid(SECTORS as i32) as usize;
                let layer = (((above_bottom - REACH) / height) as usize).min(layers - 1);
                wall[sector + SECTORS * layer].add(excess(below_wall));
            }
            continue;
        }
        let cell = |c: f64| ((0.5 * (c / fit.radius + 1.0) * cells as f64) as usize).min(cells - 1);
        for (parts, depth) in ends.iter_mut().zip([above_bottom, below_top]) {
            if depth < REACH {
                parts[cell(x) + cells * cell(y)].add(excess(depth));
            }
        }
    }
    let shift = |mut shifts: Vec<f64>| match shifts.len() < ENOUGH {
        true => 0.0,
        false => median(&mut shifts).filter(|by| by.abs() < LARGEST_SHIFT).unwrap_or(0.0),
    };
    let area = TAU * fit.radius / SECTORS as f64 * height;
    let outward = shift(wall.iter().map(|part| part.excess / area).collect());
    let [down, up] = ends.map(|parts| {
        // a column of an end has 2 `REACH` voxels; cells at the edge of the end have few columns
        let whole = parts.iter().filter(|part| part.voxels as f64 > PART * PART);
        shift(whole.map(|part| part.excess / part.voxels as f64 * 2.0 * REACH).collect())
    });
    Fit {
        radius: rounded_length(fit.radius + outward),
        bottom: rounded_length(fit.bottom - down),
        top: rounded_length(fit.top + up),
        ..*fit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the image of a cylinder of matrix in air: each voxel has the grey value of the part of its volume that is
    /// in the cylinder, blurred with the weights 1–2–1.
    fn image(shape: [usize; 3], truth: &Fit) -> Volume<u16> {
        let samples = 5_usize;
        let value = |at: usize| {
            let voxel = voxel_at(shape, at).map(|c| c as f64);
            let inside = (0..samples * samples * samples).filter(|n| {
                let part = [n % samples, n / samples % samples, n / (samples * samples)];
                let [x, y, z] =
                    [0, 1, 2].map(|k| voxel[k] + (part[k] as f64 + 0.5) / samples as f64);
                let off = (x - truth.centre[0]).hypot(y - truth.centre[1]);
                off < truth.radius && (truth.bottom..truth.top).contains(&z)
            });
            8000 + (20_000 * inside.count() / samples.pow(3)) as u16
        };
        let values: Vec<u16> = (0..shape.iter().product()).map(value).collect();
        let sharp = Volume::new(shape, 1.0, values).unwrap();
        sharp.with(crate::volume::filter::binomial(shape, &sharp.values))
    }

    #[test]
    fn a_wrong_cylinder_gets_the_radius_and_the_ends_of_the_image() {
        let shape = [32, 32, 48];
        let truth = Fit {
            centre: [16.2, 15.7],
            radius: 9.0,
            bottom: 8.4,
            top: 40.2,
            lean: [0.0; 2],
            wander: 0.0,
            scatter: 0.0,
        };
        let mut image = image(shape, &truth);
        let wrong = Fit { radius: 8.7, bottom: 8.6, top: 40.4, ..truth };
        let check = |found: Fit| {
            let errors =
                [found.radius - truth.radius, found.bottom - truth.bottom, found.top - truth.top];
            assert!(errors.iter().all(|error| error.abs() < 0.02), "{errors:?}");
        };
        // the second move corrects the error of the first move, as in the passes of the program
        let twice = |image: &Volume<u16>| {
            let grey_values = [8000.0, 28_000.0];
            refined(&refined(&wrong, image, grey_values), image, grey_values)
        };
        check(twice(&image));
        // a chip at the wall has no effect
        for at in 0..image.values.len() {
            let [x, _, z] = voxel_at(shape, at);
            if x > 20 && z < 18 {
                image.values[at] = 8000;
            }
        }
        check(twice(&image));
    }
}
