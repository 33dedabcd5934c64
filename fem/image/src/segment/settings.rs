//! Settings of a segmentation.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::ImageError;
use crate::locate::region::SpecimenRegion;
use crate::locate::specimen::SpecimenForm;
use crate::volume::contrast::Contrast;

/// Settings of the segmentation of an image of grey values into grains. Grains are brighter than the matrix and the
/// matrix is brighter than air, unless [`Contrast::Dark`] is given.
///
/// Steps: grey values are rounded to 16 bits between two percentiles and filtered by a median of 3³ voxels. The
/// specimen is located. Beam hardening, drift along the axis, and the air that blur mixes into the wall are corrected.
/// A threshold defines a set of grain voxels, and holes in this set are filled. The distance of each voxel of the set
/// to the outside of the set is computed exactly and smoothed. This distance has a maximum in each grain; a watershed
/// grows the grains from these maxima.
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Segmentation {
    /// Form of the specimen in the image.
    pub specimen: SpecimenForm,
    /// Position of the specimen as given by the user; missing values are determined from the image.
    #[serde(skip_serializing_if = "SpecimenRegion::is_unset")]
    pub region: SpecimenRegion,
    /// Contrast of the image: whether grains are brighter or darker than the matrix.
    pub contrast: Contrast,
    /// Two percentiles of the grey values. Grey values are rounded to 16-bit integers between these percentiles.
    #[schemars(inner(range(min = 0, max = 100)))]
    pub percentiles: [f64; 2],
    /// Whether a median filter of 3³ voxels is applied before voxels are classified.
    pub median: bool,
    /// Whether the segmentation uses a tilted cylinder if the axis is displaced by more than one voxel between the
    /// ends. Otherwise the cylinder is upright. The image is not rotated: labels belong to the voxels of the original
    /// image.
    pub follow_lean: bool,
    /// Whether the variation of brightness with radius and height of a cylinder is corrected.
    pub beam_hardening: bool,
    /// Grey value below which voxels are air or void; determined from the image if absent. If grains are the darkest
    /// and air is the brightest material, voxels above this grey value are air.
    pub void_threshold: Option<f64>,
    /// Lowest grey value of grains, or the highest grey value if grains are dark; determined from the image if absent.
    ///
    /// The value determined from the image is half way between the grey values of matrix and grains in a model of two
    /// materials and blur. A given value that differs from the determined value by at most 0.02 of the contrast results
    /// in the same grains. A given value that differs by at most 0.3 of the contrast is corrected by the model, so that
    /// blur and median filter do not shrink grains; the volumes are the numbers of voxels above the corrected level.
    /// Without a model, the volume of a grain is the volume above the given value.
    pub grain_threshold: Option<f64>,
    /// Largest size of a hole in a grain that is filled (voxels).
    pub fill_holes_voxels: usize,
    /// Rule that separates touching grains.
    pub seeds: SeedRule,
    /// For `h-maxima`: two neighbouring maxima of the distance belong to different grains if the distance falls by at
    /// least this value between them, measured from the lower maximum (voxels).
    #[schemars(range(min = 0, max = 100))]
    pub h_voxels: f64,
    /// For `h-maxima`: number of smoothing passes of the distance, with weights 1–2–1 along each axis; n passes have a
    /// standard deviation of √(n/2) voxels.
    #[schemars(range(min = 0, max = 100))]
    pub smoothing_passes: usize,
    /// For `spacing`: the seeds of two grains are more than this number of voxels apart along at least one axis.
    #[schemars(range(min = 1, max = 100))]
    pub spacing_voxels: usize,
    /// Smallest number of voxels of a grain; smaller grains are omitted.
    pub min_grain_voxels: usize,
}

/// Rule that separates touching grains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SeedRule {
    /// A grain grows from a maximum of the smoothed distance. The distance must fall by at least `h_voxels` on every
    /// path to a higher maximum.
    #[default]
    HMaxima,
    /// A grain grows from a maximum of the distance (rounded to whole voxels) that is more than `spacing_voxels` away
    /// from all other maxima, as with `peak_local_max` of scikit-image. This rule splits too many grains, and its
    /// result depends on the orientation of the image; the rule is provided for comparison.
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
    /// Checks that the settings are within their ranges.
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
        // for dark grains, only the image shows whether their grey values are above or below the grey value of air
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
