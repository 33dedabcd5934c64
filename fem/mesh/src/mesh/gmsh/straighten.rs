//! Repair of imported curved tetrahedra: correct orientation, and less curved edges for folded tetrahedra.

use rayon::prelude::*;

use super::region_volume::{RegionVolume, region_volumes};
use crate::mesh::TetMesh;
use crate::mesh::curved::Jacobian;
use crate::mesh::topology::{edges_of, middle};
use crate::mesh::vector::{Point, add, scale, sub, tet_volume};

/// Smallest Jacobian determinant of a repaired tetrahedron, divided by the determinant of the straight tetrahedron with
/// the same corners. Gmsh's optimiser has the same default (`Mesh.HighOrderThresholdMin`).
const SMALLEST: f64 = 0.1;
/// Number of bisections of the factor by which a curved edge approaches its chord.
const HALVINGS: usize = 6;
/// Number of rounds in which edges approach their chords; tetrahedra that are folded afterwards get straight edges.
const ROUNDS: usize = 20;

/// Result of the repair of folded tetrahedra.
pub(super) struct Straightening {
    /// Sorted numbers of the tetrahedra that were folded.
    pub(super) tets: Vec<u32>,
    /// Volume of each region before and after the repair.
    pub(super) volumes: Vec<RegionVolume>,
}

/// Orders the nodes of each tetrahedron so that its volume, curved edges included, is positive.
fn orient(mesh: &mut TetMesh) {
    let turned: Vec<bool> =
        (0..mesh.tets.len()).into_par_iter().map(|tet| mesh.tet_volume(tet) < 0.0).collect();
    for (tet, _) in mesh.tets.iter_mut().zip(turned).filter(|(_, turned)| *turned) {
        tet.swap(0, 1);
    }
}

/// Orients the tetrahedra. Moves the mid-edge points of folded tetrahedra towards the midpoints of their edges until
/// the tetrahedra are not folded. An edge that moves can fold a neighbour, so both steps are repeated until no
/// tetrahedron is folded.
pub(super) fn straighten(mesh: &mut TetMesh) -> Straightening {
    orient(mesh);
    let before = region_volumes(mesh);
    let mut repaired = Vec::new();
    for round in 0.. {
        let is_folded = |tet: &usize| match mesh.middles(*tet) {
            // a determinant of NaN does not count as folded, because the validation of the mesh rejects such points
            // later
            Some(middles) => Jacobian::of(&mesh.corners(*tet), &middles).lowest <= 0.0,
            None => false,
        };
        let folded: Vec<usize> = (0..mesh.tets.len()).into_par_iter().filter(is_folded).collect();
        if folded.is_empty() {
            break;
        }
        let factor = |tet: usize| if round < ROUNDS { largest_factor(mesh, tet) } else { 0.0 };
        let factors: Vec<f64> = folded.par_iter().map(|&tet| factor(tet)).collect();
        bend_less(mesh, &folded, &factors);
        repaired.extend(folded.iter().map(|&tet| tet as u32));
        orient(mesh);
    }
    repaired.sort_unstable();
    repaired.dedup();
    let volumes = RegionVolume::pairs(&mesh.regions, before, region_volumes(mesh));
    Straightening { tets: repaired, volumes }
}

/// Returns the largest factor, to 1/64, by which the distances of the mid-edge points of a tetrahedron from the
/// midpoints of its edges can be multiplied so that the tetrahedron is valid; 0 if there is no such factor.
fn largest_factor(mesh: &TetMesh, tet: usize) -> f64 {
    let (corners, Some(bent)) = (mesh.corners(tet), mesh.middles(tet)) else { return 0.0 };
    let chords = edges_of(&mesh.tets[tet]).map(|edge| middle(&mesh.nodes, edge));
    let least = SMALLEST * 6.0 * tet_volume(corners).abs();
    let is_valid = |factor: f64| {
        let middles = std::array::from_fn(|edge| between(chords[edge], bent[edge], factor));
        Jacobian::of(&corners, &middles).lowest >= least
    };
    let [mut low, mut high] = [0.0, 1.0];
    for _ in 0..HALVINGS {
        let half = 0.5 * (low + high);
        if is_valid(half) { low = half } else { high = half }
    }
    low
}

/// Multiplies the distances of the mid-edge points of tetrahedra from the midpoints of their edges by the factor of
/// the tetrahedron, or by the smallest factor of the tetrahedra that share the edge. An edge with the factor 0 becomes
/// straight.
fn bend_less(mesh: &mut TetMesh, tets: &[usize], factors: &[f64]) {
    let mut edges: Vec<([u32; 2], f64)> = tets
        .iter()
        .zip(factors)
        .flat_map(|(&tet, &factor)| edges_of(&mesh.tets[tet]).map(|edge| (edge, factor)))
        .collect();
    edges.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
    edges.dedup_by_key(|(edge, _)| *edge);
    let factor_of = |edge: &[u32; 2]| {
        edges.binary_search_by_key(edge, |(edge, _)| *edge).map_or(1.0, |index| edges[index].1)
    };
    mesh.edge_points.retain(|(edge, _)| factor_of(edge) > 0.0);
    let nodes = &mesh.nodes;
    for (edge, point) in &mut mesh.edge_points {
        let factor = factor_of(edge);
        if factor < 1.0 {
            *point = between(middle(nodes, *edge), *point, factor);
        }
    }
}

/// Returns the point from which `start` and `end` are at distances of the ratio `share` to 1 − `share`.
fn between(start: Point, end: Point, share: f64) -> Point {
    add(start, scale(sub(end, start), share))
}
