//! Conforming meshes of grains: the tetrahedra of a lattice are labelled, then the nodes are moved onto interfaces.
//!
//! The connectivity of the lattice never changes, and the labels do not change after the labelling. Nodes of interfaces
//! move onto the surfaces of the grains, the zero sets of the signed distances. Each step is limited so that every
//! adjacent tetrahedron keeps a minimum dihedral angle; therefore no tetrahedron can be inverted.

mod contact;
mod curve;
mod guard;
mod improve;
mod interface;
mod label;
mod relocate;
mod settings;
mod volume;

use super::adjacency::Adjacency;
use crate::mesh::TetMesh;
use curve::EdgePoints;
use guard::cosine;
use interface::Interface;
use relocate::Relocation;
pub(super) use settings::Conforming;

/// Number of sweeps, which move every movable node once, before the first correction of the grain volumes.
const FIRST_SWEEPS: usize = 8;
/// Number of corrections of the grain volumes; two sweeps follow each correction.
const CORRECTIONS: usize = 8;
/// The corrections of the grain volumes from this index on are *late* corrections. After late corrections, flatter
/// tetrahedra are allowed, and the nodes of flat tetrahedra are moved to better positions.
const LATE: usize = 3;
/// Smallest dihedral angle that the sweeps before the first late correction allow (degrees).
const GENTLE_DEG: f64 = 24.0;
/// Smallest dihedral angle that the sweeps after late corrections allow (degrees), unless the user requires a larger
/// angle.
const LATE_DEG: f64 = 20.2;
/// After late corrections, the nodes of tetrahedra whose smallest dihedral angle is below this value (degrees) are
/// moved to better positions.
const WANTED_DEG: f64 = 27.0;

/// Accuracy of a conforming mesh.
pub(super) struct Conformed {
    /// Root mean square distance of the meshed interfaces from the exact interfaces (mm).
    pub(super) interface_rms_mm: f64,
    /// Number of curved edges that were straightened because they would have folded a tetrahedron.
    pub(super) straightened_edges: usize,
}

impl Conforming<'_> {
    /// Returns the label of each tetrahedron of a lattice: its grain number, or 0 for matrix.
    pub(super) fn labels(&self, mesh: &TetMesh) -> Vec<u32> {
        let faces = mesh.neighbours();
        label::labels(self, mesh, &Adjacency::new(mesh, &faces))
    }

    /// Moves the nodes of a labelled lattice onto the interfaces, and computes the mid-edge points.
    pub(super) fn apply(&self, mesh: &mut TetMesh, labels: &[u32]) -> Conformed {
        let faces = mesh.neighbours();
        let around = Adjacency::new(mesh, &faces);
        let interface = Interface::new(self, mesh, &around, &faces, labels);
        let edges = EdgePoints::new(self, mesh, &interface);
        let mut relocation = Relocation::new(self, mesh, &around, &interface);
        if !interface.triangles.is_empty() {
            let floor = cosine(self.floor_deg.max(LATE_DEG));
            let gentle = cosine(self.floor_deg.max(GENTLE_DEG));
            for _ in 0..FIRST_SWEEPS {
                relocation.sweep(gentle);
            }
            for round in 0..CORRECTIONS {
                let volumes = edges.volumes(&relocation, labels);
                relocation.correct(&volumes);
                let limit = if round < LATE { gentle } else { floor };
                relocation.sweep(limit);
                relocation.sweep(limit);
                // the improvement is part of the loop, so that the next correction removes the error of the volumes
                // that it causes
                if round >= LATE {
                    relocation.improve(cosine(WANTED_DEG));
                }
            }
        }
        let (edge_points, straightened_edges) = edges.edge_points(&relocation);
        let interface_rms_mm = relocation.interface_error(&edge_points);
        let nodes = relocation.nodes;
        mesh.nodes = nodes;
        mesh.edge_points = edge_points;
        Conformed { interface_rms_mm, straightened_edges }
    }
}
