//! The grey level between matrix and grain.

use rayon::prelude::*;

use crate::Volume;
use crate::classify::blurred::Blurred;
use crate::volume::contrast::Contrast;
use crate::volume::filter::core;
use crate::volume::threshold::{WIDTH, class_means, core_mean, histogram, level_of, middle, otsu};

/// Two halves of one bell curve are this many of their own deviations apart.
const ONE_BELL: f64 = 3.0;
/// A level that is given is compared with the materials if it is at most this share of their contrast from the middle.
const OFF: f64 = 0.3;
/// The model's middle is known to this share of the contrast. A value that is given nearer to it is taken as the middle.
const DOUBT: f64 = 0.02;
/// The level lies between these shares of the way from matrix to grain.
const WAY: [f64; 2] = [0.3, 0.7];
/// Shares of grain are cut here before they are summed: noise passes, pores do not.
const CUT: [f64; 2] = [-0.5, 1.5];

/// A level that parts matrix from grain.
#[derive(Clone, Debug)]
pub(crate) struct Level {
    /// The filtered grey value from which on a voxel is grain.
    pub(crate) value: f64,
    /// The grey value that stands for the level: given by hand, it makes the same.
    pub(crate) by_hand: f64,
    /// Whether the grey values look like those of one phase.
    pub(crate) one_bell: bool,
    /// The two materials and the blur of the image, if they could be told apart.
    pub(crate) model: Option<Blurred>,
}

impl Level {
    /// Finds the level for an image that was filtered (`smooth`), so that as many voxels lie above it as
    /// the unfiltered grey values make up.
    ///
    /// `inside` are the voxels that may be grain, and `sample` those of them that are away from walls and voids: a voxel
    /// of matrix that holds some air is no class of its own. Nothing if there is one grey value only.
    ///
    /// Otsu's threshold comes first, then the middle between the means of matrix and grains away from interfaces where
    /// there are such voxels, then the model of two materials and their blur ([`Blurred`]).
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
            value = level_of(&counts, volume).clamp(limit(WAY[0]), limit(WAY[1]));
        }
        let by_hand = model.as_ref().map_or(value, Blurred::middle);
        Some(Level { value, by_hand, one_bell, model })
    }

    /// The level that stands for a grey value given by hand, which parts matrix from grain where a surface is plane.
    ///
    /// Blur and median make small grains smaller at that grey value. The level is moved as far as the model of two
    /// materials says, so that a value half way between them gives grains their volume. Without such a model, or where
    /// the value is far from half way, the level is the value itself.
    pub(crate) fn given(
        value: f64,
        smooth: &Volume<u16>,
        grey: &Volume<u16>,
        inside: &[u8],
        sample: &[u8],
    ) -> Level {
        let by_hand = value;
        let own = Level { value, by_hand, one_bell: false, model: None };
        let Some(model) = Blurred::fit(smooth, grey, inside, sample, value) else { return own };
        let contrast = model.grain - model.matrix;
        let off = value - model.middle();
        if off.abs() > OFF * contrast {
            return own;
        }
        if off.abs() <= DOUBT * contrast {
            // the level that is found without a value, so that this one gives the same grains
            let is_near = |model: &Blurred| (value - model.middle()).abs() <= DOUBT * contrast;
            let found = Self::find(smooth, grey, inside, sample).and_then(|found| found.model);
            let model = found.filter(is_near).unwrap_or(model);
            return Level { value: model.level, model: Some(model), ..own };
        }
        Level { value: model.level + off - DOUBT * contrast.copysign(off), ..own }
    }
}

/// The mean grey value of the matrix in a filtered image, away from grains where there are such voxels, and the grey value
/// between matrix and grains; nothing if there is one grey value only.
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

fn middle_of([matrix, grain]: [f64; 2]) -> f64 {
    (matrix + grain) / 2.0
}

/// The sum of the grain shares (voxels).
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
    // integers, so that the order of summation does not show
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

/// Distance of the means of two classes over the mean of their standard deviations.
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
