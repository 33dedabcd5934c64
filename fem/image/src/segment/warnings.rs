//! Warnings about doubtful results of a segmentation.

use crate::Region;
use crate::grains::statistics::SpecimenStatistics;

/// Share of the specimen's volume above which voids cause a warning.
const VOIDS: f64 = 0.02;
/// The measured volume of a grain below this volume (voxels) is uncertain.
const SMALL: f64 = 65.0;
/// A warning is added if grains smaller than [`SMALL`] have more than this share of the volume of all grains.
const SMALL_SHARE: f64 = 0.05;
/// Difference between the grain fractions from grey values and from voxels above which a warning is added, as a share
/// of the fraction from grey values.
const FRACTION_DIFFERENCE: f64 = 0.05;

/// Returns a warning about voids in the specimen.
pub(super) fn void_in_words(fraction: f64) -> Option<String> {
    (fraction > VOIDS).then(|| {
        format!(
            "{:.1} % of the specimen is as dark as air (cracks, pores, a chipped edge) and is meshed as matrix: the grain fraction refers to the cylinder including its voids (share of voids: void_fraction in segment.csv)",
            100.0 * fraction
        )
    })
}

/// Returns a warning about grains that are too small for an accurate volume.
pub(super) fn small_in_words(regions: &[Region], voxel_mm: f64) -> Option<String> {
    let volume = |region: &Region| region.volume_mm3 / voxel_mm.powi(3);
    let small: Vec<f64> = regions.iter().map(volume).filter(|&volume| volume < SMALL).collect();
    let all: f64 = regions.iter().map(volume).sum();
    let share = small.iter().sum::<f64>() / all;
    (share > SMALL_SHARE).then(|| {
        format!(
            "{} of {} grains, {:.0} % of the grains' volume, are smaller than {SMALL} voxels (2.5 voxels in radius): their volumes and numbers are uncertain by more than 10 %",
            small.len(),
            regions.len(),
            100.0 * share
        )
    })
}

/// Returns a warning if the grain fractions from grey values and from voxels differ.
pub(super) fn fractions_in_words(statistics: &SpecimenStatistics) -> Option<String> {
    let SpecimenStatistics { grain_fraction, voxel_fraction, .. } = *statistics;
    let difference = (voxel_fraction / grain_fraction - 1.0).abs();
    // the difference of fractions that are 0 is not a number
    (difference > FRACTION_DIFFERENCE).then(|| {
        format!(
            "the grain fraction is uncertain by {:.0} %: it is {grain_fraction:.3} from grey values (the mesh has this fraction) and {voxel_fraction:.3} from voxels: compare the outlines with the grains in the slices, and give grain_threshold if they differ",
            100.0 * difference
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn statistics(grain_fraction: f64, voxel_fraction: f64) -> SpecimenStatistics {
        SpecimenStatistics {
            grains: 10,
            volume_mm3: 1.0,
            grain_fraction,
            voxel_fraction,
            d10_mm: 0.1,
            d50_mm: 0.2,
            d90_mm: 0.3,
            median_diameter_mm: 0.2,
            coordination: 1.0,
        }
    }

    #[test]
    fn different_fractions_cause_a_warning() {
        for (grey, voxels) in [(0.437, 0.398), (0.398, 0.437)] {
            let warning = fractions_in_words(&statistics(grey, voxels)).unwrap();
            assert!(warning.contains(&format!("{grey:.3} from grey values")), "{warning}");
            assert!(warning.contains(&format!("{voxels:.3} from voxels")), "{warning}");
        }
        for (grey, voxels) in [(0.4, 0.4), (0.4, 0.419), (0.4, 0.381), (0.0, 0.0)] {
            assert_eq!(fractions_in_words(&statistics(grey, voxels)), None);
        }
    }
}
