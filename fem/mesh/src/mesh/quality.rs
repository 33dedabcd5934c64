//! Shape quality of the tetrahedra.
//!
//! # Reference
//! C. J. Stimpson et al., "The Verdict library reference manual", Sandia National Laboratories (2007): the
//! scaled Jacobian of a tetrahedron.

use std::fmt;

use rayon::prelude::*;

use super::TetMesh;
use super::curved::Jacobian;
use super::topology::{EDGES, FACES};
use super::vector::{Point, cross, dot, norm, sub};

/// Quality measures of a mesh: dihedral angles, scaled Jacobians, volumes, edge length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quality {
    /// Number of nodes.
    pub nodes: usize,
    /// Number of tetrahedra.
    pub tets: usize,
    /// Smallest dihedral angle of the mesh (degrees).
    pub min_dihedral_deg: f64,
    /// First percentile, over the tetrahedra, of the smallest dihedral angle of a tetrahedron (degrees).
    pub p01_dihedral_deg: f64,
    /// Largest dihedral angle of the mesh (degrees).
    pub max_dihedral_deg: f64,
    /// Smallest scaled Jacobian of all tetrahedra. The scaled Jacobian of a tetrahedron is √2 times its smallest
    /// Jacobian determinant (curved edges included), divided by the largest product of the lengths of the three edges
    /// (chords) that meet at a corner. The scaled Jacobian is 1 for a regular tetrahedron, 0 for a flat tetrahedron,
    /// and not positive for a folded tetrahedron.
    pub min_scaled_jacobian: f64,
    /// Smallest volume of a tetrahedron (mm³), negative if a tetrahedron is inverted.
    pub min_volume_mm3: f64,
    /// Mean edge length (mm).
    pub mean_edge_mm: f64,
}

impl Quality {
    /// Computes the quality measures of a mesh.
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
            min_scaled_jacobian: (0..tets)
                .into_par_iter()
                .map(|tet| scaled_jacobian(mesh, tet))
                .reduce(|| f64::INFINITY, f64::min),
            min_volume_mm3: min_volume,
            mean_edge_mm: mesh.mean_edge(),
        }
    }

    /// Returns the smallest dihedral angle of each tetrahedron (degrees).
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

/// Returns the scaled Jacobian of a tetrahedron.
fn scaled_jacobian(mesh: &TetMesh, tet: usize) -> f64 {
    let corners = mesh.corners(tet);
    let lowest = match mesh.middles(tet) {
        Some(middles) => Jacobian::of(&corners, &middles).lowest,
        None => 6.0 * mesh.tet_volume(tet),
    };
    let lengths = EDGES.map(|[a, b]| norm(sub(corners[a], corners[b])));
    let product = |corner: usize| {
        let meeting = EDGES.iter().zip(lengths).filter(|(edge, _)| edge.contains(&corner));
        meeting.map(|(_, length)| length).product::<f64>()
    };
    std::f64::consts::SQRT_2 * lowest / (0..4).map(product).fold(0.0, f64::max)
}

/// Returns the smallest and largest of the six dihedral angles (radians).
fn dihedrals(p: [Point; 4]) -> (f64, f64) {
    let normals = FACES.map(|[a, b, c]| cross(sub(p[b], p[a]), sub(p[c], p[a])));
    let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
    for i in 0..4 {
        for j in 0..i {
            let (m, n) = (normals[i], normals[j]);
            // atan2 is accurate near 0 and π, where the arc cosine is inaccurate
            let angle = norm(cross(m, n)).atan2(-dot(m, n));
            low = low.min(angle);
            high = high.max(angle);
        }
    }
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tetrahedron(nodes: [Point; 4]) -> TetMesh {
        TetMesh {
            nodes: nodes.to_vec(),
            tets: vec![[0, 1, 2, 3]],
            region_of: vec![0],
            regions: vec!["matrix".into()],
            ..TetMesh::default()
        }
    }

    #[test]
    fn the_scaled_jacobian_agrees_with_closed_forms() {
        let regular =
            tetrahedron([[1.0; 3], [-1.0, 1.0, -1.0], [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]]);
        let value = |mesh: &TetMesh| {
            mesh.validate().unwrap();
            Quality::of(mesh).min_scaled_jacobian
        };
        assert!((value(&regular) - 1.0).abs() < 1e-12);
        // three edges of length 1 meet at one corner; at each other corner, two edges of length √2 and one edge of
        // length 1 meet
        let corner = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let mut mesh = tetrahedron(corner);
        assert!((value(&mesh) - std::f64::consts::SQRT_2 / 2.0).abs() < 1e-12);
        // shift the mid-edge point along the edge by s: then ∂x/∂ξ = 1 + (4 − 8 ξ) s, which has its extremes at the
        // ends of the edge
        mesh.edge_points = vec![([0, 1], [0.6, 0.0, 0.0])];
        let bent = value(&mesh);
        assert!((bent - 0.6 * std::f64::consts::SQRT_2 / 2.0).abs() < 2e-3, "{bent}");
    }
}
