//! Objects near a specimen in air: a tube around the specimen, a pedestal below or above the specimen.

use rayon::prelude::*;

use crate::Volume;
use crate::locate::fit::Fit;

/// Two limits with the same value: the share of solid voxels above which a disc counts as filled, and the share of
/// round slices above which consecutive slices count as a pedestal.
const MOST: f64 = 0.9;
/// Largest share of solid voxels in a ring of voxels that counts as a gap of air.
const GAP: f64 = 0.3;
/// A section does not belong to the specimen if its area differs from the area of the specimen's sections by more than
/// this share.
const OTHER: f64 = 0.08;
/// Minimum number of slices of a pedestal.
const SLICES: usize = 3;
/// Half width of the blurred edge of an object (voxels).
const BLUR: f64 = 1.5;

/// Returns the inner and the outer radius (voxels) of a ring of air around the specimen and inside the fitted cylinder,
/// or `None` if there is no such ring. Such a ring shows that the cylinder was fitted to a tube.
pub(crate) fn gap(image: &Volume<u16>, fit: &Fit, edge: f64) -> Option<[f64; 2]> {
    let rings = fit.radius.ceil() as usize + 1;
    let mut counts = vec![[0_u64; 2]; rings];
    let [nx, ny, nz] = image.shape;
    let quarter = 0.25 * (fit.top - fit.bottom);
    for z in (0..nz).filter(|&z| {
        let height = z as f64 + 0.5;
        height > fit.bottom + quarter && height < fit.top - quarter
    }) {
        let slice = &image.values[nx * ny * z..][..nx * ny];
        for (n, &value) in slice.iter().enumerate() {
            let ring = fit.radius_squared_and_height([n % nx, n / nx, z])[0].sqrt() as usize;
            if ring < rings {
                counts[ring][0] += 1;
                counts[ring][1] += u64::from(f64::from(value) >= edge);
            }
        }
    }
    let solid = |ring: usize| counts[ring][1] as f64 / counts[ring][0].max(1) as f64;
    // search from outside to inside: first the tube, then the gap, then the specimen
    let wall = (0..rings).rev().find(|&ring| solid(ring) > 0.5)?;
    let outer = (0..wall).rev().find(|&ring| solid(ring) < GAP)?;
    let inner = (0..outer).rev().find(|&ring| solid(ring) > 0.5)?;
    let all = |counts: &[[u64; 2]], k: usize| counts.iter().map(|c| c[k]).sum::<u64>() as f64;
    let core = &counts[..inner];
    let is_solid = inner >= 3 && all(core, 1) > 0.5 * all(core, 0);
    is_solid.then_some([inner as f64 + 1.0, outer as f64 + 1.0])
}

/// A removed pedestal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pedestal {
    /// First and last slice of the pedestal, counted from 1.
    pub(crate) slices: [usize; 2],
    /// Radius of the pedestal's sections (voxels).
    pub(crate) radius: f64,
}

/// Shortens an upright cylinder by the slices of pedestals. A pedestal consists of round sections at an end of the
/// cylinder whose radius differs from the radius of the specimen. Returns the removed pedestals.
pub(crate) fn without_pedestal(image: &Volume<u16>, fit: &mut Fit, edge: f64) -> Vec<Pedestal> {
    if fit.lean != [0.0; 2] {
        return Vec::new();
    }
    let [nx, ny, _] = image.shape;
    let is_solid = |value: &&u16| f64::from(**value) >= edge;
    let sections: Vec<f64> = image
        .values
        .par_chunks_exact(nx * ny)
        .map(|slice| slice.iter().filter(is_solid).count() as f64)
        .collect();
    let first = fit.bottom.round().max(0.0) as usize;
    let last = (fit.top.round() as usize).min(sections.len());
    if last < first + 8 {
        return Vec::new();
    }
    let quarter = (last - first) / 4;
    let mut areas = sections[first + quarter..last - quarter].to_vec();
    areas.sort_unstable_by(f64::total_cmp);
    let area = areas[areas.len() / 2];
    let is_other = |section: &f64| (section / area - 1.0).abs() > OTHER && *section > 0.1 * area;
    let mut pedestals = Vec::new();
    // the first and the last slice of the cylinder contain some air
    let from_bottom: Vec<usize> =
        (first + 1..last).take_while(|&z| is_other(&sections[z])).collect();
    let from_top: Vec<usize> =
        (first..last - 1).rev().take_while(|&z| is_other(&sections[z])).collect();
    for (run, is_bottom) in [(from_bottom, true), (from_top, false)] {
        // omit the slice at the step between pedestal and specimen, which contains a part of both
        let plain = &run[..run.len().saturating_sub(1)];
        if plain.len() < SLICES || run.len() + 8 > last - first {
            continue;
        }
        let round = |z: &&usize| is_round(&image.values[nx * ny * **z..][..nx * ny], nx, edge);
        if plain.iter().filter(round).count() as f64 <= MOST * plain.len() as f64 {
            continue;
        }
        let mean = plain.iter().map(|&z| sections[z]).sum::<f64>() / plain.len() as f64;
        // compute the fraction of the slice at the step that belongs to the specimen
        let z = run[run.len() - 1];
        let part = ((sections[z] - mean) / (area - mean)).clamp(0.0, 1.0);
        let radius = (mean / std::f64::consts::PI).sqrt();
        if is_bottom {
            fit.bottom = z as f64 + 1.0 - part;
            pedestals.push(Pedestal { slices: [first + 1, z + 1], radius });
        } else {
            fit.top = z as f64 + part;
            pedestals.push(Pedestal { slices: [z + 1, last], radius });
        }
    }
    pedestals
}

/// Returns whether the solid voxels of a slice fill a disc about their centroid, with hardly any solid voxels outside
/// the disc.
fn is_round(slice: &[u16], nx: usize, edge: f64) -> bool {
    let solid = || {
        let voxels = slice.iter().enumerate().filter(|(_, value)| f64::from(**value) >= edge);
        voxels.map(|(n, _)| [(n % nx) as f64 + 0.5, (n / nx) as f64 + 0.5])
    };
    let (mut area, mut sum) = (0.0, [0.0; 2]);
    for [x, y] in solid() {
        area += 1.0;
        sum = [sum[0] + x, sum[1] + y];
    }
    let centre = sum.map(|sum| sum / area);
    let radius = (area / std::f64::consts::PI).sqrt();
    let within =
        |r: f64| solid().filter(|[x, y]| (x - centre[0]).hypot(y - centre[1]) < r).count() as f64;
    let inner = (radius - BLUR).max(1.0);
    let is_filled = within(inner) > MOST * std::f64::consts::PI * inner * inner;
    is_filled && within(radius + BLUR) > (1.0 - 0.02) * area
}
