//! How well shaped the tetrahedra are.

use std::fmt;

use rayon::prelude::*;

use super::TetMesh;
use super::tet_mesh::FACES;
use super::vector::{Point, cross, dot, norm, sub};

/// Shape figures of a mesh: dihedral angles, volumes, edge length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Number of nodes.
    pub nodes: usize,
    /// Number of tetrahedra.
    pub tets: usize,
    /// Smallest dihedral angle of the mesh (degrees).
    pub min_dihedral_deg: f64,
    /// First percentile of the tetrahedra's smallest dihedral angles (degrees).
    pub p01_dihedral_deg: f64,
    /// Largest dihedral angle of the mesh (degrees).
    pub max_dihedral_deg: f64,
    /// Smallest volume of a tetrahedron (mm³), negative if one is inverted.
    pub min_volume_mm3: f64,
    /// Mean edge length (mm).
    pub mean_edge_mm: f64,
}

impl Quality {
    /// Measures a mesh.
    ///
    /// # Example
    /// ```
    /// use fem_mesh::{CylinderLattice, Quality};
    ///
    /// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.7 }.build()?;
    /// assert!(Quality::of(&mesh).min_dihedral_deg > 30.0);
    /// # Ok::<(), fem_mesh::LatticeError>(())
    /// ```
    pub fn of(mesh: &TetMesh) -> Quality {
        let tets = mesh.tets.len();
        let mut smallest = Quality::smallest_dihedrals_deg(mesh);
        let max_dihedral =
            (0..tets).map(|tet| dihedrals(mesh.corners(tet)).1).fold(0.0_f64, f64::max);
        let min_volume = mesh.volumes().into_iter().fold(f64::INFINITY, f64::min);
        smallest.sort_by(f64::total_cmp);
        let at = |k: usize| smallest.get(k).copied().unwrap_or(f64::NAN);
        Quality {
            nodes: mesh.nodes.len(),
            tets,
            min_dihedral_deg: at(0),
            p01_dihedral_deg: at(tets / 100),
            max_dihedral_deg: max_dihedral.to_degrees(),
            min_volume_mm3: min_volume,
            mean_edge_mm: mesh.mean_edge(),
        }
    }

    /// The smallest dihedral angle of each tetrahedron (degrees).
    pub fn smallest_dihedrals_deg(mesh: &TetMesh) -> Vec<f64> {
        let smallest = |tet| dihedrals(mesh.corners(tet)).0.to_degrees();
        (0..mesh.tets.len()).into_par_iter().map(smallest).collect()
    }
}

impl fmt::Display for Quality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} tetrahedra, {} nodes, mean edge {:.3} mm, dihedral angles {:.1}° to {:.1}°",
            self.tets, self.nodes, self.mean_edge_mm, self.min_dihedral_deg, self.max_dihedral_deg
        )
    }
}

/// Smallest and largest of the six angles between the faces (radians).
fn dihedrals(p: [Point; 4]) -> (f64, f64) {
    let normals = FACES.map(|[a, b, c]| cross(sub(p[b], p[a]), sub(p[c], p[a])));
    let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
    for i in 0..4 {
        for j in 0..i {
            let (m, n) = (normals[i], normals[j]);
            // atan2 keeps digits where the arc cosine of nearly ±1 would lose them
            let angle = norm(cross(m, n)).atan2(-dot(m, n));
            low = low.min(angle);
            high = high.max(angle);
        }
    }
    (low, high)
}
