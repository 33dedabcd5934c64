//! Report on the mesh of a specimen: quality, volumes, errors and warnings.

use std::fmt;

use super::mode::GrainMode;
use crate::mesh::{Quality, TetMesh};
use fem_image::VOID;

/// The report warns if the relative error of the volume of the grains or of the mesh exceeds this value.
const LARGEST_ERROR: f64 = 0.005;
/// The report warns if the relative error of the volume of voids exceeds this value. The limit is large because the
/// smallest voids are never resolved.
const LARGEST_VOID_ERROR: f64 = 0.05;

/// Accuracy of the mesh of a specimen.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshReport {
    /// Quality of the tetrahedra, computed with straight edges.
    pub quality: Quality,
    /// Euler characteristic of the mesh, vertices − edges + faces − tetrahedra; 1 for a body without holes.
    pub euler_characteristic: i64,
    /// Exact volume fraction of the grains, according to the [`GrainField`](crate::GrainField).
    pub asked_fraction: f64,
    /// Volume fraction of the grains in the mesh; an element that is partly grain counts with its grain fraction.
    pub achieved_fraction: f64,
    /// Relative error of the volume of the mesh with respect to the cylinder, before voids are removed. Straight edges
    /// at the wall make the volume too small.
    pub volume_error: f64,
    /// Results for each grain; the first entry belongs to grain number 1. Voids are grains of the phase `void`.
    pub grains: Vec<MeshedGrain>,
    /// Results per phase.
    pub phases: Vec<MeshedPhase>,
    /// Root mean square distance of conforming interfaces from the exact interfaces (mm); 0 without interfaces.
    pub interface_rms_mm: f64,
    /// Largest distance of a wall node from the cylinder (mm). The distance is not zero if the mesh is a prism.
    pub wall_error_mm: f64,
    /// Number of edges that stayed straight because a curved edge would have folded a tetrahedron.
    pub straightened_edges: usize,
    /// Number of tetrahedra that are mixtures of matrix and another phase.
    pub mixed_tets: usize,
    /// Number of tetrahedra that contain several phases besides the matrix; each of these
    /// tetrahedra stores only its largest phase.
    pub multiphase_tets: usize,
    /// Number of tetrahedra that were removed because they lie in voids.
    pub void_tets: usize,
    /// Number of tetrahedra outside voids that were removed because no face connects them with the body.
    pub loose_tets: usize,
}

/// A phase of grains in a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshedPhase {
    /// Name of the phase, also the name of its region.
    pub name: String,
    /// Number of grains of the phase.
    pub grains: usize,
    /// Exact total volume of the phase's grains (mm³).
    pub asked_mm3: f64,
    /// Volume of the phase's grains in the mesh (mm³), mixtures included. For voids, this is the removed volume.
    pub achieved_mm3: f64,
}

impl MeshedPhase {
    /// Returns whether the grains of the phase are voids.
    pub fn is_void(&self) -> bool {
        self.name == VOID
    }

    /// Returns the number and the total volumes of the grains of each phase.
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
    /// Exact volume of the grain (mm³).
    pub asked_mm3: f64,
    /// Volume of the grain in the mesh (mm³), mixtures included.
    pub achieved_mm3: f64,
    /// Diameter of the sphere with the volume of the grain, divided by the spacing.
    pub elements_across: f64,
    /// Representation of the grain in the mesh; never [`GrainMode::Auto`].
    pub mode: GrainMode,
    /// Phase of the grain, an index into [`MeshReport::phases`].
    pub phase: usize,
}

impl MeshedGrain {
    /// Returns the relative error of the grain's volume in the mesh.
    pub fn volume_error(&self) -> f64 {
        self.achieved_mm3 / self.asked_mm3 - 1.0
    }
}

impl MeshReport {
    /// Returns the number of grains (without voids) that have no volume in the mesh.
    pub fn lost_grains(&self) -> usize {
        self.solid_grains()
            .filter(|grain| grain.asked_mm3 > 0.0 && grain.achieved_mm3 == 0.0)
            .count()
    }

    /// Iterates over the grains that are not voids.
    pub fn solid_grains(&self) -> impl Iterator<Item = &MeshedGrain> {
        self.grains.iter().filter(|grain| !self.phases[grain.phase].is_void())
    }

    /// Returns the number of grains (without voids) that are meshed in this mode.
    pub fn grains_in(&self, mode: GrainMode) -> usize {
        self.solid_grains().filter(|grain| grain.mode == mode).count()
    }

    /// Returns the volume of voids (mm³) that counts as matrix because the mesh does not resolve it.
    pub fn unresolved_voids_mm3(&self) -> f64 {
        let voids = self.phases.iter().filter(|phase| phase.is_void());
        voids.map(|phase| phase.asked_mm3 - phase.achieved_mm3).sum()
    }

    /// Returns the median of the absolute relative errors of grain volumes, over the grains whose diameter exceeds
    /// `elements_across` times the spacing; `None` if there are no such grains.
    pub fn median_volume_error(&self, elements_across: f64) -> Option<f64> {
        let resolved = self.grains.iter().filter(|grain| grain.elements_across > elements_across);
        let mut errors: Vec<f64> = resolved.map(|grain| grain.volume_error().abs()).collect();
        errors.sort_by(f64::total_cmp);
        errors.get(errors.len() / 2).copied()
    }

    /// Returns warnings about the mesh, possibly none.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        let Quality { min_dihedral_deg, p01_dihedral_deg, .. } = self.quality;
        if min_dihedral_deg < 12.0 - 1e-6 {
            warnings.push(format!(
                "stresses in flat tetrahedra are inaccurate: the smallest dihedral angle is {min_dihedral_deg:.1}°, below 12°; \
                 a finer spacing_mm resolves the films between grains better"
            ));
        }
        if p01_dihedral_deg < 20.0 {
            warnings.push(format!(
                "stresses in flat tetrahedra are inaccurate: 1 % of the tetrahedra have a dihedral angle below \
                 {p01_dihedral_deg:.1}° (usual: 20°); a finer spacing_mm resolves the films between grains better"
            ));
        }
        if self.euler_characteristic != 1 && self.void_tets == 0 {
            let euler = self.euler_characteristic;
            warnings
                .push(format!("the Euler characteristic is {euler}, not 1: the body has holes"));
        }
        // compare volumes instead of fractions: if the mesh lacks a part of the cylinder, grains with correct volumes
        // have a larger fraction
        for phase in self.phases.iter().filter(|phase| !phase.is_void()) {
            let (asked, achieved) = (phase.asked_mm3, phase.achieved_mm3);
            if (achieved - asked).abs() > LARGEST_ERROR * asked {
                let name = match self.phases.len() {
                    1 => String::new(),
                    _ => format!(" of the phase {}", phase.name),
                };
                warnings.push(format!(
                    "the grains{name} have a volume of {achieved:.4} mm³ in the mesh instead of {asked:.4} mm³; a finer \
                     spacing_mm, or mode auto with a larger elements_across, preserves their volume"
                ));
            }
        }
        warnings.extend(self.of_several_phases());
        if self.volume_error.abs() > LARGEST_ERROR {
            warnings.push(format!(
                "the volume of the mesh differs by {:+.1} % from the volume of the cylinder, and forces differ by about as \
                 much; curved edges (order 2) or a finer spacing_mm represent the wall better",
                100.0 * self.volume_error
            ));
        }
        let lost = self.lost_grains();
        if lost > 0 {
            warnings.push(format!(
                "{lost} of {} grains are too small for the mesh and were omitted; mode auto represents them as volume \
                 fractions",
                self.solid_grains().count()
            ));
        }
        warnings
    }

    /// Returns warnings about tetrahedra with several phases, loose parts and unresolved voids.
    fn of_several_phases(&self) -> impl Iterator<Item = String> {
        let tets = self.quality.tets;
        let multiphase = (self.multiphase_tets > 0).then(|| {
            format!(
                "moduli where phases of grains meet are approximate: {} of {tets} tetrahedra contain several phases besides \
                 the matrix, and each of these tetrahedra is a mixture of the matrix and its largest other phase; a finer \
                 spacing_mm, or grain_mode = \"conforming\", reduces the number of these tetrahedra",
                self.multiphase_tets
            )
        });
        let loose = (self.loose_tets > 0).then(|| {
            format!(
                "{} tetrahedra next to voids were removed: no face connects them with the body (for example a grain that \
                 lies loose in a void)",
                self.loose_tets
            )
        });
        let unresolved = self.unresolved_voids_mm3();
        let voids: f64 =
            self.phases.iter().filter(|p| p.is_void()).map(|phase| phase.asked_mm3).sum();
        let unresolved = (unresolved.abs() > LARGEST_VOID_ERROR * voids).then(|| {
            format!(
                "calibrated constants of the matrix include voids: voids of {:.4} mm³ (of {voids:.4} mm³ in total) are too \
                 small for the mesh and count as matrix; a finer spacing_mm resolves more voids",
                unresolved
            )
        });
        multiphase.into_iter().chain(loose).chain(unresolved)
    }

    /// Returns the maximum distance of a wall node from the cylinder's surface (mm).
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
            "{}, first percentile {:.1}°; {} grains ({} conforming, {} as fractions, {} whole), volume \
             fraction {:.4} (exact {:.4}), interface error {:.4} mm",
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
