//! Correction of grey values: removes beam hardening, drift and the air that blur mixes into the specimen, and makes
//! grains brighter than the matrix. Each material then has one brightness.

use rayon::prelude::*;

use crate::Volume;
use crate::classify::dark::{Voids, inverted};
use crate::classify::hardening::Brightness;
use crate::classify::level::matrix_grey;
use crate::classify::refine::{Materials, refined};
use crate::classify::wall::continue_beyond;
use crate::locate::fit::Fit;
use crate::locate::specimen::Specimen;
use crate::volume::contrast::Contrast;
use crate::volume::filter::{dilate, median_again};
use crate::volume::grey::Scale;

/// Voxels within this distance from the wall (voxels) contain some air.
const WALL: f64 = 2.0;
/// Depth below the wall (voxels) of the voxels from which the brightness of the matrix is computed.
const BLURRED_WALL: f64 = 3.0;
/// Depth below the wall (voxels) of the voxels from which materials are computed after the blur of a known wall has been
/// removed.
const CORRECTED_RIM: f64 = 1.0;

/// A corrected image in which grains are brighter than the matrix, and sets of its voxels.
pub(super) struct CorrectedImage {
    pub(super) specimen: Specimen,
    /// Voxels of the specimen.
    pub(super) inside: Vec<u8>,
    pub(super) grey: Volume<u16>,
    /// The median-filtered image.
    pub(super) smooth: Volume<u16>,
    pub(super) scale: Scale,
    /// Voxels of the specimen that contain no air: away from its wall and from voids.
    pub(super) sample: Vec<u8>,
    /// Voxels that may be grain: the specimen, and voxels outside the specimen that are not in air.
    pub(super) solid: Vec<u8>,
    /// The voxels of the specimen, and voxels in the air outside the specimen whose grey values contain blur of grains.
    pub(super) shown: Vec<u8>,
    /// Voxels of the specimen that are as dark as air.
    pub(super) voids: Vec<u8>,
    /// Ratio of the brightness of a material at the wall to its brightness at the axis, before the correction.
    pub(super) rim_over_centre: f64,
    /// Ratio of the brightness of a material at the top to its brightness at the bottom, before the correction.
    pub(super) top_over_bottom: f64,
}

/// Settings and inputs of the correction of grey values.
pub(super) struct GreyCorrection<'a> {
    pub(super) specimen: Specimen,
    /// Voxels of the specimen's mask, if there is one.
    pub(super) mask: Option<&'a [u8]>,
    /// Whether the wall and the ends of the cylinder may be moved.
    pub(super) may_move_wall: bool,
    pub(super) contrast: Contrast,
    pub(super) median: bool,
    pub(super) brightness: bool,
}

impl GreyCorrection<'_> {
    /// Corrects the grey values of an image, and of the median-filtered image. If the materials are `known` from an
    /// earlier correction, the wall, the brightness and the blur follow from the image without its grains.
    pub(super) fn run(
        &self,
        mut grey: Volume<u16>,
        mut smooth: Volume<u16>,
        scale: Scale,
        known: Option<&Materials>,
    ) -> CorrectedImage {
        let mut specimen = self.specimen;
        let [mut rim_over_centre, mut top_over_bottom] = [1.0; 2];
        if let Some(fit) = specimen.fit.filter(|_| self.brightness) {
            let brightness = self.brightness_of(&fit, &grey, &smooth, known);
            rim_over_centre = brightness.rim_over_centre();
            top_over_bottom = brightness.top_over_bottom();
            brightness.correct(&mut grey.values, grey.shape, &fit);
            brightness.correct(&mut smooth.values, grey.shape, &fit);
        }
        let bare_image = known.map(|known| known.without_grains(&grey));
        if let (Some(known), Some(bare), true) = (known, &bare_image, self.may_move_wall) {
            let levels = [specimen.air, known.matrix];
            specimen.fit = specimen.fit.map(|fit| refined(&fit, bare, levels));
        }
        let mut inside = specimen.inside(&grey);
        if let Some(mask) = self.mask {
            inside.par_iter_mut().zip(mask).for_each(|(voxel, mask)| *voxel &= mask);
        }
        let mut sample = specimen.sample(&smooth, &inside);
        let materials = match known {
            Some(known) => Some([known.matrix, known.middle()]),
            None => matrix_grey(&smooth, &sample, self.contrast),
        };
        let dark_voids = match (self.contrast, materials) {
            (Contrast::Dark, Some([matrix, _])) => {
                Voids::of(&smooth, &inside, specimen.void, matrix)
            }
            _ => None,
        };
        let (mut shown, mut solid) = (inside.to_vec(), inside.to_vec());
        if let (Some(fit), Some([matrix, split])) = (&specimen.fit, materials) {
            // dark grains have grey values like the blurred wall, which would therefore be classified as grain
            let (from, is_dark) = match self.contrast {
                Contrast::Bright => (&inside[..], false),
                Contrast::Dark => (&sample[..], true),
            };
            let is_grain = |value: u16| match known {
                Some(_) => false, // the contribution of the grains is subtracted
                None => (f64::from(value) < split) == is_dark,
            };
            let grains: Vec<u8> = smooth
                .values
                .par_iter()
                .zip(from)
                .map(|(&value, &from)| u8::from(is_grain(value)) & from)
                .collect();
            let levels = [specimen.air, specimen.void, matrix];
            let sets: [&[u8]; 3] = [&inside, &grains, &sample];
            let beyond = continue_beyond(&mut grey, fit, sets, levels, bare_image.as_ref());
            self.filter_again(&grey, &beyond.changed, &mut smooth);
            if known.is_some() {
                sample = specimen.sample_below(CORRECTED_RIM, &smooth, &inside);
            }
            (shown, solid) = (beyond.shown, beyond.solid);
        }
        let mut voids: Vec<u8> = smooth
            .values
            .par_iter()
            .map(|&value| u8::from(f64::from(value) < specimen.void))
            .collect();
        if let (Some(dark), Some([matrix, _])) = (dark_voids, materials) {
            let changed = dark.fill(&mut grey, &inside, matrix);
            self.filter_again(&grey, &changed, &mut smooth);
            voids.par_iter_mut().zip(&dark.voxels).for_each(|(voxel, void)| *voxel |= void);
        }
        let (grey, smooth, scale) = match self.contrast {
            Contrast::Bright => (grey, smooth, scale),
            Contrast::Dark => (inverted(grey), inverted(smooth), scale.inverted()),
        };
        CorrectedImage {
            grey,
            smooth,
            scale,
            specimen,
            inside,
            sample,
            solid,
            shown,
            voids,
            rim_over_centre,
            top_over_bottom,
        }
    }

    /// Fits the brightness of the specimen as a function of the position.
    fn brightness_of(
        &self,
        fit: &Fit,
        grey: &Volume<u16>,
        smooth: &Volume<u16>,
        known: Option<&Materials>,
    ) -> Brightness {
        let Specimen { air, void, .. } = self.specimen;
        let Some(known) = known else {
            let set = fit.inside(grey.shape, WALL);
            return Brightness::fit(&smooth.values, grey.shape, &set, fit, air, void);
        };
        let mut set = fit.inside(grey.shape, BLURRED_WALL);
        known.keep_matrix(&mut set);
        set.par_iter_mut()
            .zip(&smooth.values)
            .for_each(|(voxel, &value)| *voxel &= u8::from(f64::from(value) >= void));
        let bare = known.without_grains(grey);
        Brightness::of_matrix(&bare.values, grey.shape, &set, fit, air)
    }

    /// Applies the median filter again near the voxels whose grey values changed.
    fn filter_again(&self, grey: &Volume<u16>, changed: &[u8], smooth: &mut Volume<u16>) {
        if self.median {
            let near = dilate(grey.shape, changed);
            median_again(grey.shape, &grey.values, &near, &mut smooth.values);
        } else {
            smooth.values.clone_from(&grey.values);
        }
    }
}
