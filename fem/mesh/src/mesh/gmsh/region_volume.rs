//! Volumes of the regions of a mesh file and of the mesh that is made from it.

use std::fmt;

use crate::mesh::TetMesh;

/// Volume of a region in the file, with the curved edges of the file, and in the imported mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct RegionVolume {
    /// Name of the region.
    pub name: String,
    /// Volume in the file (mm³).
    pub file_mm3: f64,
    /// Volume in the imported mesh (mm³).
    pub mesh_mm3: f64,
}

impl RegionVolume {
    pub(super) fn pairs(names: &[String], file: Vec<f64>, mesh: Vec<f64>) -> Vec<RegionVolume> {
        let pair = |((name, file_mm3), mesh_mm3): ((&String, f64), f64)| RegionVolume {
            name: name.clone(),
            file_mm3,
            mesh_mm3,
        };
        names.iter().zip(file).zip(mesh).map(pair).collect()
    }

    /// Returns the relative change of the volume.
    pub fn change(&self) -> f64 {
        self.mesh_mm3 / self.file_mm3 - 1.0
    }
}

impl fmt::Display for RegionVolume {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let RegionVolume { name, file_mm3, mesh_mm3 } = self;
        write!(
            f,
            "{name} {mesh_mm3:.4} instead of {file_mm3:.4} mm³ ({:+.2} %)",
            100.0 * self.change()
        )
    }
}

/// Returns the volume of each region (mm³), in the order of the regions. A mixture counts as its region.
pub(super) fn region_volumes(mesh: &TetMesh) -> Vec<f64> {
    let mut sums = vec![0.0; mesh.regions.len()];
    for (volume, &region) in mesh.volumes().into_iter().zip(&mesh.region_of) {
        sums[usize::from(region)] += volume;
    }
    sums
}
