//! Statistics of a whole specimen.

use crate::Region;

/// Statistics of a segmented specimen as a whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpecimenStatistics {
    /// Number of grains.
    pub grains: usize,
    /// Volume of the specimen: the cylinder, or the whole image (mm³).
    pub volume_mm3: f64,
    /// Volume of the grains divided by the volume of the specimen. The volume of the grains is computed from grey
    /// values.
    pub grain_fraction: f64,
    /// Volume of the grains divided by the volume of the specimen. The volume of the grains is computed by counting
    /// whole voxels.
    pub voxel_fraction: f64,
    /// Equivalent sphere diameter D10 (mm): 10 % of the volume of all grains is in smaller grains.
    pub d10_mm: f64,
    /// Equivalent sphere diameter D50 (mm): 50 % of the volume of all grains is in smaller grains.
    pub d50_mm: f64,
    /// Equivalent sphere diameter D90 (mm): 90 % of the volume of all grains is in smaller grains.
    pub d90_mm: f64,
    /// Median of the grains' equivalent sphere diameters (mm).
    pub median_diameter_mm: f64,
    /// Mean number of grains that a grain touches.
    pub coordination: f64,
}

impl SpecimenStatistics {
    pub(crate) fn of(regions: &[Region], voxel_mm: f64, volume_mm3: f64) -> Self {
        let mut sizes: Vec<(f64, f64)> =
            regions.iter().map(|region| (region.diameter_mm(), region.volume_mm3)).collect();
        sizes.sort_by(|a, b| a.0.total_cmp(&b.0));
        let solid_mm3: f64 = sizes.iter().map(|size| size.1).sum();
        let by_volume = |share: f64| {
            let mut below = 0.0;
            let grain = sizes.iter().find(|size| {
                below += size.1;
                below >= share * solid_mm3
            });
            grain.or(sizes.last()).map_or(f64::NAN, |size| size.0)
        };
        let voxels: usize = regions.iter().map(|region| region.voxels).sum();
        let contacts: usize = regions.iter().map(|region| region.neighbours.len()).sum();
        SpecimenStatistics {
            grains: regions.len(),
            volume_mm3,
            grain_fraction: solid_mm3 / volume_mm3,
            voxel_fraction: voxels as f64 * voxel_mm.powi(3) / volume_mm3,
            d10_mm: by_volume(0.1),
            d50_mm: by_volume(0.5),
            d90_mm: by_volume(0.9),
            median_diameter_mm: sizes.get(sizes.len() / 2).map_or(f64::NAN, |size| size.0),
            coordination: contacts as f64 / regions.len() as f64,
        }
    }
}
