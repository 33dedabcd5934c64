//! What a mesh of a specimen achieved.

use std::fmt;

use super::GrainMode;
use crate::mesh::{Quality, TetMesh};

/// Larger relative errors in the volume of the grains or of the mesh are told.
const LARGEST_ERROR: f64 = 0.005;

/// How well a mesh follows its specimen.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshReport {
    /// Shape of the tetrahedra (of their straight edges).
    pub quality: Quality,
    /// Vertices − edges + faces − tetrahedra; 1 for a body without holes.
    pub euler_characteristic: i64,
    /// Volume fraction of the grains that the field has.
    pub asked_fraction: f64,
    /// Volume fraction of the grains in the mesh, mixtures included.
    pub achieved_fraction: f64,
    /// Volume of the mesh over that of the cylinder, less 1: what straight edges leave out at the wall.
    pub volume_error: f64,
    /// Grain by grain, from number 1.
    pub grains: Vec<MeshedGrain>,
    /// Root mean square distance of followed interfaces from the true ones (mm); 0 without any.
    pub interface_rms_mm: f64,
    /// Largest distance of a node of the wall from the cylinder (mm).
    pub wall_error_mm: f64,
    /// Edges that stayed straight because a curved one would have folded a tetrahedron.
    pub straightened_edges: usize,
    /// Tetrahedra of matrix and grain mixed.
    pub mixed_tets: usize,
}

/// One grain in a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshedGrain {
    /// Its volume (mm³).
    pub asked_mm3: f64,
    /// Its volume in the mesh (mm³), mixtures included.
    pub achieved_mm3: f64,
    /// Diameter of the ball of its volume over the spacing.
    pub elements_across: f64,
    /// How it is in the mesh; never [`GrainMode::Auto`].
    pub mode: GrainMode,
}

impl MeshedGrain {
    /// Relative error of its volume.
    pub fn volume_error(&self) -> f64 {
        self.achieved_mm3 / self.asked_mm3 - 1.0
    }
}

impl MeshReport {
    /// Grains of which nothing is in the mesh.
    pub fn lost_grains(&self) -> usize {
        self.grains
            .iter()
            .filter(|grain| grain.asked_mm3 > 0.0 && grain.achieved_mm3 == 0.0)
            .count()
    }

    /// How many grains are meshed in this mode.
    pub fn grains_in(&self, mode: GrainMode) -> usize {
        self.grains.iter().filter(|grain| grain.mode == mode).count()
    }

    /// Median of the absolute relative errors in volume of grains over so many elements across, or
    /// nothing if there are none.
    pub fn median_volume_error(&self, elements_across: f64) -> Option<f64> {
        let resolved = self.grains.iter().filter(|grain| grain.elements_across > elements_across);
        let mut errors: Vec<f64> = resolved.map(|grain| grain.volume_error().abs()).collect();
        errors.sort_by(f64::total_cmp);
        errors.get(errors.len() / 2).copied()
    }

    /// What a user should know before trusting the mesh, in words; nothing if all is well.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let Quality { min_dihedral_deg, p01_dihedral_deg, .. } = self.quality;
        if min_dihedral_deg < 12.0 - 1e-6 {
            warnings.push(format!("a dihedral angle of {min_dihedral_deg:.1}° is below 12°"));
        }
        if p01_dihedral_deg < 20.0 {
            warnings.push(format!(
                "one tetrahedron in a hundred has a dihedral angle below {p01_dihedral_deg:.1}° (20° \
                 is usual); a finer spacing_mm resolves the films between grains better"
            ));
        }
        if self.euler_characteristic != 1 {
            let euler = self.euler_characteristic;
            warnings
                .push(format!("the Euler characteristic is {euler}, not 1: the body has holes"));
        }
        // in mm³: of a mesh that lacks some of the cylinder the same grains are a larger part
        let sum = |volume: fn(&MeshedGrain) -> f64| self.grains.iter().map(volume).sum::<f64>();
        let (asked, achieved) = (sum(|grain| grain.asked_mm3), sum(|grain| grain.achieved_mm3));
        if (achieved - asked).abs() > LARGEST_ERROR * asked {
            warnings.push(format!(
                "the grains take {achieved:.4} mm³ of the mesh, {asked:.4} were asked; a finer \
                 spacing_mm, or mode auto with more elements_across, keeps their volume"
            ));
        }
        if self.volume_error.abs() > LARGEST_ERROR {
            warnings.push(format!(
                "the volume of the mesh is {:+.1} % off the cylinder's, and the force about as much; \
                 curved edges (order 2) or a finer spacing_mm follow the wall",
                100.0 * self.volume_error
            ));
        }
        let lost = self.lost_grains();
        if lost > 0 {
            warnings.push(format!(
                "{lost} of {} grains are too small for the mesh and lost; mode auto keeps them",
                self.grains.len()
            ));
        }
        warnings
    }

    /// Largest distance of a wall node from the radius (mm).
    pub(super) fn wall_error(mesh: &TetMesh, radius: f64) -> f64 {
        let nodes = mesh.surfaces.get("side").into_iter().flat_map(|side| side.as_flattened());
        let off = nodes.map(|&node| {
            let [x, y, _] = mesh.nodes[node as usize];
            (x.hypot(y) - radius).abs()
        });
        off.fold(0.0, f64::max)
    }
}

impl fmt::Display for MeshReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}, first percentile {:.1}°; {} grains ({} followed, {} mixed, {} whole), volume \
             fraction {:.4} (asked {:.4}), interface error {:.4} mm",
            self.quality,
            self.quality.p01_dihedral_deg,
            self.grains.len(),
            self.grains_in(GrainMode::Conforming),
            self.grains_in(GrainMode::Fraction),
            self.grains_in(GrainMode::Whole),
            self.achieved_fraction,
            self.asked_fraction,
            self.interface_rms_mm
        )
    }
}
