//! Scaling of measured specimens to the size of the mesh, at equal nominal strain and stress.

use fem::TetMesh;

use crate::case::{ConditionsCase, Similarity};
use crate::error::InputError;
use crate::experiment::{Specimen, TestCurve};
use crate::simulation::setup::{height_mm, radius_mm};
use crate::table::TableRow;

/// A mesh counts as a cylinder if its mean cross-section fills more than this fraction of the circumscribed circle. A
/// regular heptagon fills 0.87, a square 0.64.
const CYLINDER: f64 = 0.85;
/// Relative difference of two sizes below which the difference is a rounding error.
const ROUNDING: f64 = 1e-9;

/// Size of the meshed specimen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MeshSize {
    pub(crate) height_mm: f64,
    /// Radius of the circumscribed circle of the cross-section, mm.
    pub(crate) radius_mm: f64,
    /// Whether the mean cross-section nearly fills its circumscribed circle.
    pub(crate) is_cylinder: bool,
    /// Length over which displacements are measured.
    pub(crate) measured_over: MeasuredOver,
}

/// Length over which the displacements of a test are measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MeasuredOver {
    /// The height of the specimen: displacements of specimens of other heights are scaled.
    Height,
    /// The diameter of a disc: displacements are scaled by the diameter, forces by diameter times thickness.
    Diameter,
    /// A length of the case that does not change with the height of the specimen: the distance between the gauge points of
    /// an extensometer, or a displacement across the axis.
    FixedLength,
}

impl MeasuredOver {
    /// The length for the boundary conditions of a case; without conditions, the displacement of the platen is measured.
    fn of(conditions: Option<&ConditionsCase>) -> Self {
        let is_axial = |[x, y, z]: [f64; 3]| x.hypot(y) <= ROUNDING * z.abs();
        match conditions.and_then(|conditions| conditions.similarity) {
            Some(Similarity::Axial) => return Self::Height,
            Some(Similarity::Diametral) => return Self::Diameter,
            Some(Similarity::Equal) => return Self::FixedLength,
            None => {}
        }
        match conditions {
            Some(conditions)
                if conditions.extensometer.is_some() || !is_axial(conditions.measure.direction) =>
            {
                Self::FixedLength
            }
            _ => Self::Height,
        }
    }
}

impl MeshSize {
    pub(crate) fn of(mesh: &TetMesh) -> Self {
        let (height_mm, radius_mm) = (height_mm(mesh), radius_mm(mesh));
        let volume_mm3 = mesh.volume();
        let around_mm3 = std::f64::consts::PI * radius_mm * radius_mm * height_mm;
        let is_cylinder = volume_mm3 > CYLINDER * around_mm3;
        Self { height_mm, radius_mm, is_cylinder, measured_over: MeasuredOver::Height }
    }

    /// The same size for displacements that are measured as the conditions of a case state.
    pub(crate) fn measured_by(self, conditions: Option<&ConditionsCase>) -> Self {
        Self { measured_over: MeasuredOver::of(conditions), ..self }
    }

    /// A cylinder of this size.
    pub(crate) fn of_cylinder([height_mm, radius_mm]: [f64; 2]) -> Self {
        let measured_over = MeasuredOver::Height;
        Self { height_mm, radius_mm, is_cylinder: true, measured_over }
    }
}

/// Factors that scale displacements and forces of a specimen to the size of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MeshScale {
    /// Ratio of the heights (of a disc: the diameters), for equal nominal strain; 1 if displacements are measured over a fixed length.
    pub(crate) displacement: f64,
    /// Ratio of the cross-sections (of a disc: diameter times thickness), for equal nominal stress; 1 if the mesh is not a cylinder.
    pub(crate) force: f64,
}

impl MeshScale {
    /// Columns of `experiments.csv` with the displacement factor and the force factor.
    pub(crate) const COLUMNS: [&str; 2] = ["displacement_factor", "force_factor"];

    /// Factors for the size of a mesh; without a mesh, both factors are 1.
    pub(crate) fn of(specimen: &Specimen, mesh: Option<MeshSize>) -> Self {
        let Some(mesh) = mesh else { return Self { displacement: 1.0, force: 1.0 } };
        let factor = |ratio: f64| if (ratio - 1.0).abs() > ROUNDING { ratio } else { 1.0 };
        let displacement = match mesh.measured_over {
            MeasuredOver::Height => factor(mesh.height_mm / specimen.height_mm),
            MeasuredOver::Diameter => factor(mesh.radius_mm / specimen.radius_mm),
            MeasuredOver::FixedLength => 1.0,
        };
        let force = match mesh.is_cylinder {
            true if mesh.measured_over == MeasuredOver::Diameter => {
                factor(mesh.radius_mm * mesh.height_mm / (specimen.radius_mm * specimen.height_mm))
            }
            true => factor(mesh.radius_mm / specimen.radius_mm).powi(2),
            false => 1.0,
        };
        Self { displacement, force }
    }

    /// Reads the scale from a row of `experiments.csv`. Versions of the program that did not scale forces wrote no
    /// column for the force factor; the factor is then 1.
    pub(crate) fn of_row(row: TableRow<'_>) -> Result<Self, InputError> {
        let [displacement, force] = Self::COLUMNS;
        let force = match row.text(force).is_empty() {
            true => 1.0,
            false => row.positive(force)?,
        };
        Ok(Self { displacement: row.positive(displacement)?, force })
    }

    /// Scales a curve to the size of the mesh.
    pub(crate) fn apply(self, curve: &TestCurve) -> TestCurve {
        let curve = curve.scale_displacement(self.displacement);
        if self.force == 1.0 { curve } else { curve.scale_force(self.force) }
    }
}

#[cfg(test)]
mod tests {
    use fem::CylinderLattice;

    use super::*;

    fn specimen(height_mm: f64, radius_mm: f64, factor: f64) -> Specimen {
        let curve = TestCurve::new(vec![0.0, 0.1 * height_mm], vec![0.0, factor * 7.0]);
        Specimen {
            id: "S-1".into(),
            height_mm,
            radius_mm,
            group: String::new(),
            slope_fraction: None,
            image: None,
            test: None,
            rate_mm_per_s: None,
            curve,
        }
    }

    /// Specimens of different sizes with the same stress–strain curve have the same force–displacement curve after
    /// scaling to the size of the mesh.
    #[test]
    fn nominal_stress_and_strain_are_those_of_the_specimen() {
        let mesh = MeshSize::of_cylinder([4.4, 2.5]);
        for (height_mm, radius_mm) in [(4.4, 2.5), (4.95, 2.52), (8.8, 2.4)] {
            let tested = specimen(height_mm, radius_mm, radius_mm * radius_mm);
            let curve = MeshScale::of(&tested, Some(mesh)).apply(&tested.curve);
            assert!((curve.displacement_mm[1] - 0.44).abs() < 1e-12, "{curve:?}");
            assert!((curve.force_n[1] - 6.25 * 7.0).abs() < 1e-12, "{curve:?}");
        }
        let same = specimen(4.4, 2.5 * (1.0 + 1e-12), 1.0);
        assert_eq!(MeshScale::of(&same, Some(mesh)), MeshScale { displacement: 1.0, force: 1.0 });
        let block = MeshSize { is_cylinder: false, ..mesh };
        assert_eq!(MeshScale::of(&specimen(4.4, 2.4, 1.0), Some(block)).force, 1.0);
        let none = MeshScale::of(&specimen(1.0, 1.0, 1.0), None);
        assert_eq!(none, MeshScale { displacement: 1.0, force: 1.0 });
    }

    /// Readings of an extensometer, and displacements across the axis, do not change with the height of the specimen.
    /// Displacements of the end surface along the axis do.
    #[test]
    fn displacements_over_a_fixed_length_are_not_scaled() {
        let mesh = MeshSize::of_cylinder([4.4, 2.5]);
        let factor = |lines: &str| {
            let table = format!("remove_rigid_motions = true\n{lines}");
            let conditions: ConditionsCase = toml::from_str(&table).unwrap();
            let tested = specimen(8.8, 2.5, 1.0);
            MeshScale::of(&tested, Some(mesh.measured_by(Some(&conditions)))).displacement
        };
        let axial = "measure = { surface = \"top\", direction = [0.0, 0.0, -1.0] }\n";
        assert_eq!(factor(axial), 0.5);
        let gauge = "extensometer = { from_mm = [2.0, 0.0, 1.2], to_mm = [2.0, 0.0, 3.2] }\n";
        assert_eq!(factor(&format!("{axial}{gauge}")), 1.0);
        assert_eq!(factor("measure = { surface = \"side\", direction = [1.0, 0.0, 0.0] }\n"), 1.0);
        assert_eq!(MeshScale::of(&specimen(8.8, 2.5, 1.0), Some(mesh)).displacement, 0.5);
        assert_eq!(mesh.measured_by(None), mesh);
    }

    #[test]
    fn a_lattice_of_a_cylinder_is_one_and_a_block_is_not() {
        for spacing_mm in [0.7, 1.5] {
            let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm };
            let mut mesh = lattice.build().unwrap();
            let size = MeshSize::of(&mesh);
            assert!((size.radius_mm - 2.5).abs() < 1e-9 && size.is_cylinder, "{size:?}");
            // flatten the cylinder
            mesh.nodes.iter_mut().for_each(|node| node[1] *= 0.5);
            assert!(!MeshSize::of(&mesh).is_cylinder);
        }
    }
}
