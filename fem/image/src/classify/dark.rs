//! Voids in an image whose grains are darker than the matrix.
//!
//! The blurred boundary between a void and the matrix contains grey values of grains, so that the rim of each void
//! looks like a grain. In a region without grains, the grey value is m − (m − a) (k ∗ V), where V is the set of void
//! voxels, k the kernel of the blur, m the grey value of the matrix and a the grey value of air. The correction adds (m
//! − a) (k ∗ V).

use rayon::prelude::*;

use crate::Volume;
use crate::classify::blurred::{FULL, share_at, whole};
use crate::volume::filter::{dilate, erode};
use crate::volume::grey::rounded;

/// Distance from a void (voxels) up to which the blur of the void changes grey values.
const REACH: usize = 3;

/// Voids of a specimen.
pub(crate) struct Voids {
    /// Voxels whose grey value is closer to air than to the matrix.
    pub(crate) voxels: Vec<u8>,
    /// Mean grey value of the void voxels that are darker than the threshold `void` of [`of`](Self::of).
    air: f64,
}

impl Voids {
    /// Finds the voids of a filtered image: the voxels darker than `void`, and the neighbours of these voxels whose
    /// grey value is closer to air than to the matrix. Returns `None` for an image without voids.
    pub(crate) fn of(smooth: &Volume<u16>, inside: &[u8], void: f64, matrix: f64) -> Option<Voids> {
        // the erosion excludes the outermost voxels of the specimen: blur makes these voxels as dark as air where the
        // wall meets an end
        let core = erode(smooth.shape, inside);
        let pairs = smooth.values.par_iter().zip(&core);
        let deep: Vec<u8> =
            pairs.map(|(&value, &core)| u8::from(f64::from(value) < void) & core).collect();
        let (count, sum) = smooth
            .values
            .par_iter()
            .zip(&deep)
            .filter(|(_, deep)| **deep != 0)
            .map(|(&value, _)| (1_u64, u64::from(value)))
            .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1));
        if count == 0 {
            return None;
        }
        let air = sum as f64 / count as f64;
        let half = (air + matrix) / 2.0;
        let mut voxels = dilate(smooth.shape, &deep);
        voxels.par_iter_mut().enumerate().for_each(|(at, voxel)| {
            let is_air = deep[at] != 0 || f64::from(smooth.values[at]) < half;
            *voxel &= inside[at] & u8::from(is_air);
        });
        Some(Voids { voxels, air })
    }

    /// Replaces voids by matrix; returns the voxels whose grey values changed.
    pub(crate) fn fill(&self, grey: &mut Volume<u16>, inside: &[u8], matrix: f64) -> Vec<u8> {
        let shape = grey.shape;
        let mut near = (0..REACH).fold(self.voxels.clone(), |near, _| dilate(shape, &near));
        near.par_iter_mut().zip(inside).for_each(|(voxel, inside)| *voxel &= inside);
        let solid: Vec<u8> = self.voxels.par_iter().map(|voxel| 1 - voxel).collect();
        let share = share_at(grey, whole(&solid), &near, &near);
        grey.values.par_iter_mut().enumerate().filter(|(at, _)| near[*at] != 0).for_each(
            |(at, value)| {
                let missing = |share: &Vec<i16>| 1.0 - f64::from(share[at]) / f64::from(FULL);
                let added = (matrix - self.air) * share.as_ref().map_or(0.0, missing);
                let filled = match self.voxels[at] {
                    0 => f64::from(*value) + added,
                    _ => matrix,
                };
                *value = rounded(filled.clamp(0.0, 65535.0)) as u16;
            },
        );
        near
    }
}

/// Inverts the grey values of an image.
pub(crate) fn inverted(mut image: Volume<u16>) -> Volume<u16> {
    image.values.par_iter_mut().for_each(|value| *value = u16::MAX - *value);
    image
}
