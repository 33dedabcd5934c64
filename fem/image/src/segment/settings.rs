//! What can be set about a segmentation.

use serde::{Deserialize, Serialize};

use crate::ImageError;
use crate::locate::region::SpecimenRegion;
use crate::locate::specimen::SpecimenForm;
use crate::volume::contrast::Contrast;

/// How grains are found in an image of grey values, in which grains are brighter than the matrix and the
/// matrix brighter than air, or as [`Contrast`] says.
///
/// The chain: grey values are rounded to 16 bits between two percentiles and filtered by a median of 3³
/// voxels; the specimen is located; beam hardening and drift along the axis are taken out, and the air that blur mixes into the wall; a
/// threshold makes a set of grain voxels, whose holes are filled; the exact Euclidean distance to the outside of the set, lightly smoothed, has
/// a top in each grain, from which the grains are flooded.
///
/// # Example
/// ```
/// use fem_image::{Segmentation, SpecimenForm, Volume};
///
/// // two touching balls
/// let shape = [40, 26, 26];
/// let values = (0..40 * 26 * 26).map(|n| {
///     let at = [n % 40, n / 40 % 26, n / 1040].map(|c| c as f32);
///     let off = |x: f32| (at[0] - x).powi(2) + (at[1] - 12.5).powi(2) + (at[2] - 12.5).powi(2);
///     if off(12.0).min(off(27.0)) < 64.0 { 200.0 } else { 80.0 }
/// });
/// let image = Volume::new(shape, 0.01, values.collect())?;
/// let block = Segmentation { specimen: SpecimenForm::Block, ..Segmentation::default() };
/// let found = block.run(&image, &mut |_| {})?;
/// assert_eq!(found.regions.len(), 2);
/// assert_eq!(found.regions[0].neighbours, [2]);
/// # Ok::<(), fem_image::ImageError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Segmentation {
    /// What the image shows.
    pub specimen: SpecimenForm,
    /// Where the specimen is, if it is not to be found.
    #[serde(skip_serializing_if = "SpecimenRegion::is_unset")]
    pub region: SpecimenRegion,
    /// Whether grains are brighter or darker than the matrix.
    pub contrast: Contrast,
    /// Percentiles of the grey values between which they are rounded to 16 bits.
    pub percentiles: [f64; 2],
    /// Whether a median of 3³ voxels is taken before voxels are classified.
    pub median: bool,
    /// Whether a cylinder whose axis wanders by more than a voxel between its ends is taken as it leans;
    /// else it is taken as upright. The image is not turned: labels keep its voxels.
    pub follow_lean: bool,
    /// Whether the brightness of a cylinder as a function of the radius and of the height is evened out.
    pub beam_hardening: bool,
    /// Grey value below which there is air, or a void; found from the image if absent. Above it, where grains are darkest
    /// and air is brightest.
    pub void_threshold: Option<f64>,
    /// Grey value from which on there is grain, or up to which if grains are dark; found from the image if absent.
    ///
    /// The one that is found is half way between the grey values of matrix and grains, as a model of two
    /// materials and their blur has them. A value at most 0.02 of their contrast from half way gives the same
    /// grains as the one that is found. A value at most 0.3 of the contrast from half way is compared
    /// with this model, so that blur and median make no grain smaller; volumes are the numbers of
    /// voxels above the value. Without such a model a grain's volume is what is above the value.
    pub grain_threshold: Option<f64>,
    /// Holes in grains are filled up to this size (voxels).
    pub fill_holes_voxels: usize,
    /// How grains are told apart.
    pub seeds: SeedRule,
    /// For `h-maxima`: by how much the distance must fall between two grains (voxels).
    pub h_voxels: f64,
    /// For `h-maxima`: how often distances are smoothed, by weights 1–2–1 along each axis; n times give
    /// a standard deviation of √(n/2) voxels.
    pub smoothing_passes: usize,
    /// For `spacing`: the least distance of two seeds along an axis (voxels).
    pub spacing_voxels: usize,
    /// Grains of fewer voxels are left out.
    pub min_grain_voxels: usize,
}

/// How grains that touch are told apart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SeedRule {
    /// A grain has a top of the smoothed distance that stands out by `h_voxels`.
    #[default]
    HMaxima,
    /// A grain has a top of the distance in whole voxels, `spacing_voxels` apart from others: the rule of
    /// the paper, which splits more grains than it should. It is there for comparison, and depends on
    /// how the image lies.
    Spacing,
}

impl Default for Segmentation {
    fn default() -> Self {
        Segmentation {
            specimen: SpecimenForm::Auto,
            region: SpecimenRegion::default(),
            contrast: Contrast::Bright,
            percentiles: [0.1, 99.9],
            median: true,
            follow_lean: true,
            beam_hardening: true,
            void_threshold: None,
            grain_threshold: None,
            fill_holes_voxels: 100,
            seeds: SeedRule::HMaxima,
            h_voxels: 0.5,
            smoothing_passes: 2,
            spacing_voxels: 4,
            min_grain_voxels: 30,
        }
    }
}

impl Segmentation {
    /// Checks the ranges.
    ///
    /// # Errors
    /// [`ImageError::Parameter`].
    pub fn check(&self) -> Result<(), ImageError> {
        self.region.check()?;
        let [low, high] = self.percentiles;
        let refuse =
            |field, value, requirement| Err(ImageError::Parameter { field, value, requirement });
        if !(0.0..=100.0).contains(&low) || !(0.0..=100.0).contains(&high) || low >= high {
            return refuse("percentiles", low, "two percentages from 0 to 100, the lower first");
        }
        let by_hand =
            [("void_threshold", self.void_threshold), ("grain_threshold", self.grain_threshold)];
        for (field, value) in by_hand {
            if let Some(value) = value.filter(|value| !value.is_finite()) {
                return refuse(field, value, "a grey value");
            }
        }
        // which side of air dark grains are on is seen in the image
        if let (Some(void), Some(grain)) = (self.void_threshold, self.grain_threshold)
            && void >= grain
            && self.contrast == Contrast::Bright
        {
            return refuse("void_threshold", void, "below grain_threshold");
        }
        if !(0.0..=100.0).contains(&self.h_voxels) {
            return refuse("h_voxels", self.h_voxels, "from 0 to 100 voxels");
        }
        if self.smoothing_passes > 100 {
            let value = self.smoothing_passes as f64;
            return refuse("smoothing_passes", value, "at most 100");
        }
        if self.spacing_voxels == 0 || self.spacing_voxels > 100 {
            let value = self.spacing_voxels as f64;
            return refuse("spacing_voxels", value, "from 1 to 100 voxels");
        }
        Ok(())
    }
}
