//! Location of the specimen in its image, and the grey values of air.

use schemars::JsonSchema;

use rayon::prelude::*;

use crate::locate::beside::{gap, without_pedestal};
use crate::locate::beyond::{beyond_image, region_beyond};
use crate::locate::fit::{Fit, fit};
use crate::locate::region::SpecimenRegion;
use crate::locate::surroundings::{Surroundings, checked_filling, filling};
use crate::volume::contrast::Contrast;
use crate::volume::filter::core;
use crate::volume::threshold::{WIDTH, class_means, core_mean, histogram, otsu, peaked_mean};
use crate::{ImageError, Volume};

/// Distance from the wall (voxels) up to which the grey values of the median-filtered image contain a share of air.
const RIM: f64 = 3.0;
/// Grey level of the wall in the image of a mask: half the grey value of the mask's voxels.
const EDGE: u16 = 16384;
/// If the scatter of the points on the wall exceeds this limit, the fit is doubtful. The limit is the first value
/// (voxels) plus the second value times the radius.
const SCATTER: [f64; 2] = [0.6, 0.01];

/// Form of the specimen in an image.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize, JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum SpecimenForm {
    /// A cylinder if air surrounds the specimen, otherwise a block. Cut cylinders, visible platens, and surroundings
    /// brighter than the specimen are rejected.
    #[default]
    Auto,
    /// A complete cylinder in air, with its axis approximately along z.
    Cylinder,
    /// A block cut out of a specimen: the whole image belongs to the specimen.
    Block,
}

/// Settings for the location of a specimen in an image.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Locating<'a> {
    pub(crate) form: SpecimenForm,
    pub(crate) follow_lean: bool,
    /// Whether grains are brighter or darker than the matrix. In both cases, air is assumed to be the darkest class.
    pub(crate) contrast: Contrast,
    /// Lowest grey value that is not air, if the user gives it.
    pub(crate) void: Option<f64>,
    pub(crate) region: &'a SpecimenRegion,
}

/// The specimen in its image; grey values are 16-bit values.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Specimen {
    /// The fitted cylinder; `None` for a block.
    pub(crate) fit: Option<Fit>,
    /// Grey value of air; 0 for a block.
    pub(crate) air: f64,
    /// Lowest grey value that is not air; 0 if there is no air.
    pub(crate) void: f64,
}

impl Locating<'_> {
    /// Locates the specimen in a filtered image; adds messages about doubtful results to `warnings`.
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
        if let Some(given) = by_hand {
            let is_in_air = Surroundings::of(image, void, bright) == Surroundings::Air;
            let shown = is_in_air.then(|| fit(image, edge, self.follow_lean).ok()).flatten();
            warnings.extend(shown.and_then(|shown| region_beyond(&given, &shown)));
            warnings.extend(beyond_image(&given, image.shape, true));
            return Ok(Specimen { fit: Some(given), air, void });
        }
        if self.form == SpecimenForm::Auto
            && self.region.is_empty()
            && Surroundings::of(image, void, bright).accepted()? == Surroundings::Block
        {
            return Ok(block);
        }
        let mut restricted = self.region.restricted(image, air);
        let visible = restricted.as_ref().unwrap_or(image);
        let mut fitted = fit(visible, edge, self.follow_lean)?;
        if let Some([inner, outer]) = gap(visible, &fitted, edge) {
            let tube = SpecimenRegion {
                centre_px: Some(fitted.centre),
                radius_px: Some((inner + outer) / 2.0),
                ..SpecimenRegion::default()
            };
            let [x, y] = fitted.centre;
            warnings.push(format!(
                "a tube of {outer:.1} to {:.1} voxels in radius around ({x:.1}, {y:.1}) was removed, because there is air between the tube and the specimen: check the slices, or give centre_px, radius_px and slices in [specimen.image.region]",
                fitted.radius
            ));
            restricted = tube.restricted(visible, air);
            fitted = fit(restricted.as_ref().unwrap_or(image), edge, self.follow_lean)?;
        } else {
            let cut = without_pedestal(visible, &mut fitted, edge);
            warnings.extend(cut.iter().map(|part| part.in_words(fitted.radius)));
        }
        let shown = fitted;
        let fitted = self.region.overriding(fitted);
        warnings.extend(region_beyond(&fitted, &shown));
        warnings.extend(beyond_image(&fitted, image.shape, self.region.slices.is_some()));
        let visible = restricted.as_ref().unwrap_or(image);
        self.doubts(visible, &fitted, edge, warnings)?;
        Ok(Specimen { fit: Some(fitted), air, void })
    }

    /// Locates the specimen of a mask by fitting a cylinder to the mask.
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
        let fitted = match self.region.fit() {
            Some(fit) => fit,
            None => {
                self.region.overriding(fit(&image.with(values), f64::from(EDGE), self.follow_lean)?)
            }
        };
        let filled = fitted.inside(image.shape, 0.0);
        let both = filled.iter().zip(mask).filter(|(a, b)| **a & **b != 0).count();
        let all = mask.iter().filter(|&&voxel| voxel != 0).count();
        let share =
            both as f64 / (filled.iter().filter(|&&voxel| voxel != 0).count() as f64).max(1.0);
        if share < 0.95 || (both as f64) < 0.95 * all as f64 {
            warnings.push(format!(
                "the part of the cylinder outside region.mask is meshed as matrix: the mask fills {:.1} % of the fitted cylinder (radius {:.1} voxels), and {:.1} % of the mask lies outside the cylinder",
                100.0 * share,
                fitted.radius,
                100.0 * (1.0 - both as f64 / all as f64)
            ));
        }
        Ok(Specimen { fit: Some(fitted), air, void })
    }

    /// Returns whether the surroundings of the specimen are brighter than every material of the specimen.
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

    /// Adds warnings if the fitted cylinder does not describe the specimen well. For [`SpecimenForm::Auto`], returns
    /// an error if the specimen does not fill the sections of the cylinder.
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
                "the specimen's axis is tilted by {:.1} voxels over its height: set follow_lean = true in [specimen.image], or turn the image upright",
                fit.wander
            ));
        }
        if fit.scatter > SCATTER[0] + SCATTER[1] * fit.radius {
            warnings.push(format!(
                "the distance of the wall from the fitted cylinder is {:.1} voxels (root mean square; radius {:.1} voxels): check the slices, or give [specimen.image.region]",
                fit.scatter, fit.radius
            ));
        }
        Ok(())
    }
}

/// Grey values of air and matrix, and the levels that separate the classes.
struct Levels {
    air: f64,
    /// Lowest grey value that is not air.
    void: f64,
    /// Grey value half way between air and matrix.
    edge: f64,
    /// Lowest grey value of the brightest class.
    bright: f64,
}

impl Levels {
    /// Finds the levels by dividing the histogram into three classes: air, matrix, grains (for dark grains: air,
    /// grains, matrix). In an image with few or no grains, the middle class consists of voxels at the blurred wall
    /// between air and specimen. Such a class has no interior voxels and no peak in the histogram, and the histogram is
    /// then divided into two classes.
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
            let matrix = match (core_mean(image, &all, range.clone()), classes, contrast) {
                (Some(mean), ..) => mean,
                (None, 2, _) => means[1],
                (None, _, Contrast::Bright) => match peaked_mean(image, &all, range, &counts) {
                    Some(mean) => mean,
                    None => continue,
                },
                (None, _, Contrast::Dark) => continue,
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
    /// Returns the set of the specimen's voxels: 1 inside, 0 outside.
    pub(crate) fn inside<T>(&self, image: &Volume<T>) -> Vec<u8> {
        match self.fit {
            Some(fit) => fit.inside(image.shape, 0.0),
            None => vec![1; image.values.len()],
        }
    }

    /// Returns the voxels of `inside` whose grey values contain no share of air: voxels away from the wall and from
    /// voids.
    pub(crate) fn sample(&self, smooth: &Volume<u16>, inside: &[u8]) -> Vec<u8> {
        self.sample_below(RIM, smooth, inside)
    }

    /// Returns the voxels of `inside` that are away from voids and at least `rim` voxels below the wall.
    pub(crate) fn sample_below(&self, rim: f64, smooth: &Volume<u16>, inside: &[u8]) -> Vec<u8> {
        let mut sample = match self.fit {
            Some(fit) => fit.inside(smooth.shape, rim),
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
