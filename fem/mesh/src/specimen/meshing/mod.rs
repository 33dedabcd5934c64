//! Meshing of specimens: cylinders with grains.
//!
//! In layers, lowest first:
//! 1. `adjacency`, `samples`, `mode`: neighbours of tetrahedra, sample points in tetrahedra, the choice of the
//!    representation
//! 2. `label`, `fraction`, `voids`: tetrahedra of grains, volume fractions, voids
//! 3. `conforming`: nodes on the surfaces of grains
//! 4. `report`: accuracy of the mesh

mod adjacency;
mod conforming;
mod fraction;
mod label;
mod mode;
mod report;
mod samples;
mod voids;

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::error::MeshError;
use crate::mesh::{CylinderLattice, LatticeError, Quality, TetMesh, Wall};
use crate::specimen::grains::{GrainField, Phases};
use conforming::Conforming;
use fraction::mix;
use voids::carve;

pub use label::{FractionTarget, GrainVolume, LabelReport, Labelling, label};
pub use mode::GrainMode;
pub use report::{MeshReport, MeshedGrain, MeshedPhase};

/// Settings for meshing a cylinder with grains.
///
/// The lattice of [`CylinderLattice`] is labelled, and its nodes are moved onto the interfaces of the grains that are
/// meshed conformingly. The contacts and the volumes of these grains are preserved. Grains that are too small for a
/// conforming mesh are represented by the volume fraction of grain in each tetrahedron.
///
/// Grains of the phase [`VOID`](fem_image::VOID) are meshed conformingly in every mode except [`GrainMode::Whole`]. The
/// tetrahedra of voids are removed from the mesh, together with parts that no face connects with the body. A void that
/// is too small to have a tetrahedron counts as matrix.
///
/// # Example
/// ```
/// use fem_mesh::{Grain, GrainList, Meshing};
///
/// let grains = GrainList::new(vec![Grain::sphere([0.0, 0.0, 2.2], 1.2)], 2.5, 4.4);
/// let meshed = Meshing::new(0.4).build(2.5, 4.4, &grains)?;
/// assert!(meshed.report.warnings().is_empty(), "{:?}", meshed.report.warnings());
/// assert!(meshed.report.grains[0].volume_error().abs() < 0.005);
/// meshed.mesh.validate()?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Meshing {
    /// Edge length of the lattice's hexahedra (mm); each hexahedron is split into twelve tetrahedra.
    pub spacing_mm: f64,
    /// Representation of grains in the mesh.
    #[serde(default)]
    pub mode: GrainMode,
    /// [`GrainMode::Auto`] meshes a grain conformingly if the diameter of the grain is at least this multiple of the
    /// spacing.
    #[serde(default = "default_elements_across")]
    pub elements_across: f64,
    /// Smallest dihedral angle that the movement of nodes may cause (degrees), from 1 to 25.
    #[serde(default = "default_min_dihedral")]
    pub min_dihedral_deg: f64,
    /// Whether edges on interfaces and on a round wall are curved, for quadratic elements. If `true`, the grain volumes
    /// are exact in the mesh with curved edges, otherwise in the mesh with straight edges.
    #[serde(default = "default_curved")]
    pub curved: bool,
    /// Position of the wall. Edges on the wall of [`Wall::Round`] are curved if `curved` is `true`; edges on the wall
    /// of [`Wall::Curved`] are always curved. The prisms [`Wall::Inscribed`] and [`Wall::EqualArea`] have straight
    /// walls. [`Wall::EqualArea`] has the volume and the end areas of the cylinder and is suitable for linear elements.
    #[serde(default = "default_wall")]
    pub wall: Wall,
}

fn default_elements_across() -> f64 {
    3.0
}

fn default_min_dihedral() -> f64 {
    12.0
}

fn default_curved() -> bool {
    true
}

fn default_wall() -> Wall {
    Wall::Round
}

/// A mesh and the report on its accuracy.
#[derive(Clone, Debug)]
pub struct Meshed {
    /// The mesh: regions `matrix` and the phases of the grains, surfaces `bottom`, `top` and `side`.
    pub mesh: TetMesh,
    /// Report on the accuracy of the mesh.
    pub report: MeshReport,
}

/// Error of a specimen that cannot be meshed.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshingError {
    /// A setting is out of range.
    #[error("{field} = {value}; give {requirement}")]
    Field {
        /// Name of the setting.
        field: &'static str,
        /// Value of the setting.
        value: f64,
        /// Allowed values.
        requirement: &'static str,
    },
    /// The cylinder cannot be meshed with this spacing.
    #[error(transparent)]
    Lattice(#[from] LatticeError),
    /// Voids separate the specimen into parts.
    #[error(
        "the voids divide the specimen: no connected body reaches its bottom, its top and its side; label fewer voxels as \
         \"void\", or cut a part without such voids out of the image (radius_mm, height_mm)"
    )]
    Parted,
    /// The generated mesh is not valid.
    #[error("the generated mesh is not valid: {0}")]
    Unsound(#[from] MeshError),
}

impl Meshing {
    /// Creates settings for a spacing (mm), with the mode [`GrainMode::Auto`], curved edges, and default values of all
    /// other settings.
    pub fn new(spacing_mm: f64) -> Meshing {
        Meshing {
            spacing_mm,
            mode: GrainMode::Auto,
            elements_across: default_elements_across(),
            min_dihedral_deg: default_min_dihedral(),
            curved: default_curved(),
            wall: default_wall(),
        }
    }

    /// Checks the settings.
    ///
    /// # Errors
    /// [`MeshingError::Field`] for the first setting out of range.
    pub fn validate(&self) -> Result<(), MeshingError> {
        let rules = [
            ("spacing_mm", self.spacing_mm, self.spacing_mm > 0.0, "a length above 0 (mm)"),
            (
                "elements_across",
                self.elements_across,
                (0.0..=100.0).contains(&self.elements_across),
                "a number from 0 to 100",
            ),
            (
                "min_dihedral_deg",
                self.min_dihedral_deg,
                (1.0..=25.0).contains(&self.min_dihedral_deg),
                "an angle from 1 to 25 degrees",
            ),
        ];
        match rules.into_iter().find(|&(_, value, holds, _)| !(holds && value.is_finite())) {
            Some((field, value, _, requirement)) => {
                Err(MeshingError::Field { field, value, requirement })
            }
            None => Ok(()),
        }
    }

    /// Meshes a cylinder (mm) with its bottom at z = 0 and its axis on z.
    ///
    /// # Errors
    /// [`MeshingError`] if a setting is out of range, the spacing does not suit the cylinder, voids separate the
    /// specimen, or the generated mesh is not valid.
    pub fn build(
        &self,
        radius_mm: f64,
        height_mm: f64,
        grains: &dyn GrainField,
    ) -> Result<Meshed, MeshingError> {
        self.validate()?;
        let lattice = CylinderLattice { radius_mm, height_mm, spacing_mm: self.spacing_mm };
        let nodes = if self.wall == Wall::Curved { Wall::Round } else { self.wall };
        let mut mesh = lattice.build_with(nodes)?;
        let phases = Phases::of(grains);
        let grain_numbers = || 1..=grains.grains() as u32;
        let mut modes: Vec<GrainMode> =
            grain_numbers().map(|grain| self.mode_of(grains, &phases, grain)).collect();
        let is = |modes: &[GrainMode], mode| modes.iter().map(|&m| m == mode).collect::<Vec<_>>();

        let follows = is(&modes, GrainMode::Conforming);
        let conforming = Conforming {
            field: grains,
            follows: &follows,
            wall: lattice.section(self.wall),
            spacing_mm: self.spacing_mm,
            floor_deg: self.min_dihedral_deg,
            curved: self.curved,
            curved_wall: match self.wall {
                Wall::Inscribed | Wall::EqualArea => false,
                Wall::Round => self.curved,
                Wall::Curved => true,
            },
        };
        let mut labels = conforming.labels(&mesh);
        if self.mode == GrainMode::Auto {
            // a grain that gets no tetrahedron is too small for a conforming mesh and is represented by volume
            // fractions
            let mut is_meshed = vec![false; modes.len()];
            labels.iter().filter(|&&l| l > 0).for_each(|&l| is_meshed[l as usize - 1] = true);
            let lost =
                grain_numbers().zip(&mut modes).zip(is_meshed).filter(|(_, is_meshed)| !is_meshed);
            lost.filter(|((grain, _), _)| !phases.is_void(*grain))
                .for_each(|((_, mode), _)| *mode = GrainMode::Fraction);
        }
        let conformed = conforming.apply(&mut mesh, &labels);
        if self.mode == GrainMode::Whole {
            Labelling { separate: false, ..Labelling::default() }.apply_field(&mut mesh, grains);
            labels = mesh.grain_of.take().unwrap_or_default();
        }
        let volumes = mesh.volumes();
        let mut achieved = vec![0.0; modes.len()];
        for (&label, volume) in labels.iter().zip(&volumes).filter(|(label, _)| **label > 0) {
            achieved[label as usize - 1] += volume;
        }
        let mixes = is(&modes, GrainMode::Fraction);
        let (mut mixed_tets, mut multiphase_tets) = (0, 0);
        mesh.mixture = None;
        if mixes.contains(&true) {
            let mixed = mix(&mesh, grains, &phases, &mixes, &mut labels);
            achieved.iter_mut().zip(&mixed.volumes_mm3).for_each(|(sum, more)| *sum += more);
            mixed_tets = mixed.mixture.iter().filter(|mixture| mixture.fraction > 0.0).count();
            multiphase_tets = mixed.multiphase_tets;
            mesh.mixture = Some(mixed.mixture);
        }
        let is_void: Vec<bool> =
            labels.iter().map(|&label| label > 0 && phases.is_void(label)).collect();
        let (mut void_tets, mut loose_tets) = (0, 0);
        if is_void.contains(&true) {
            let carved = carve(&mut mesh, &is_void).ok_or(MeshingError::Parted)?;
            (void_tets, loose_tets) = (carved.void_tets, carved.loose_tets);
            let loose = (0..labels.len()).filter(|&tet| !carved.stays[tet] && !is_void[tet]);
            for tet in loose.filter(|&tet| labels[tet] > 0) {
                achieved[labels[tet] as usize - 1] -= volumes[tet];
            }
            labels =
                labels.iter().zip(&carved.stays).filter(|(_, s)| **s).map(|(&l, _)| l).collect();
        }
        let regions = phases.regions(&labels, mesh.mixture.is_some());
        mesh.region_of = labels.iter().map(|&label| phases.region_of(label, &regions)).collect();
        for mixture in mesh.mixture.iter_mut().flatten().filter(|mixture| mixture.fraction > 0.0) {
            mixture.region = regions.of_phase[usize::from(mixture.region)];
        }
        mesh.regions = regions.names;
        mesh.grain_of = Some(labels);
        mesh.validate()?;

        let cylinder = PI * radius_mm * radius_mm * height_mm;
        let total: f64 = volumes.iter().sum();
        let of_grain = |(grain, mode): (u32, &GrainMode)| MeshedGrain {
            asked_mm3: grains.volume_mm3(grain),
            achieved_mm3: achieved[grain as usize - 1],
            elements_across: self.across(grains, grain),
            mode: *mode,
            phase: phases.of_grain(grain),
        };
        let of_grains: Vec<MeshedGrain> = grain_numbers().zip(&modes).map(of_grain).collect();
        let of_phases = MeshedPhase::sums(phases.names, &of_grains);
        let solid = || of_phases.iter().filter(|phase| !phase.is_void());
        let report = MeshReport {
            quality: Quality::of(&mesh),
            euler_characteristic: mesh.euler_characteristic(),
            asked_fraction: solid().map(|phase| phase.asked_mm3).sum::<f64>() / cylinder,
            achieved_fraction: solid().map(|phase| phase.achieved_mm3).sum::<f64>() / total,
            volume_error: total / cylinder - 1.0,
            grains: of_grains,
            phases: of_phases,
            interface_rms_mm: conformed.interface_rms_mm,
            wall_error_mm: MeshReport::wall_error(&mesh, radius_mm),
            straightened_edges: conformed.straightened_edges,
            mixed_tets,
            multiphase_tets,
            void_tets,
            loose_tets,
        };
        Ok(Meshed { mesh, report })
    }

    /// Whether a mesh of these grains represents some grains by volume fractions of its tetrahedra. With
    /// [`GrainMode::Auto`], a grain that no tetrahedron represents becomes a volume fraction, too; only the mesher finds
    /// such grains.
    pub fn mixes(&self, grains: &dyn GrainField) -> bool {
        let phases = Phases::of(grains);
        (1..=grains.grains() as u32)
            .any(|grain| self.mode_of(grains, &phases, grain) == GrainMode::Fraction)
    }

    /// Returns the representation of one grain in the mesh. Voids are meshed conformingly wherever possible, because
    /// the surface of a void is part of the surface of the body.
    fn mode_of(&self, grains: &dyn GrainField, phases: &Phases, grain: u32) -> GrainMode {
        match self.mode {
            GrainMode::Auto | GrainMode::Fraction if phases.is_void(grain) => GrainMode::Conforming,
            GrainMode::Auto if self.across(grains, grain) > self.elements_across => {
                GrainMode::Conforming
            }
            GrainMode::Auto => GrainMode::Fraction,
            mode => mode,
        }
    }

    /// Returns the diameter of the sphere with the volume of the grain, divided by the spacing.
    fn across(&self, grains: &dyn GrainField, grain: u32) -> f64 {
        (6.0 / PI * grains.volume_mm3(grain)).cbrt() / self.spacing_mm
    }
}
