//! What a mesh of a specimen achieved.

use std::fmt;

use super::GrainMode;
use crate::mesh::{Quality, TetMesh};
use fem_image::VOID;

/// Larger relative errors in the volume of the grains or of the mesh are told.
const LARGEST_ERROR: f64 = 0.005;
/// The same of the volume of voids, of which the smallest are never resolved.
const LARGEST_VOID_ERROR: f64 = 0.05;

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
    /// Grain by grain, from number 1; voids are grains of the phase `void`.
    pub grains: Vec<MeshedGrain>,
    /// Phase by phase.
    pub phases: Vec<MeshedPhase>,
    /// Root mean square distance of followed interfaces from the true ones (mm); 0 without any.
    pub interface_rms_mm: f64,
    /// Largest distance of a node of the wall from the cylinder (mm).
    pub wall_error_mm: f64,
    /// Edges that stayed straight because a curved one would have folded a tetrahedron.
    pub straightened_edges: usize,
    /// Tetrahedra of matrix and another phase mixed.
    pub mixed_tets: usize,
    /// Tetrahedra in which several phases lie beside the matrix; each has the largest of these phases alone.
    pub multiphase_tets: usize,
    /// Tetrahedra that lay in voids and were taken out.
    pub void_tets: usize,
    /// Tetrahedra outside voids that were taken out because no face connects them with the body.
    pub loose_tets: usize,
}

/// A phase of grains in a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshedPhase {
    /// Its name, that of a region.
    pub name: String,
    /// How many grains it has.
    pub grains: usize,
    /// Volume of its grains (mm³).
    pub asked_mm3: f64,
    /// Their volume in the mesh (mm³), mixtures included; of voids the volume that was taken out.
    pub achieved_mm3: f64,
}

impl MeshedPhase {
    /// Whether its grains are voids.
    pub fn is_void(&self) -> bool {
        self.name == VOID
    }

    /// The phases with what their grains have.
    pub(super) fn sums(names: Vec<String>, grains: &[MeshedGrain]) -> Vec<MeshedPhase> {
        let empty = |name| MeshedPhase { name, grains: 0, asked_mm3: 0.0, achieved_mm3: 0.0 };
        let mut phases: Vec<MeshedPhase> = names.into_iter().map(empty).collect();
        for grain in grains {
            let phase = &mut phases[grain.phase];
            phase.grains += 1;
            phase.asked_mm3 += grain.asked_mm3;
            phase.achieved_mm3 += grain.achieved_mm3;
        }
        phases
    }
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
    /// Its phase, an index into [`MeshReport::phases`].
    pub phase: usize,
}

impl MeshedGrain {
    /// Relative error of its volume.
    pub fn volume_error(&self) -> f64 {
        self.achieved_mm3 / self.asked_mm3 - 1.0
    }
}

impl MeshReport {
    /// Grains of which nothing is in the mesh, without voids.
    pub fn lost_grains(&self) -> usize {
        self.solid_grains()
            .filter(|grain| grain.asked_mm3 > 0.0 && grain.achieved_mm3 == 0.0)
            .count()
    }

    /// The grains that are no voids.
    pub fn solid_grains(&self) -> impl Iterator<Item = &MeshedGrain> {
        self.grains.iter().filter(|grain| !self.phases[grain.phase].is_void())
    }

    /// How many grains, without voids, are meshed in this mode.
    pub fn grains_in(&self, mode: GrainMode) -> usize {
        self.solid_grains().filter(|grain| grain.mode == mode).count()
    }

    /// Volume of voids (mm³) that counts as matrix because the mesh does not resolve it.
    pub fn unresolved_voids_mm3(&self) -> f64 {
        let voids = self.phases.iter().filter(|phase| phase.is_void());
        voids.map(|phase| phase.asked_mm3 - phase.achieved_mm3).sum()
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
        if self.euler_characteristic != 1 && self.void_tets == 0 {
            let euler = self.euler_characteristic;
            warnings
                .push(format!("the Euler characteristic is {euler}, not 1: the body has holes"));
        }
        // in mm³: of a mesh that lacks some of the cylinder the same grains are a larger part
        for phase in self.phases.iter().filter(|phase| !phase.is_void()) {
            let (asked, achieved) = (phase.asked_mm3, phase.achieved_mm3);
            if (achieved - asked).abs() > LARGEST_ERROR * asked {
                let name = match self.phases.len() {
                    1 => String::new(),
                    _ => format!(" of the phase {}", phase.name),
                };
                warnings.push(format!(
                    "the grains{name} take {achieved:.4} mm³ of the mesh, {asked:.4} were asked; a finer \
                     spacing_mm, or mode auto with more elements_across, keeps their volume"
                ));
            }
        }
        warnings.extend(self.of_several_phases());
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
                self.solid_grains().count()
            ));
        }
        warnings
    }

    /// What a user should know of phases that meet and of voids.
    fn of_several_phases(&self) -> impl Iterator<Item = String> {
        let tets = self.quality.tets;
        let multiphase = (self.multiphase_tets > 0).then(|| {
            format!(
                "moduli where phases of grains meet are approximate: in {} of {tets} tetrahedra several phases lie beside \
                 the matrix, and each of these tetrahedra is a mixture of the matrix and the largest other phase; a finer \
                 spacing_mm, or grain_mode = \"conforming\", makes them fewer",
                self.multiphase_tets
            )
        });
        let loose = (self.loose_tets > 0).then(|| {
            format!(
                "{} tetrahedra are left out beside the voids: no face connects them with the body, as grains that lie \
                 loose in a void",
                self.loose_tets
            )
        });
        let unresolved = self.unresolved_voids_mm3();
        let voids: f64 =
            self.phases.iter().filter(|p| p.is_void()).map(|phase| phase.asked_mm3).sum();
        let unresolved = (unresolved.abs() > LARGEST_VOID_ERROR * voids).then(|| {
            format!(
                "{:.4} mm³ of {voids:.4} mm³ of voids are too small for the mesh and count as matrix, whose constants \
                 then include them; a finer spacing_mm resolves more",
                unresolved
            )
        });
        multiphase.into_iter().chain(loose).chain(unresolved)
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
            self.solid_grains().count(),
            self.grains_in(GrainMode::Conforming),
            self.grains_in(GrainMode::Fraction),
            self.grains_in(GrainMode::Whole),
            self.achieved_fraction,
            self.asked_fraction,
            self.interface_rms_mm
        )
    }
}
