//! Measured specimens at the size of the mesh: equal nominal strain and stress.

use fem::TetMesh;

use super::simulator::{height_mm, radius_mm};
use crate::error::InputError;
use crate::experiment::{Specimen, TestCurve};
use crate::table::TableRow;

/// Part of the circle around a mesh that its mean section fills if it is a cylinder. A regular polygon of seven sides
/// fills 0.87, a square 0.64.
const CYLINDER: f64 = 0.85;
/// Relative differences of sizes below this are rounding.
const ROUNDING: f64 = 1e-9;

/// Size of the meshed specimen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeshSize {
    pub(super) height_mm: f64,
    /// Of the circle around it.
    pub(super) radius_mm: f64,
    /// Whether its section fills that circle.
    pub(super) is_cylinder: bool,
}

impl MeshSize {
    pub(super) fn of(mesh: &TetMesh) -> Self {
        let (height_mm, radius_mm) = (height_mm(mesh), radius_mm(mesh));
        let volume_mm3 = mesh.volume();
        let around_mm3 = std::f64::consts::PI * radius_mm * radius_mm * height_mm;
        Self { height_mm, radius_mm, is_cylinder: volume_mm3 > CYLINDER * around_mm3 }
    }

    /// A cylinder of this size.
    pub(super) fn of_cylinder([height_mm, radius_mm]: [f64; 2]) -> Self {
        Self { height_mm, radius_mm, is_cylinder: true }
    }
}

/// What displacements and forces of a specimen are multiplied by to compare with the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeshScale {
    /// Ratio of the heights: equal nominal strain.
    pub(super) displacement: f64,
    /// Ratio of the sections: equal nominal stress. 1 where the mesh is no cylinder.
    pub(super) force: f64,
}

impl MeshScale {
    /// Columns of `experiments.csv` that it is written to.
    pub(super) const COLUMNS: [&str; 2] = ["displacement_factor", "force_factor"];

    pub(super) fn of(specimen: &Specimen, mesh: MeshSize) -> Self {
        let factor = |ratio: f64| if (ratio - 1.0).abs() > ROUNDING { ratio } else { 1.0 };
        let displacement = factor(mesh.height_mm / specimen.height_mm);
        let force = match mesh.is_cylinder {
            true => factor(mesh.radius_mm / specimen.radius_mm).powi(2),
            false => 1.0,
        };
        Self { displacement, force }
    }

    /// The scale in a row of `experiments.csv`. Tables of versions that did not scale forces have no column for it.
    pub(super) fn of_row(row: TableRow<'_>) -> Result<Self, InputError> {
        let [displacement, force] = Self::COLUMNS;
        let force = match row.text(force).is_empty() {
            true => 1.0,
            false => row.positive(force)?,
        };
        Ok(Self { displacement: row.positive(displacement)?, force })
    }

    /// The curve at the size of the mesh.
    pub(super) fn apply(self, curve: &TestCurve) -> TestCurve {
        let curve = curve.scale_displacement(self.displacement);
        if self.force == 1.0 { curve } else { curve.scale_force(self.force) }
    }
}

#[cfg(test)]
mod tests {
    use fem::CylinderLattice;

    use super::*;

    fn specimen(height_mm: f64, radius_mm: f64, factor: f64) -> Specimen {
        let curve = TestCurve {
            displacement_mm: vec![0.0, 0.1 * height_mm],
            force_n: vec![0.0, factor * 7.0],
        };
        Specimen {
            id: "S-1".into(),
            height_mm,
            radius_mm,
            group: String::new(),
            slope_fraction: None,
            image: None,
            rate_mm_per_s: None,
            curve,
        }
    }

    /// A material of one stress–strain curve gives specimens of all sizes one curve at the size of the mesh.
    #[test]
    fn nominal_stress_and_strain_are_those_of_the_specimen() {
        let mesh = MeshSize::of_cylinder([4.4, 2.5]);
        for (height_mm, radius_mm) in [(4.4, 2.5), (4.95, 2.52), (8.8, 2.4)] {
            let own = specimen(height_mm, radius_mm, radius_mm * radius_mm);
            let curve = MeshScale::of(&own, mesh).apply(&own.curve);
            assert!((curve.displacement_mm[1] - 0.44).abs() < 1e-12, "{curve:?}");
            assert!((curve.force_n[1] - 6.25 * 7.0).abs() < 1e-12, "{curve:?}");
        }
        let same = specimen(4.4, 2.5 * (1.0 + 1e-12), 1.0);
        assert_eq!(MeshScale::of(&same, mesh), MeshScale { displacement: 1.0, force: 1.0 });
        let block = MeshSize { is_cylinder: false, ..mesh };
        assert_eq!(MeshScale::of(&specimen(4.4, 2.4, 1.0), block).force, 1.0);
    }

    #[test]
    fn a_lattice_of_a_cylinder_is_one_and_a_block_is_not() {
        for spacing_mm in [0.7, 1.5] {
            let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm };
            let mut mesh = lattice.build().unwrap();
            let size = MeshSize::of(&mesh);
            assert!((size.radius_mm - 2.5).abs() < 1e-9 && size.is_cylinder, "{size:?}");
            // the walls pressed into a plate
            mesh.nodes.iter_mut().for_each(|node| node[1] *= 0.5);
            assert!(!MeshSize::of(&mesh).is_cylinder);
        }
    }
}
