//! Agreement of labels with a reference segmentation (the truth).

use std::collections::BTreeMap;

use rayon::prelude::*;

use crate::{ImageError, Volume};

/// Agreement of a segmentation with a reference segmentation (the truth).
///
/// Two grains match if their overlap is more than half of their union; each grain then has at most one match.
///
/// # References
/// Panoptic quality: A. Kirillov et al., CVPR (2019) 9396–9405, doi:10.1109/CVPR.2019.00963.
/// Variation of information: M. Meilă, J. Multivar. Anal. 98 (2007) 873–895,
/// doi:10.1016/j.jmva.2006.11.013.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Score {
    /// Number of grains in the reference segmentation (the truth).
    pub truth: usize,
    /// Number of grains in the segmentation.
    pub found: usize,
    /// Number of matching pairs.
    pub matched: usize,
    /// Panoptic quality: the sum over the matching pairs of (overlap divided by union), divided by the mean of the
    /// numbers of grains in both segmentations.
    pub panoptic_quality: f64,
    /// Dice coefficient: twice the number of voxels that are grain in both segmentations, divided by the sum of the
    /// numbers of grain voxels of the two segmentations.
    pub dice: f64,
    /// Rand index of the voxels that are grain in both segmentations: share of pairs of voxels that are in the same
    /// grain in both segmentations, or in different grains in both segmentations.
    pub rand: f64,
    /// Variation of information (bits) of the voxels that are grain in both segmentations: the conditional entropy of
    /// the segmentation given the truth, plus the conditional entropy of the truth given the segmentation.
    pub variation_of_information: f64,
}

/// Compares labels with the labels of a truth; the label 0 is not a grain.
///
/// # Errors
/// [`ImageError`] if the shapes differ.
///
/// # Example
/// ```
/// let truth = fem_image::Volume::new([4, 1, 1], 1.0, vec![0, 1, 1, 2])?;
/// let segmented = fem_image::Volume::new([4, 1, 1], 1.0, vec![0, 7, 7, 9])?;
/// let score = fem_image::score(&truth, &segmented)?;
/// assert_eq!((score.matched, score.panoptic_quality, score.dice), (2, 1.0, 1.0));
/// # Ok::<(), fem_image::ImageError>(())
/// ```
pub fn score(truth: &Volume<u32>, segmented: &Volume<u32>) -> Result<Score, ImageError> {
    truth.check()?;
    segmented.check()?;
    if truth.shape != segmented.shape {
        return Err(ImageError::Shape { shape: truth.shape, values: segmented.values.len() });
    }
    let overlaps = overlaps(&truth.values, &segmented.values);
    let mut sizes = [BTreeMap::new(), BTreeMap::new()];
    for (&(a, b), &count) in &overlaps {
        *sizes[0].entry(a).or_insert(0_u64) += count;
        *sizes[1].entry(b).or_insert(0_u64) += count;
    }
    let grains = |side: usize| sizes[side].keys().filter(|&&label| label != 0).count();
    let (true_grains, found_grains) = (grains(0), grains(1));
    let (mut matched, mut overlap_sum) = (0, 0.0);
    for (&(a, b), &count) in overlaps.iter().filter(|((a, b), _)| *a != 0 && *b != 0) {
        let union = sizes[0][&a] + sizes[1][&b] - count;
        if 2 * count > union {
            matched += 1;
            overlap_sum += count as f64 / union as f64;
        }
    }
    let size = |side: usize| -> u64 {
        sizes[side].iter().filter(|(label, _)| **label != 0).map(|(_, count)| count).sum()
    };
    let common = Common::of(&overlaps);
    let mean = (true_grains + found_grains) as f64 / 2.0;
    Ok(Score {
        truth: true_grains,
        found: found_grains,
        matched,
        panoptic_quality: if mean > 0.0 { overlap_sum / mean } else { 1.0 },
        dice: match size(0) + size(1) {
            0 => 1.0,
            sum => 2.0 * common.count / sum as f64,
        },
        rand: common.rand,
        variation_of_information: common.information,
    })
}

/// Returns the number of voxels for each pair (label in the truth, label in the segmentation).
fn overlaps(truth: &[u32], segmented: &[u32]) -> BTreeMap<(u32, u32), u64> {
    let portion = 1 << 18;
    truth
        .par_chunks(portion)
        .zip(segmented.par_chunks(portion))
        .fold(BTreeMap::new, |mut counts, (truth, segmented)| {
            let mut at = 0;
            while at < truth.len() {
                // count consecutive voxels with the same pair of labels in one step
                let pair = (truth[at], segmented[at]);
                let run = truth[at..].iter().zip(&segmented[at..]);
                let length = run.take_while(|&(&a, &b)| (a, b) == pair).count();
                *counts.entry(pair).or_insert(0) += length as u64;
                at += length;
            }
            counts
        })
        .reduce(BTreeMap::new, |mut a, b| {
            for (pair, count) in b {
                *a.entry(pair).or_insert(0) += count;
            }
            a
        })
}

/// Measures of agreement over the voxels that are grain in both segmentations.
struct Common {
    count: f64,
    rand: f64,
    information: f64,
}

impl Common {
    fn of(overlaps: &BTreeMap<(u32, u32), u64>) -> Common {
        let mut sums = [BTreeMap::new(), BTreeMap::new()];
        let both = || overlaps.iter().filter(|((a, b), _)| *a != 0 && *b != 0);
        for (&(a, b), &n) in both() {
            *sums[0].entry(a).or_insert(0.0) += n as f64;
            *sums[1].entry(b).or_insert(0.0) += n as f64;
        }
        let count: f64 = both().map(|(_, &n)| n as f64).sum();
        if count < 2.0 {
            return Common { count, rand: 1.0, information: 0.0 };
        }
        let pairs = |n: f64| n * (n - 1.0) / 2.0;
        let together: f64 = both().map(|(_, &n)| pairs(n as f64)).sum();
        let pairs_in = |side: usize| sums[side].values().map(|&n| pairs(n)).sum::<f64>();
        let rand = 1.0 + (2.0 * together - pairs_in(0) - pairs_in(1)) / pairs(count);
        let information = both()
            .map(|(&(a, b), &n)| {
                let n = n as f64;
                -n / count * ((n / sums[0][&a]).log2() + (n / sums[1][&b]).log2())
            })
            .sum();
        Common { count, rand, information }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(labels: &[u32]) -> Volume<u32> {
        Volume::new([labels.len(), 1, 1], 1.0, labels.to_vec()).unwrap()
    }

    #[test]
    fn scores_agree_with_counts_by_hand() {
        let truth = row(&[1, 1, 1, 1, 2, 2, 2, 2, 0, 0]);
        let segmented = row(&[5, 5, 5, 0, 7, 7, 8, 8, 8, 0]);
        let score = score(&truth, &segmented).unwrap();
        assert_eq!((score.truth, score.found, score.matched), (2, 3, 1));
        // the matching pair has an overlap of 3 of 4 voxels; the overlap of grain 7 is exactly half of the union, so
        // grain 7 does not match
        assert!((score.panoptic_quality - 0.75 / 2.5).abs() < 1e-15);
        assert!((score.dice - 14.0 / 16.0).abs() < 1e-15);
        // the segmentations disagree on 4 of 21 pairs of voxels: the pairs of one voxel of grain 7 and one voxel of
        // grain 8
        assert!((score.rand - 17.0 / 21.0).abs() < 1e-15);
        assert!((score.variation_of_information - 4.0 / 7.0).abs() < 1e-15);
    }
}
