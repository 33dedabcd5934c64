//! Warnings about doubtful results of a segmentation.

use crate::classify::exchanged::Shapes;
use crate::grains::statistics::SpecimenStatistics;
use crate::{Contrast, Region};

/// Share of the specimen's volume above which voids cause a warning about the mesh.
const VOIDS: f64 = 0.02;
/// Share of the specimen's volume above which voids cause a warning about the grain fraction. In synthetic specimens
/// without voids the share is 0, even if the noise is 30 % of the difference between matrix and air.
const THIN_VOIDS: f64 = 0.001;
/// Radius of a cylinder (voxels) below which the error of the grain fraction exceeds 3 % in some synthetic specimens.
const THIN: f64 = 12.0;
/// The measured volume of a grain below this volume (voxels) is uncertain.
const SMALL: f64 = 65.0;
/// A warning is added if grains smaller than [`SMALL`] have more than this share of the volume of all grains.
const SMALL_SHARE: f64 = 0.05;
/// Difference between the grain fractions from grey values and from voxels above which a warning is added, as a share
/// of the fraction from grey values.
const FRACTION_DIFFERENCE: f64 = 0.05;

/// Returns a warning about voids in the specimen.
pub(super) fn void_in_words(fraction: f64, contrast: Contrast) -> Option<String> {
    let beside = match contrast {
        Contrast::Bright => {
            "blur mixes air into grains beside thin voids, so that the grain fraction may be too small by several times the share of voids"
        }
        Contrast::Dark => {
            "blur gives the rims of thin voids the grey values of dark grains, so that the grain fraction may be wrong by several times the share of voids"
        }
    };
    let percent = 100.0 * fraction;
    if fraction > VOIDS {
        return Some(format!(
            "{percent:.1} % of the specimen is as dark as air (cracks, pores, a chipped edge) and is meshed as matrix: the grain fraction refers to the cylinder including its voids (share of voids: void_fraction in segment.csv); {beside}",
        ));
    }
    (fraction > THIN_VOIDS).then(|| {
        format!(
            "the grain fraction is uncertain: {percent:.2} % of the specimen is as dark as air (cracks, pores; void_fraction in segment.csv), and {beside}"
        )
    })
}

/// Returns a warning if the material that counts as grain is hollow and the other material is not. In `shapes`, the
/// brighter material is the material that counts as grain. `is_inverted` is true for an image in which air is the
/// brightest material.
pub(super) fn exchanged_in_words(
    shapes: Option<Shapes>,
    contrast: Contrast,
    is_inverted: bool,
) -> Option<String> {
    let shapes = shapes.filter(Shapes::is_exchanged)?;
    let (counted, other, remedy) = match (contrast, is_inverted) {
        (Contrast::Bright, _) => {
            ("brighter", "darker", "set contrast = \"dark\" in [specimen.image]")
        }
        (Contrast::Dark, false) => {
            ("darker", "brighter", "set contrast = \"bright\" in [specimen.image]")
        }
        (Contrast::Dark, true) => ("darker", "brighter", "invert the grey values of the image"),
    };
    Some(format!(
        "grains and matrix are exchanged if grains are the {other} material: the {counted} material counts as grain but is hollow, \
         as a matrix around grains (relative curvature of the interface {:.2}; separate grains: up to 0.67), and {:.0} % of it is \
         one connected part, but {:.0} % of the {other} material: {remedy}",
        shapes.curvature,
        100.0 * shapes.bright_part,
        100.0 * shapes.dark_part
    ))
}

/// Returns a warning if the model of two materials and blur could not be fitted.
pub(super) fn unfitted_in_words(is_fitted: bool) -> Option<String> {
    (!is_fitted).then(|| {
        "grain volumes are uncertain by more than 10 %, because no model of the two blurred materials could be fitted: too few voxels \
         of matrix or grain are away from the wall and from voids; a smaller voxel size, or a specimen with more grains, gives \
         accurate volumes"
            .to_owned()
    })
}

/// Returns a warning about a cylinder that is too thin for an accurate grain fraction.
pub(super) fn thin_in_words(radius: f64) -> Option<String> {
    (radius < THIN).then(|| {
        format!(
            "the grain fraction is uncertain: the specimen has a radius of {radius:.1} voxels, and in synthetic specimens the \
             error of the fraction was up to 5 % with a radius of 8 to 11 voxels and up to 23 % with a radius of 7 voxels; with a \
             smaller voxel size, so that the radius is at least {THIN} voxels, the error is below 3 %"
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
