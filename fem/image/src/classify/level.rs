//! The grey level between matrix and grain.

use rayon::prelude::*;

use crate::Volume;
use crate::classify::blurred::Blurred;
use crate::volume::contrast::Contrast;
use crate::volume::filter::core;
use crate::volume::threshold::{WIDTH, class_means, core_mean, histogram, level_of, middle, otsu};

/// Separation of two classes of grey values, in standard deviations. With a smaller separation, the classes count as
/// the two halves of one normal distribution, i.e. of a single phase.
const ONE_BELL: f64 = 3.0;
/// A threshold given by the user is corrected only if it is close to the middle between the grey values of matrix and
/// grain in the model. This value is the largest allowed distance, as a share of the contrast.
const OFF: f64 = 0.3;
/// Uncertainty of the middle between the grey values of matrix and grain in the model, as a share of the contrast. A
/// threshold within this distance from the middle counts as the middle.
const DOUBT: f64 = 0.02;
/// Lower and upper limit of the level, as shares of the contrast above the matrix's grey value.
const LEVEL_RANGE: [f64; 2] = [0.3, 0.7];
/// Limits to which shares of grain are clamped before they are summed. Noise lies within the limits; only pores are
/// clamped.
const CUT: [f64; 2] = [-0.5, 1.5];

/// A grey level that separates matrix from grain.
#[derive(Clone, Debug)]
pub(crate) struct Level {
    /// Lowest grey value of grain voxels in the filtered image.
    pub(crate) value: f64,
    /// Threshold that results in the same level if the user gives it.
    pub(crate) by_hand: f64,
    /// Whether the grey values have the distribution of a single phase.
    pub(crate) one_bell: bool,
    /// The model of two materials and blur; `None` if the model could not be fitted, or if a threshold given by the user
    /// is not near the middle between the materials.
    pub(crate) model: Option<Blurred>,
    /// Whether the model could be fitted.
    pub(crate) is_fitted: bool,
    /// Grey values of matrix and grains: of the model if it could be fitted, otherwise the means of the voxels below and
    /// above the level.
    pub(crate) materials: [f64; 2],
}

impl Level {
    /// Finds the level for a filtered image (`smooth`): the number of voxels above the level equals the volume of the
    /// grains by the unfiltered grey values.
    ///
    /// `inside` are the voxels that may be grain. `sample` is the subset of these voxels away from walls and voids:
    /// matrix voxels that contain some air must not form a separate class. Returns `None` if the image has only one
    /// grey value.
    ///
    /// The level is first Otsu's threshold, then the middle between the means of matrix and grains away from interfaces
    /// (if such voxels exist), and finally the level of the model of two materials and blur ([`Blurred`]), if the fit
    /// succeeds.
    pub(crate) fn find(
        smooth: &Volume<u16>,
        grey: &Volume<u16>,
        inside: &[u8],
        sample: &[u8],
    ) -> Option<Level> {
        let counts = histogram(&smooth.values, sample);
        let split = *otsu(&counts, 2)?.first()?;
        let one_bell = separation(&counts, split) < ONE_BELL;
        let mut value = (split * WIDTH) as f64;
        let means = |level: f64| {
            let matrix = core_mean(smooth, sample, 0.0..level)?;
            Some([matrix, core_mean(smooth, sample, level..f64::INFINITY)?])
        };
        let first = means(value);
        value = first.map_or(value, middle_of);
        let model = Blurred::fit(smooth, grey, inside, sample, value);
        if let Some(model) = &model {
            value = model.level;
        } else if let Some([matrix, grain]) = first.and_then(|first| means(middle_of(first))) {
            value = (matrix + grain) / 2.0;
            let volume = volume(smooth, grey, sample, value, [matrix, grain]);
            let limit = |share: f64| matrix + share * (grain - matrix);
            value = level_of(&counts, volume).clamp(limit(LEVEL_RANGE[0]), limit(LEVEL_RANGE[1]));
        }
        let by_hand = model.as_ref().map_or(value, Blurred::middle);
        let is_fitted = model.is_some();
        let materials = materials(model.as_ref(), &counts, value);
        Some(Level { value, by_hand, one_bell, model, is_fitted, materials })
    }

    /// Returns the level for a threshold `value` given by the user, which separates matrix from grain at a plane
    /// surface.
    ///
    /// With this threshold as level, blur and median filter would shrink small grains. The model of two materials and
    /// blur therefore shifts the level, so that a threshold half way between the materials results in the true volume
    /// of the grains. Without a model, or if the threshold is far from half way between the materials, the level is the
    /// threshold.
    pub(crate) fn given(
        value: f64,
        smooth: &Volume<u16>,
        grey: &Volume<u16>,
        inside: &[u8],
        sample: &[u8],
    ) -> Level {
        let fitted = Blurred::fit(smooth, grey, inside, sample, value);
        let unshifted = Level {
            value,
            by_hand: value,
            one_bell: false,
            model: None,
            is_fitted: fitted.is_some(),
            materials: materials(fitted.as_ref(), &histogram(&smooth.values, sample), value),
        };
        let Some(model) = fitted else { return unshifted };
        let contrast = model.grain - model.matrix;
        let off = value - model.middle();
        if off.abs() > OFF * contrast {
            return unshifted;
        }
        if off.abs() <= DOUBT * contrast {
            // compute the level as if no threshold were given, so that giving the threshold that the program computes
            // does not change the grains
            let is_near = |model: &Blurred| (value - model.middle()).abs() <= DOUBT * contrast;
            let computed = Self::find(smooth, grey, inside, sample).and_then(|level| level.model);
            let model = computed.filter(is_near).unwrap_or(model);
            return Level { value: model.level, model: Some(model), ..unshifted };
        }
        Level { value: model.level + off - DOUBT * contrast.copysign(off), ..unshifted }
    }
}

/// Returns the mean grey value of the matrix in a filtered image and the grey value between matrix and grains; `None`
/// if the image has only one grey value. The mean is over matrix voxels away from grains, if such voxels exist.
pub(crate) fn matrix_grey(
    smooth: &Volume<u16>,
    sample: &[u8],
    contrast: Contrast,
) -> Option<[f64; 2]> {
    let counts = histogram(&smooth.values, sample);
    let splits = otsu(&counts, 2)?;
    let split = (splits.first()? * WIDTH) as f64;
    let (class, range) = match contrast {
        Contrast::Bright => (0, 0.0..split),
        Contrast::Dark => (1, split..f64::INFINITY),
    };
    let class_mean = class_means(&counts, &splits)[class];
    Some([core_mean(smooth, sample, range).unwrap_or(class_mean), split])
}

/// Returns the grey values of matrix and grains: of the model, or the means of the voxels below and above a level.
fn materials(model: Option<&Blurred>, counts: &[u64], level: f64) -> [f64; 2] {
    match model {
        Some(model) => [model.matrix, model.grain],
        None => {
            let split = ((level / WIDTH as f64) as usize).min(counts.len());
            let means = class_means(counts, &[split]);
            [means[0], means[1]]
        }
    }
}

fn middle_of([matrix, grain]: [f64; 2]) -> f64 {
    (matrix + grain) / 2.0
}

/// Returns the volume of the grains (voxels): the sum of the shares of grain of all voxels.
fn volume(
    smooth: &Volume<u16>,
    grey: &Volume<u16>,
    inside: &[u8],
    level: f64,
    [matrix, grain]: [f64; 2],
) -> f64 {
    let shape = grey.shape;
    let set: Vec<u8> = smooth
        .values
        .par_iter()
        .zip(inside)
        .map(|(&value, &inside)| u8::from(f64::from(value) >= level) & inside)
        .collect();
    let rest: Vec<u8> = set.par_iter().map(|&grain| 1 - grain).collect();
    let (core, far) = (core(shape, &set), core(shape, &rest));
    // sum integers, so that the result does not depend on the order of summation
    let unit = 65536.0;
    let sum: i64 = (0..set.len())
        .into_par_iter()
        .filter(|&n| far[n] == 0 && inside[n] != 0)
        .map(|n| {
            let share = (f64::from(grey.values[n]) - matrix) / (grain - matrix);
            let share = if core[n] != 0 { 1.0 } else { share.clamp(CUT[0], CUT[1]) };
            (share * unit).round() as i64
        })
        .sum();
    sum as f64 / unit
}

/// Divides a histogram into two classes at the bin `split`. Returns the difference of the means of the classes, divided
/// by the mean of their standard deviations.
fn separation(counts: &[u64], split: usize) -> f64 {
    let moments = |counts: &[u64], first: usize| {
        let all: u64 = counts.iter().sum();
        let weighted = |value: &dyn Fn(f64) -> f64| {
            let values = counts.iter().enumerate();
            values.map(|(n, &c)| c as f64 * value(middle(first + n))).sum::<f64>() / all as f64
        };
        let mean = weighted(&|v| v);
        (mean, weighted(&|v| (v - mean).powi(2)).sqrt())
    };
    let (low, high) = (moments(&counts[..split], 0), moments(&counts[split..], split));
    (high.0 - low.0) / ((low.1 + high.1) / 2.0).max(f64::MIN_POSITIVE)
}
