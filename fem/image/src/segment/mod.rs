//! From grey values to grains.

pub(crate) mod outline;
pub(crate) mod settings;

use rayon::prelude::*;

use crate::classify::hardening::Cupping;
use crate::classify::level::{Level, core_mean};
use crate::classify::solid::Solid;
use crate::classify::threshold::{WIDTH, class_means, histogram, otsu};
use crate::grains::basins::Landscape;
use crate::grains::regions::measure;
use crate::grains::statistics::SpecimenStatistics;
use crate::locate::fit::{Fit, fit};
use crate::locate::surroundings::{Surroundings, checked_filling, filling};
use crate::segment::settings::{SeedRule, Segmentation, SpecimenForm};
use crate::volume::components::fill_holes;
use crate::volume::cylinder::Cylinder;
use crate::volume::distance::{FixedDistance, fixed_point, squared_distance};
use crate::volume::filter::{binomial, median};
use crate::volume::grey::{Scale, rescale};
use crate::{ImageError, Region, Volume};

/// An image in grains.
#[derive(Clone, Debug)]
pub struct Segmented {
    /// The number of the grain to which a voxel belongs, from 1; 0 where there is none.
    pub labels: Volume<u32>,
    /// Share of each voxel that is grain, from its grey value: 0 to 1.
    pub solid: Volume<f32>,
    /// Where the specimen stands; for a block the largest upright cylinder in it.
    pub cylinder: Cylinder,
    /// Whether the image shows a part of a specimen, without air around it.
    pub block: bool,
    /// The grains, in the order of their numbers.
    pub regions: Vec<Region>,
    /// Numbers of the whole specimen.
    pub statistics: SpecimenStatistics,
    /// Grey value from which on there was grain.
    pub grain_threshold: f64,
    /// Grey value below which there was air; absent if there is none in the image.
    pub void_threshold: Option<f64>,
    /// Brightness of one material at the wall over that at the axis, before it was evened out.
    pub rim_over_centre: f64,
    /// What a person should look at.
    pub warnings: Vec<String>,
}

/// A grain of more than this share of the specimen is told, and one of more than this share of all grains
/// where there are so many.
const MOST: f64 = 0.5;
const MANY: usize = 10;
/// Voxels at the wall that hold some air.
const WALL: f64 = 2.0;

impl Segmentation {
    /// Finds the grains. `progress` is told the name of each step as it begins.
    ///
    /// The result is the same for any number of threads. An image that is turned by 90° about z or
    /// mirrored (a block: about any axis) gives the same grains with other numbers, except on voxels
    /// where two grains are equal in every respect (see [`SeedRule`] for the rule of the paper).
    ///
    /// # Errors
    /// [`ImageError`]: parameters out of range, values that are no numbers, an image without contrast
    /// or without grains, no cylinder where one is asked for.
    pub fn run(
        &self,
        image: &Volume<f32>,
        progress: &mut dyn FnMut(&str),
    ) -> Result<Segmented, ImageError> {
        self.check()?;
        image.check()?;
        progress("grey values");
        let (mut grey, scale) = rescale(image, self.percentiles)?;
        let mut smooth =
            if self.median { grey.with(median(grey.shape, &grey.values)) } else { grey.clone() };

        progress("specimen");
        let mut warnings = Vec::new();
        let found = self.locate(&smooth, scale, &mut warnings)?;
        let mut rim_over_centre = 1.0;
        if let Some(fit) = found.fit.filter(|_| self.beam_hardening) {
            let set = fit.inside(grey.shape, WALL);
            let (air, void) = (found.air, found.void);
            let cupping = Cupping::fit(&smooth.values, grey.shape, &set, &fit, air, void);
            rim_over_centre = cupping.rim_over_centre();
            cupping.correct(&mut grey.values, grey.shape, &fit);
            cupping.correct(&mut smooth.values, grey.shape, &fit);
        }
        let inside = found.inside(&grey);

        progress("threshold");
        let threshold = self.grain_level(&smooth, &grey, &inside, &found, scale, &mut warnings)?;
        let mut grain: Vec<u8> = smooth
            .values
            .par_iter()
            .zip(&inside)
            .map(|(&value, &inside)| u8::from(f64::from(value) >= threshold) & inside)
            .collect();
        fill_holes(grey.shape, &mut grain, self.fill_holes_voxels);

        progress("distances");
        let distance = fixed_point(&squared_distance(grey.shape, &grain));
        progress("watershed");
        let mut labels = self.label(grey.shape, distance, &grain, &smooth.values);
        let grains = keep(&mut labels, self.min_grain_voxels);
        if grains == 0 {
            return Err(ImageError::NoContrast {
                what: format!(
                    "no grain of {} voxels is brighter than {:.5}",
                    self.min_grain_voxels,
                    scale.to_image(threshold)
                ),
                help: "lower grain_threshold or min_grain_voxels",
            });
        }

        progress("grains");
        let void = found.void;
        let solid = if self.grain_threshold.is_some() {
            Solid::above(&smooth, threshold, &labels, grains, &inside)
        } else {
            let matrix: Vec<u8> = (0..labels.len())
                .into_par_iter()
                .map(|n| {
                    u8::from(labels[n] == 0 && f64::from(smooth.values[n]) >= void) & inside[n]
                })
                .collect();
            drop(smooth);
            Solid::measure(&grey, &labels, grains, &matrix, &inside)
        };
        let labels = grey.with(labels);
        let regions = measure(&labels, &inside, &solid.volumes);
        warnings.extend(self.one_for_all(&regions, &inside, scale.to_image(threshold)));
        let voxel_mm = grey.voxel_mm;
        let (cylinder, volume_mm3) = match found.fit {
            Some(fit) => (fit.in_mm(voxel_mm), fit.in_mm(voxel_mm).volume_mm3()),
            None => (Cylinder::within(&grey), grey.size_mm().iter().product()),
        };
        Ok(Segmented {
            statistics: SpecimenStatistics::of(&regions, voxel_mm, volume_mm3),
            labels,
            solid: grey.with(solid.share),
            cylinder,
            block: found.fit.is_none(),
            regions,
            grain_threshold: scale.to_image(threshold),
            void_threshold: (void > 0.0).then(|| scale.to_image(void)),
            rim_over_centre,
            warnings,
        })
    }

    /// Where the specimen is, and what grey value air has.
    fn locate(
        &self,
        image: &Volume<u16>,
        scale: Scale,
        warnings: &mut Vec<String>,
    ) -> Result<Found, ImageError> {
        let by_hand = self.void_threshold.map(|value| scale.to_16_bits(value));
        let block = Found { fit: None, air: 0.0, void: by_hand.unwrap_or(0.0) };
        if self.specimen == SpecimenForm::Block {
            return Ok(block);
        }
        let all = vec![1; image.values.len()];
        let counts = histogram(&image.values, &all);
        let splits = otsu(&counts, 3).or_else(|| otsu(&counts, 2));
        let Some(splits) = splits else { return Ok(block) };
        let means = class_means(&counts, &splits);
        let limits: Vec<f64> = splits.iter().map(|&split| (split * WIDTH) as f64).collect();
        let matrix = limits[0]..limits.get(1).copied().unwrap_or(f64::INFINITY);
        let air = core_mean(image, &all, 0.0..limits[0]).unwrap_or(means[0]);
        let matrix = core_mean(image, &all, matrix).unwrap_or(means[1]);
        let void = by_hand.unwrap_or((splits[0] * WIDTH) as f64);
        if self.specimen == SpecimenForm::Auto {
            let bright = limits.last().copied().unwrap_or(void);
            if Surroundings::of(image, void, bright).accepted()? == Surroundings::Block {
                return Ok(block);
            }
        }
        let edge = by_hand.unwrap_or((air + matrix) / 2.0);
        let fit = fit(image, edge, self.follow_lean)?;
        if let Err(error) = checked_filling(filling(image, &fit, edge)) {
            match self.specimen {
                SpecimenForm::Cylinder => warnings.push(error.to_string()),
                _ => return Err(error),
            }
        }
        if fit.lean == [0.0; 2] && fit.wander > 2.0 {
            warnings.push(format!(
                "the specimen's axis leans by {:.1} voxels over its height: set follow_lean = true in [specimen.image], or turn the image upright",
                fit.wander
            ));
        }
        Ok(Found { fit: Some(fit), air, void })
    }

    /// The grey level between matrix and grain.
    fn grain_level(
        &self,
        smooth: &Volume<u16>,
        grey: &Volume<u16>,
        inside: &[u8],
        found: &Found,
        scale: Scale,
        warnings: &mut Vec<String>,
    ) -> Result<f64, ImageError> {
        if let Some(value) = self.grain_threshold {
            let level = scale.to_16_bits(value);
            if level <= found.void {
                let air = scale.to_image(found.void);
                return Err(ImageError::NoContrast {
                    what: format!(
                        "grain_threshold = {value} is not above {air:.5}, from which on there is matrix"
                    ),
                    help: "raise it, or give a lower void_threshold",
                });
            }
            return Ok(level);
        }
        let Some(level) = Level::find(smooth, grey, inside, found.void) else {
            return Err(ImageError::NoContrast {
                what: "the specimen has one grey value".into(),
                help: "check void_threshold, or give grain_threshold",
            });
        };
        if level.one_bell {
            warnings.push(
                "the grey values of the specimen do not part into matrix and grains: look at the slices, or give grain_threshold"
                    .into(),
            );
        }
        Ok(level.value)
    }

    /// What is to be said where one grain is most of the specimen, or most of many grains.
    fn one_for_all(&self, regions: &[Region], inside: &[u8], threshold: f64) -> Option<String> {
        let largest = regions.iter().max_by_key(|grain| grain.voxels)?;
        let all: usize = regions.iter().map(|grain| grain.voxels).sum();
        let specimen: usize = inside.par_iter().map(|&voxel| usize::from(voxel)).sum();
        let share = |whole: usize| largest.voxels as f64 / whole as f64;
        let (part, whole) = if share(specimen) > MOST {
            (share(specimen), "the specimen")
        } else if regions.len() >= MANY && share(all) > MOST {
            (share(all), "all grains")
        } else {
            return None;
        };
        let mend = match self.grain_threshold {
            None => "give grain_threshold in [specimen.image]; found was",
            Some(_) => "try another grain_threshold in [specimen.image]; given was",
        };
        Some(format!(
            "grain {} is {:.0} % of {whole}, so that it is hardly one grain: look at the slices, and {mend} {threshold:.5}",
            largest.id,
            100.0 * part
        ))
    }

    fn label(
        &self,
        shape: [usize; 3],
        distance: FixedDistance,
        grain: &[u8],
        grey: &[u16],
    ) -> Vec<u32> {
        let FixedDistance { mut values, per_voxel } = distance;
        match self.seeds {
            SeedRule::HMaxima => {
                for _ in 0..self.smoothing_passes {
                    values = binomial(shape, &values);
                }
                let landscape = Landscape::new(shape, &values, grain);
                drop(values);
                let h = (self.h_voxels * f64::from(per_voxel)).round() as u16;
                let seeds = landscape.h_maxima(h);
                landscape.flood(seeds, grey)
            }
            SeedRule::Spacing => {
                values.par_iter_mut().for_each(|value| *value -= *value % per_voxel);
                let landscape = Landscape::new(shape, &values, grain);
                let seeds = landscape.spaced_maxima(self.spacing_voxels);
                landscape.flood(seeds, grey)
            }
        }
    }
}

/// The specimen in its image, in 16-bit grey values.
#[derive(Clone, Copy, Debug)]
struct Found {
    fit: Option<Fit>,
    air: f64,
    /// The least grey value that is not air; 0 if there is no air.
    void: f64,
}

impl Found {
    fn inside(&self, image: &Volume<u16>) -> Vec<u8> {
        match self.fit {
            Some(fit) => fit.inside(image.shape, 0.0),
            None => vec![1; image.values.len()],
        }
    }
}

/// Drops labels of fewer voxels and numbers the others without gaps; how many are left.
fn keep(labels: &mut [u32], least: usize) -> usize {
    let most = labels.par_iter().copied().max().unwrap_or(0) as usize;
    let mut sizes = vec![0_usize; most + 1];
    for &label in labels.iter() {
        sizes[label as usize] += 1;
    }
    let mut next = 0;
    let mut numbers = vec![0_u32; most + 1];
    for label in 1..=most {
        if sizes[label] >= least.max(1) {
            next += 1;
            numbers[label] = next;
        }
    }
    labels.par_iter_mut().for_each(|label| *label = numbers[*label as usize]);
    next as usize
}
