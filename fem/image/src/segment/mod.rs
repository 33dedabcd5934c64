//! Segmentation of an image of grey values into grains.

mod even;
pub(crate) mod outline;
mod plausibility;
pub(crate) mod settings;
mod thin;
mod warnings;

use rayon::prelude::*;

use crate::classify::dark::inverted;
use crate::classify::exchanged::Shapes;
use crate::classify::level::Level;
use crate::classify::solid::Solid;
use crate::grains::basins::Landscape;
use crate::grains::regions::measure;
use crate::grains::statistics::SpecimenStatistics;
use crate::locate::region::masked;
use crate::locate::specimen::{Locating, Specimen};
use crate::segment::even::{CorrectedImage, GreyCorrection};
use crate::segment::plausibility::{empty_end_in_words, skin_in_words};
use crate::segment::settings::{SeedRule, Segmentation};
use crate::segment::warnings::{
    exchanged_in_words, fractions_in_words, small_in_words, thin_in_words, unfitted_in_words,
    void_in_words,
};
use crate::volume::components::fill_holes;
use crate::volume::contrast::Contrast;
use crate::volume::cylinder::Cylinder;
use crate::volume::distance::{FixedDistance, fixed_point, squared_distance};
use crate::volume::filter::{binomial, median};
use crate::volume::frame::filled_frame;
use crate::volume::grey::{Scale, rescale};
use crate::{ImageError, Region, Volume};

/// Result of a segmentation.
#[derive(Clone, Debug)]
pub struct Segmented {
    /// Number of the grain to which a voxel belongs, counted from 1; 0 for voxels outside grains.
    pub labels: Volume<u32>,
    /// Share of grain in each voxel, from its grey value: 0 to 1.
    pub solid: Volume<f32>,
    /// Cylinder of the specimen; for a block the largest upright cylinder in the block.
    pub cylinder: Cylinder,
    /// Whether the image shows a part of a specimen, without air around it.
    pub block: bool,
    /// The grains, in the order of their numbers.
    pub regions: Vec<Region>,
    /// Statistics of the whole specimen.
    pub statistics: SpecimenStatistics,
    /// Grey value half way between matrix and grain, or the threshold given by the user.
    pub grain_threshold: f64,
    /// Grey value below which voxels are air; `None` if the image contains no air.
    pub void_threshold: Option<f64>,
    /// Ratio of the brightness of a material at the wall to its brightness at the axis, before the correction.
    pub rim_over_centre: f64,
    /// Ratio of the brightness of a material at the top to its brightness at the bottom, before the correction.
    pub top_over_bottom: f64,
    /// Share of the specimen's voxels that are as dark as air, e.g. cracks, pores or a chipped edge.
    pub void_fraction: f64,
    /// Messages about doubtful results, which the user should check.
    pub warnings: Vec<String>,
}

/// Share of the specimen's volume above which a single grain causes a warning.
const MOST: f64 = 0.5;
/// If there are at least this number of grains, a grain that has more than the share [`MOST`] of the volume of all
/// grains also causes a warning.
const MANY: usize = 10;

impl Segmentation {
    /// Segments an image into grains. `progress` is called with the name of each step when the step begins.
    ///
    /// The result does not depend on the number of threads. An image that is mirrored, or rotated by 90° about z (a
    /// block: about any axis), gives the same grains with other numbers. There are two exceptions: voxels for which all
    /// criteria of the choice between two grains are equal, and the rule [`SeedRule::Spacing`], which depends on the
    /// orientation.
    ///
    /// # Errors
    /// [`ImageError`]: parameters out of range, values that are not finite, an image without contrast or without
    /// grains, or no cylinder although one is required.
    pub fn run(
        &self,
        image: &Volume<f32>,
        progress: &mut dyn FnMut(&str),
    ) -> Result<Segmented, ImageError> {
        self.run_masked(image, None, progress)
    }

    /// Segments an image like [`run`](Self::run), with the image `mask` of `region.mask`: voxels with at least half of
    /// the largest value belong to the specimen.
    ///
    /// # Errors
    /// The errors of `run`, and an error for a mask that is empty or differs in shape from the image.
    pub fn run_masked(
        &self,
        image: &Volume<f32>,
        mask: Option<&Volume<f32>>,
        progress: &mut dyn FnMut(&str),
    ) -> Result<Segmented, ImageError> {
        self.check()?;
        image.check()?;
        self.region.check_in(image)?;
        let mask = mask.map(|mask| masked(mask, image)).transpose()?;
        progress("grey values");
        let framed = filled_frame(image);
        let (mut grey, mut scale) = rescale(framed.as_ref().unwrap_or(image), self.percentiles)?;
        drop(framed);
        let mut smooth =
            if self.median { grey.with(median(grey.shape, &grey.values)) } else { grey.clone() };
        let is_inverted =
            self.contrast == Contrast::Dark && self.locating(scale).is_in_bright(&smooth);
        if is_inverted {
            (grey, smooth, scale) = (inverted(grey), inverted(smooth), scale.inverted());
        }

        progress("specimen");
        let mut warnings = Vec::new();
        let located =
            self.located(&smooth, mask.as_deref(), (scale, is_inverted), &mut warnings)?;
        let found_contrast = match is_inverted {
            true => Contrast::Bright,
            false => self.contrast,
        };
        let mut correction = GreyCorrection {
            specimen: located,
            mask: mask.as_deref(),
            may_move_wall: mask.is_none() && self.region.is_empty(),
            contrast: found_contrast,
            median: self.median,
            brightness: self.beam_hardening,
        };
        let void_threshold = (located.void > 0.0).then(|| scale.to_image(located.void));
        let known = thin::materials(&mut correction, &grey, &smooth, scale);
        let CorrectedImage {
            specimen: located,
            inside,
            grey,
            smooth,
            scale,
            sample,
            solid,
            shown,
            voids,
            rim_over_centre,
            top_over_bottom,
        } = correction.run(grey, smooth, scale, known.as_ref());

        progress("threshold");
        self.check_threshold(void_threshold, found_contrast)?;
        let level = self.grain_level(&smooth, &grey, [&solid, &sample], scale, &mut warnings)?;
        let shapes = Shapes::of(&smooth, &sample, level.materials);
        warnings.extend(exchanged_in_words(shapes, self.contrast, is_inverted));
        let threshold = level.value;
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
        let grains = drop_small_labels(&mut labels, self.min_grain_voxels);
        if grains == 0 {
            return Err(ImageError::NoContrast {
                what: format!(
                    "no grain of {} voxels is {} than {:.5}",
                    self.min_grain_voxels,
                    if self.contrast == Contrast::Dark { "darker" } else { "brighter" },
                    scale.to_image(level.by_hand)
                ),
                help: match self.contrast {
                    Contrast::Bright => "reduce grain_threshold or min_grain_voxels",
                    Contrast::Dark => "increase grain_threshold, or reduce min_grain_voxels",
                },
            });
        }

        progress("grains");
        let specimen = inside.par_iter().filter(|&&voxel| voxel != 0).count();
        let is_void = |&n: &usize| inside[n] & voids[n] != 0 && labels[n] == 0;
        let void_voxels = (0..labels.len()).into_par_iter().filter(is_void).count();
        let void_fraction = void_voxels as f64 / specimen.max(1) as f64;
        let solid = match &level.model {
            None => Solid::above(&smooth, threshold, &labels, grains, &inside),
            Some(model) => {
                let matrix: Vec<u8> = (0..labels.len())
                    .into_par_iter()
                    .map(|n| u8::from(labels[n] == 0 && voids[n] == 0) & shown[n])
                    .collect();
                drop(smooth);
                Solid::measure(&grey, &labels, grains, &matrix, [&inside, &shown, &sample], model)
            }
        };
        let labels = grey.with(labels);
        let regions = measure(&labels, &inside, &solid.volumes);
        // an upright cylinder around a tilted specimen contains air, which must not count as voids; another warning
        // reports the tilt
        let follows = located.fit.is_none_or(|fit| !fit.is_off_axis());
        warnings.extend(void_in_words(void_fraction, self.contrast).filter(|_| follows));
        if let Some(fit) = &located.fit {
            warnings.extend(skin_in_words(&labels, &inside, fit));
            warnings.extend(thin_in_words(fit.radius));
            warnings.extend(empty_end_in_words(&labels, grains, fit));
        }
        warnings.extend(small_in_words(&regions, grey.voxel_mm));
        warnings.extend(self.one_for_all(&regions, &inside, scale.to_image(level.by_hand)));
        let voxel_mm = grey.voxel_mm;
        let (cylinder, volume_mm3) = match located.fit {
            Some(fit) => (fit.in_mm(voxel_mm), fit.in_mm(voxel_mm).volume_mm3()),
            None => (Cylinder::within(&grey), grey.size_mm().iter().product()),
        };
        let statistics = SpecimenStatistics::of(&regions, voxel_mm, volume_mm3);
        warnings.extend(fractions_in_words(&statistics));
        Ok(Segmented {
            statistics,
            labels,
            solid: grey.with(solid.share),
            cylinder,
            block: located.fit.is_none(),
            regions,
            grain_threshold: scale.to_image(level.by_hand),
            void_threshold,
            rim_over_centre,
            top_over_bottom,
            void_fraction,
            warnings,
        })
    }

    /// Locates the specimen from the mask, if there is one, otherwise from the image.
    fn located(
        &self,
        image: &Volume<u16>,
        mask: Option<&[u8]>,
        (scale, is_inverted): (Scale, bool),
        warnings: &mut Vec<String>,
    ) -> Result<Specimen, ImageError> {
        let contrast = if is_inverted { Contrast::Bright } else { self.contrast };
        let locating = Locating { contrast, ..self.locating(scale) };
        match mask {
            Some(mask) => locating.masked(image, mask, warnings),
            None => locating.specimen(image, warnings),
        }
    }

    /// Returns the settings for locating the specimen.
    fn locating(&self, scale: Scale) -> Locating<'_> {
        Locating {
            form: self.specimen,
            follow_lean: self.follow_lean,
            contrast: self.contrast,
            void: self.void_threshold.map(|value| scale.to_16_bits(value)),
            region: &self.region,
        }
    }

    /// Returns an error if the given threshold of grains is a grey value of air.
    fn check_threshold(&self, air: Option<f64>, contrast: Contrast) -> Result<(), ImageError> {
        let (Some(value), Some(air)) = (self.grain_threshold, air) else { return Ok(()) };
        // an image with bright air has been inverted, so that its grains are now bright
        let is_inverted = contrast != self.contrast;
        let (is_in_air, side) = match is_inverted {
            true => (value >= air, "below"),
            false => (value <= air, "above"),
        };
        if !is_in_air {
            return Ok(());
        }
        let limit = match (is_inverted, contrast) {
            (true, _) => "the highest grey value of matrix",
            (false, Contrast::Bright) => "the lowest grey value of matrix",
            (false, Contrast::Dark) => "the lowest grey value of grains",
        };
        Err(ImageError::NoContrast {
            what: format!("grain_threshold = {value} is not {side} {air:.5}, {limit}"),
            help: match is_inverted {
                true => "reduce grain_threshold, or increase void_threshold",
                false => "increase grain_threshold, or reduce void_threshold",
            },
        })
    }

    /// Computes the grey level between matrix and grain, from `grain_threshold` or from the image.
    fn grain_level(
        &self,
        smooth: &Volume<u16>,
        grey: &Volume<u16>,
        [inside, sample]: [&[u8]; 2],
        scale: Scale,
        warnings: &mut Vec<String>,
    ) -> Result<Level, ImageError> {
        if let Some(value) = self.grain_threshold {
            let level = Level::given(scale.to_16_bits(value), smooth, grey, inside, sample);
            warnings.extend(unfitted_in_words(level.is_fitted));
            return Ok(level);
        }
        let Some(level) = Level::find(smooth, grey, inside, sample) else {
            return Err(ImageError::NoContrast {
                what: "the specimen has one grey value".into(),
                help: "check void_threshold, or give grain_threshold",
            });
        };
        warnings.extend(unfitted_in_words(level.is_fitted));
        if level.one_bell {
            warnings.push(
                "the grey values of the specimen do not separate into matrix and grains: check the slices, or give grain_threshold"
                    .into(),
            );
        }
        Ok(level)
    }

    /// Returns a warning if one grain makes up most of the specimen, or if there are many grains and one of them has
    /// most of their volume.
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
        let remedy = match self.grain_threshold {
            None => "give grain_threshold in [specimen.image]; the computed value is",
            Some(_) => "try another grain_threshold in [specimen.image]; the given value is",
        };
        Some(format!(
            "grain {} is {:.0} % of {whole}, so it is probably not a single grain: check the slices, and {remedy} {threshold:.5}",
            largest.id,
            100.0 * part
        ))
    }

    /// Divides the grain voxels into grains by a watershed of the distance to the grain surface. Returns the grain
    /// number of each voxel.
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

/// Removes labels of fewer than `least` voxels and numbers the remaining labels consecutively from 1; returns the
/// number of remaining labels.
fn drop_small_labels(labels: &mut [u32], least: usize) -> usize {
    let most = labels.par_iter().copied().max().unwrap_or(0) as usize;
    let mut sizes = vec![0_usize; most + 1];
    for &label in labels.iter().filter(|label| **label != 0) {
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
