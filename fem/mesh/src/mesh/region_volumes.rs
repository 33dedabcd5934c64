//! Volumes of regions in meshes with mixtures.

use super::TetMesh;

impl TetMesh {
    /// Returns the volume of each region (mm³), in the order of [`TetMesh::regions`]. A mixture contributes to both
    /// of its phases according to their fractions, whereas [`TetMesh::region_volume`] adds up whole tetrahedra.
    pub fn phase_volumes(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.regions.len()];
        for (tet, volume) in self.volumes().into_iter().enumerate() {
            let own = usize::from(self.region_of[tet]);
            let mixture = self.mixture.as_ref().map(|all| all[tet]).unwrap_or_default();
            let share = f64::from(mixture.fraction);
            sums[own] += (1.0 - share) * volume;
            if share > 0.0 {
                sums[usize::from(mixture.region)] += share * volume;
            }
        }
        sums
    }
}
