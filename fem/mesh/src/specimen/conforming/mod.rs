//! Meshes that follow the grains: label the tetrahedra of a lattice, then move its nodes.
//!
//! The connectivity of the lattice never changes, and after the labels are given they do not change
//! either. Nodes of interfaces move onto the zero of the signed distances, each step only as far as
//! every tetrahedron around keeps its smallest dihedral angle; so nothing can invert.

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

/// Sweeps over all nodes that move before volumes are corrected; every second corrects them then.
const FIRST_SWEEPS: usize = 8;
/// Corrections of the volumes, each with two sweeps.
const CORRECTIONS: usize = 8;
/// The correction from which on flatter tetrahedra are allowed.
const LATE: usize = 3;
/// The first sweeps keep this angle at least (degrees).
const GENTLE_DEG: f64 = 24.0;
/// The last sweeps keep this angle, or the floor where it is larger (degrees).
const LATE_DEG: f64 = 20.2;
/// Late sweeps are followed by a pass that tries to bring tetrahedra above this angle (degrees).
const WANTED_DEG: f64 = 27.0;

/// What came of it, besides the nodes and edge points of the mesh.
pub(super) struct Conformed {
    /// Root mean square distance of the followed interface from the true one (mm).
    pub(super) interface_rms_mm: f64,
    /// Curved edges that were straightened because they would have folded a tetrahedron.
    pub(super) straightened_edges: usize,
}

impl Conforming<'_> {
    /// The grain of each tetrahedron of a lattice, or 0.
    pub(super) fn labels(&self, mesh: &TetMesh) -> Vec<u32> {
        let faces = mesh.neighbours();
        label::labels(self, mesh, &Adjacency::new(mesh, &faces))
    }

    /// Moves the nodes of a labelled lattice and gives it edge points.
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
                // within the loop, so that what it costs in volume is made up for
                if round >= LATE {
                    relocation.improve(cosine(WANTED_DEG));
                }
            }
        }
        let (edge_points, straightened_edges) = edges.place(&relocation);
        let interface_rms_mm = relocation.interface_error(&edge_points);
        let nodes = relocation.nodes;
        mesh.nodes = nodes;
        mesh.edge_points = edge_points;
        Conformed { interface_rms_mm, straightened_edges }
    }
}
