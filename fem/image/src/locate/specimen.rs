//! Where the specimen is in its image, and which grey values are air.

use rayon::prelude::*;

use crate::locate::beside::{gap, without_pedestal};
use crate::locate::fit::{Fit, fit};
use crate::locate::region::SpecimenRegion;
use crate::locate::surroundings::{Surroundings, checked_filling, filling};
use crate::volume::contrast::Contrast;
use crate::volume::filter::core;
use crate::volume::threshold::{WIDTH, class_means, core_mean, histogram, otsu};
use crate::{ImageError, Volume};

/// Voxels at the wall whose grey values hold some air once the median has been taken.
const RIM: f64 = 3.0;
/// Half of the value of a mask's voxels.
const EDGE: u16 = 16384;
/// A wall whose points scatter by more than this (voxels, and share of the radius) is doubtful.
const SCATTER: [f64; 2] = [0.6, 0.01];

/// What an image shows of its specimen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SpecimenForm {
    /// A cylinder if there is air around it, else a block. Cut cylinders, platens in view and surroundings that are
    /// brighter than the specimen are refused.
    #[default]
    Auto,
    /// A whole cylinder in air, its axis about along z.
    Cylinder,
    /// A block cut out of a specimen: all of the image belongs to it.
    Block,
}

/// How a specimen is located.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Locating<'a> {
    pub(crate) form: SpecimenForm,
    pub(crate) follow_lean: bool,
    /// Air is taken to be the darkest, whatever the contrast of grains.
    pub(crate) contrast: Contrast,
    /// The least grey value that is not air, if it was given by hand.
    pub(crate) void: Option<f64>,
    pub(crate) region: &'a SpecimenRegion,
}

/// The specimen in its image, in 16-bit grey values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Specimen {
    /// The cylinder; absent for a block.
    pub(crate) fit: Option<Fit>,
    pub(crate) air: f64,
    /// The least grey value that is not air; 0 if there is no air.
    pub(crate) void: f64,
}

impl Locating<'_> {
    /// Locates the specimen in a filtered image. What is doubtful is added to `warnings`.
    pub(crate) fn specimen(
        &self,
        image: &Volume<u16>,
        warnings: &mut Vec<String>,
    ) -> Result<Specimen, ImageError> {
        let block = Specimen { fit: None, air: 0.0, void: self.void.unwrap_or(0.0) };
        if self.form == SpecimenForm::Block {
            return Ok(block);
        }
        let Some(levels) = Levels::of(image, self.void, self.contrast) else { return Ok(block) };
        let Levels { air, void, edge, bright } = levels;
        let by_hand = self.region.fit();
        if let Some(fit) = by_hand {
            return Ok(Specimen { fit: Some(fit), air, void });
        }
        if self.form == SpecimenForm::Auto
            && self.region.is_empty()
            && Surroundings::of(image, void, bright).accepted()? == Surroundings::Block
        {
            return Ok(block);
        }
        let mut restricted = self.region.restricted(image, air);
        let seen = restricted.as_ref().unwrap_or(image);
        let mut found = fit(seen, edge, self.follow_lean)?;
        if let Some([inner, outer]) = gap(seen, &found, edge) {
            let tube = SpecimenRegion {
                centre_px: Some(found.centre),
                radius_px: Some((inner + outer) / 2.0),
                ..SpecimenRegion::default()
            };
            let [x, y] = found.centre;
            warnings.push(format!(
                "a tube of {outer:.1} to {:.1} voxels in radius around ({x:.1}, {y:.1}) was left out, as there is air between it and the specimen: look at the slices, or give centre_px, radius_px and slices in [specimen.image.region]",
                found.radius
            ));
            restricted = tube.restricted(seen, air);
            found = fit(restricted.as_ref().unwrap_or(image), edge, self.follow_lean)?;
        } else {
            let cut = without_pedestal(seen, &mut found, edge);
            warnings.extend(cut.iter().map(|part| {
                format!(
                    "slices {} to {} show a section of {:.1} voxels in radius below or above a specimen of {:.1} and were left out as a pedestal: look at the slices, or give slices in [specimen.image.region]",
                    part.slices[0], part.slices[1], part.radius, found.radius
                )
            }));
        }
        let found = self.region.overriding(found);
        let seen = restricted.as_ref().unwrap_or(image);
        self.doubts(seen, &found, edge, warnings)?;
        Ok(Specimen { fit: Some(found), air, void })
    }

    /// The specimen of a mask, whose cylinder is fitted to the mask.
    pub(crate) fn masked(
        &self,
        image: &Volume<u16>,
        mask: &[u8],
        warnings: &mut Vec<String>,
    ) -> Result<Specimen, ImageError> {
        let levels = Levels::of(image, self.void, self.contrast);
        let [air, void] = levels.map_or([0.0, self.void.unwrap_or(0.0)], |l| [l.air, l.void]);
        let bright = 2 * EDGE;
        let values = mask.iter().map(|&voxel| u16::from(voxel) * bright).collect();
        let found = match self.region.fit() {
            Some(fit) => fit,
            None => {
                self.region.overriding(fit(&image.with(values), f64::from(EDGE), self.follow_lean)?)
            }
        };
        let filled = found.inside(image.shape, 0.0);
        let both = filled.iter().zip(mask).filter(|(a, b)| **a & **b != 0).count();
        let all = mask.iter().filter(|&&voxel| voxel != 0).count();
        let share =
            both as f64 / (filled.iter().filter(|&&voxel| voxel != 0).count() as f64).max(1.0);
        if share < 0.95 || (both as f64) < 0.95 * all as f64 {
            warnings.push(format!(
                "region.mask fills {:.1} % of the cylinder of {:.1} voxels in radius that is fitted to it, and {:.1} % of it lies outside: what is outside the mask is meshed as matrix",
                100.0 * share,
                found.radius,
                100.0 * (1.0 - both as f64 / all as f64)
            ));
        }
        Ok(Specimen { fit: Some(found), air, void })
    }

    /// Whether what surrounds the specimen is the brightest.
    pub(crate) fn is_in_bright(&self, image: &Volume<u16>) -> bool {
        let levels = match self.form {
            SpecimenForm::Block => None,
            SpecimenForm::Auto | SpecimenForm::Cylinder => {
                Levels::of(image, None, Contrast::Bright)
            }
        };
        levels.is_some_and(|levels| {
            Surroundings::of(image, levels.void, levels.bright) == Surroundings::Bright
        })
    }

    /// Warns of a fitted cylinder that describes the specimen badly.
    fn doubts(
        &self,
        image: &Volume<u16>,
        fit: &Fit,
        edge: f64,
        warnings: &mut Vec<String>,
    ) -> Result<(), ImageError> {
        if let Err(error) = checked_filling(filling(image, fit, edge)) {
            match self.form {
                SpecimenForm::Cylinder => warnings.push(error.to_string()),
                SpecimenForm::Auto | SpecimenForm::Block => return Err(error),
            }
        }
        if fit.is_off_axis() && self.region.is_empty() {
            warnings.push(format!(
                "the specimen's axis leans by {:.1} voxels over its height: set follow_lean = true in [specimen.image], or turn the image upright",
                fit.wander
            ));
        }
        if fit.scatter > SCATTER[0] + SCATTER[1] * fit.radius {
            warnings.push(format!(
                "the wall scatters by {:.1} voxels about a cylinder of {:.1} voxels in radius: look at the slices, or give [specimen.image.region]",
                fit.scatter, fit.radius
            ));
        }
        Ok(())
    }
}

/// Grey values of air and matrix, and between them.
struct Levels {
    air: f64,
    /// The least that is not air.
    void: f64,
    /// Half way between air and matrix.
    edge: f64,
    /// From which on there is the brightest class.
    bright: f64,
}

impl Levels {
    /// From a histogram in three classes. Where the middle one has no inside it is not the matrix but the blurred wall
    /// between air and specimen, as there are few grains or none: then two classes are taken. With dark grains the
    /// brightest class is the matrix.
    fn of(image: &Volume<u16>, by_hand: Option<f64>, contrast: Contrast) -> Option<Self> {
        let all = vec![1; image.values.len()];
        let counts = histogram(&image.values, &all);
        for classes in [3, 2] {
            let Some(splits) = otsu(&counts, classes) else { continue };
            let limits: Vec<f64> = splits.iter().map(|&split| (split * WIDTH) as f64).collect();
            let above = limits.get(1).copied();
            let range = match (contrast, above) {
                (Contrast::Bright, Some(next)) => limits[0]..next,
                (Contrast::Dark, Some(last)) => last..f64::INFINITY,
                (_, None) => limits[0]..f64::INFINITY,
            };
            let means = class_means(&counts, &splits);
            let matrix = match (core_mean(image, &all, range), classes) {
                (Some(mean), _) => mean,
                (None, 2) => means[1],
                (None, _) => continue,
            };
            let air = core_mean(image, &all, 0.0..limits[0]).unwrap_or(means[0]);
            let edge = by_hand.unwrap_or((air + matrix) / 2.0);
            let bright = limits.last().copied().unwrap_or(edge);
            return Some(Levels { air, void: by_hand.unwrap_or(limits[0]), edge, bright });
        }
        None
    }
}

impl Specimen {
    /// The voxels of the specimen: 1, the others 0.
    pub(crate) fn inside<T>(&self, image: &Volume<T>) -> Vec<u8> {
        match self.fit {
            Some(fit) => fit.inside(image.shape, 0.0),
            None => vec![1; image.values.len()],
        }
    }

    /// The voxels of `inside` whose grey values hold no air: away from the wall and from voids.
    pub(crate) fn sample(&self, smooth: &Volume<u16>, inside: &[u8]) -> Vec<u8> {
        let mut sample = match self.fit {
            Some(fit) => fit.inside(smooth.shape, RIM),
            None => inside.to_vec(),
        };
        sample.par_iter_mut().zip(inside).for_each(|(voxel, inside)| *voxel &= inside);
        if self.void > 0.0 {
            let is_solid = |&value: &u16| u8::from(f64::from(value) >= self.void);
            let solid: Vec<u8> = smooth.values.par_iter().map(is_solid).collect();
            let away = core(smooth.shape, &solid);
            sample.par_iter_mut().zip(away).for_each(|(voxel, away)| *voxel &= away);
        }
        sample
    }
}
