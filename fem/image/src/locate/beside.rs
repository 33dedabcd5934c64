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
/// A section with less than this share of the specimen's sections is a gap of air between the specimen and another
/// body.
const SPLIT: f64 = 0.5;
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

/// A removed body below or above the specimen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pedestal {
    /// First and last slice of the body, counted from 1.
    pub(crate) slices: [usize; 2],
    /// Radius of the body's sections (voxels); `None` for a body that is separated from the specimen by air.
    pub(crate) radius: Option<f64>,
}

impl Pedestal {
    /// Returns a warning about the body. `specimen` is the radius of the specimen (voxels).
    pub(crate) fn in_words(&self, specimen: f64) -> String {
        let [first, last] = self.slices;
        let removed = match self.radius {
            Some(radius) => format!(
                "slices {first} to {last} show a section of {radius:.1} voxels in radius below or above a specimen of \
                 {specimen:.1} voxels in radius and were removed as a pedestal"
            ),
            None => format!(
                "slices {first} to {last} show a body that is separated from the specimen by air and were removed as a pedestal"
            ),
        };
        format!("{removed}: check the slices, or give slices in [specimen.image.region]")
    }
}

/// Areas of the sections of an image perpendicular to the axis of a fitted cylinder, in layers of one voxel.
struct Sections<'a> {
    fit: &'a Fit,
    /// Number of solid voxels in each layer. Layer n has the heights from n to n + 1 (z before the rotation of the
    /// cylinder).
    areas: Vec<f64>,
}

impl<'a> Sections<'a> {
    fn of(image: &Volume<u16>, fit: &'a Fit, edge: f64) -> Self {
        let [nx, ny, nz] = image.shape;
        let is_solid = |value: &u16| f64::from(*value) >= edge;
        let slices = image.values.par_chunks_exact(nx * ny);
        if fit.lean == [0.0; 2] {
            let area = |slice: &[u16]| slice.iter().filter(|value| is_solid(value)).count() as f64;
            return Sections { fit, areas: slices.map(area).collect() };
        }
        let count = |(z, slice): (usize, &[u16])| {
            let mut areas = vec![0_u64; nz];
            for (n, _) in slice.iter().enumerate().filter(|(_, value)| is_solid(value)) {
                let [_, height] = fit.radius_squared_and_height([n % nx, n / nx, z]);
                if let Some(area) = areas.get_mut(height.max(0.0) as usize) {
                    *area += u64::from(height >= 0.0);
                }
            }
            areas
        };
        let none = || vec![0; nz];
        let areas = slices.enumerate().map(count).reduce(none, crate::volume::grey::sum);
        Sections { fit, areas: areas.into_iter().map(|area| area as f64).collect() }
    }

    /// Returns the slice (from 0) in which the axis crosses the middle of a layer.
    fn slice(&self, layer: usize) -> usize {
        let [p, q] = self.fit.lean;
        let middle = (self.fit.bottom + self.fit.top) / 2.0;
        let height = (layer as f64 + 0.5 - middle) / (1.0 + p * p + q * q).sqrt();
        ((middle + height).max(0.0) as usize).min(self.areas.len().saturating_sub(1))
    }

    /// Searches for a gap of air in the layers `outward`, which lead from the middle of the specimen to one of its ends.
    /// Returns the layer in which the gap begins and the height of the specimen that is in this layer and in the layer
    /// before, or `None` if there is no gap with another body behind it.
    fn gap(&self, area: f64, outward: &[usize]) -> Option<(usize, f64)> {
        let share = |n: usize| outward.get(n).map_or(0.0, |&layer| self.areas[layer] / area);
        // a crack through the specimen is thinner than two layers
        let is_air = |n: usize| share(n) < SPLIT;
        let start = (1..outward.len().saturating_sub(1)).find(|&n| is_air(n) && is_air(n + 1))?;
        let beyond = (start + 1..outward.len()).filter(|&n| !is_air(n)).count();
        let own = if share(start + 1) < share(start) { share(start) } else { 0.0 };
        (beyond >= SLICES).then(|| (outward[start], share(start - 1).min(1.0) + own))
    }
}

/// Moves the ends of a cylinder along its axis. Heights are z before the rotation of the cylinder about its middle; the
/// rotation of the result is about its new middle.
fn with_ends(fit: &Fit, [bottom, top]: [f64; 2]) -> Fit {
    let [p, q] = fit.lean;
    let middle = (fit.bottom + fit.top) / 2.0;
    let rise = ((bottom + top) / 2.0 - middle) / (1.0 + p * p + q * q).sqrt();
    let half = (top - bottom) / 2.0;
    let centre = [0, 1].map(|k| fit.centre[k] + fit.lean[k] * rise);
    Fit { centre, bottom: middle + rise - half, top: middle + rise + half, ..*fit }
}

/// Shortens a cylinder by the bodies below or above the specimen. Such a body is separated from the specimen by air, or
/// it is a pedestal: round sections at an end of the cylinder whose radius differs from the radius of the specimen.
/// Sections are perpendicular to the axis of the cylinder. Returns the removed bodies.
pub(crate) fn without_pedestal(image: &Volume<u16>, fit: &mut Fit, edge: f64) -> Vec<Pedestal> {
    let [nx, ny, _] = image.shape;
    let located = *fit;
    let sections = Sections::of(image, &located, edge);
    let areas = &sections.areas;
    let first = fit.bottom.round().max(0.0) as usize;
    let last = (fit.top.round().max(0.0) as usize).min(areas.len());
    if last < first + 8 {
        return Vec::new();
    }
    let quarter = (last - first) / 4;
    let mut middle = areas[first + quarter..last - quarter].to_vec();
    middle.sort_unstable_by(f64::total_cmp);
    let area = middle[middle.len() / 2];
    let is_other = |section: &f64| (section / area - 1.0).abs() > OTHER && *section > 0.1 * area;
    let mut pedestals = Vec::new();
    let mut ends = [fit.bottom, fit.top];
    // the first and the last section of the cylinder contain some air
    let upward: Vec<usize> = (first + 1..last).collect();
    let downward: Vec<usize> = (first..last - 1).rev().collect();
    for (inward, is_bottom) in [(&upward, true), (&downward, false)] {
        let outward: Vec<usize> = match is_bottom {
            true => (first..first + 2 * quarter).rev().collect(),
            false => (last - 2 * quarter..last).collect(),
        };
        let slices = |layer: usize| match is_bottom {
            true => [sections.slice(first) + 1, sections.slice(layer) + 1],
            false => [sections.slice(layer) + 1, sections.slice(last - 1) + 1],
        };
        if let Some((layer, own)) = sections.gap(area, &outward) {
            match is_bottom {
                true => ends[0] = layer as f64 + 2.0 - own,
                false => ends[1] = layer as f64 - 1.0 + own,
            }
            pedestals.push(Pedestal { slices: slices(layer), radius: None });
            continue;
        }
        let run: Vec<usize> = inward.iter().copied().take_while(|&n| is_other(&areas[n])).collect();
        // omit the section at the step between pedestal and specimen, which contains a part of both
        let plain = &run[..run.len().saturating_sub(1)];
        if plain.len() < SLICES || run.len() + 8 > last - first {
            continue;
        }
        let round = |layer: &&usize| {
            is_round(&image.values[nx * ny * sections.slice(**layer)..][..nx * ny], nx, edge)
        };
        if plain.iter().filter(round).count() as f64 <= MOST * plain.len() as f64 {
            continue;
        }
        let mean = plain.iter().map(|&layer| areas[layer]).sum::<f64>() / plain.len() as f64;
        // compute the fraction of the section at the step that belongs to the specimen
        let layer = run[run.len() - 1];
        let part = ((areas[layer] - mean) / (area - mean)).clamp(0.0, 1.0);
        match is_bottom {
            true => ends[0] = layer as f64 + 1.0 - part,
            false => ends[1] = layer as f64 + part,
        }
        let radius = Some((mean / std::f64::consts::PI).sqrt());
        pedestals.push(Pedestal { slices: slices(layer), radius });
    }
    if !pedestals.is_empty() {
        *fit = with_ends(&located, ends);
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
