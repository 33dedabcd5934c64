//! Tractions, and loads at a given time.

use std::collections::BTreeMap;

use super::function::Function;
use crate::element::Domain;
use crate::parallel::Part;

/// Traction on the triangles of a surface, as force per reference area, MPa.
#[derive(Clone, Debug)]
pub(super) struct Traction {
    pub(super) surface: String,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) stress: Function<[f64; 3]>,
}

/// Nodal loads and resultant forces at one time.
#[derive(Clone, Debug)]
pub(crate) struct Loads {
    /// Nodal forces (N) and damage sources (N mm).
    pub(crate) nodal: Vec<[f64; 4]>,
    /// Resultant of the tractions on each surface, N, for the triangles of this rank.
    pub(crate) tractions: BTreeMap<String, [f64; 3]>,
}

impl Traction {
    /// Adds the nodal forces of the traction at a time to `nodal`, N. Returns the resultant force, N.
    pub(super) fn add(&self, domain: &dyn Domain, time_s: f64, nodal: &mut [[f64; 4]]) -> [f64; 3] {
        let stress = |x| self.stress.at(x, time_s);
        domain.surface_load(&self.triangles, &stress, nodal);
        domain.surface_resultant(&self.triangles, &stress)
    }
}

/// Returns the faces of this rank, with the node numbers of this rank. `domain` is the whole space, and `rank_of_tet` the
/// rank of each of its elements. A face between two ranks belongs to the lower rank.
pub(super) fn of_part(
    triangles: &[[u32; 3]],
    domain: &dyn Domain,
    rank_of_tet: &[u32],
    part: &Part,
) -> Vec<[u32; 3]> {
    let lowest = lowest_ranks(triangles.iter(), domain, rank_of_tet);
    let (rank, local) = (part.ranks().rank() as u32, part.local());
    let here = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(&local);
        (lowest[&sorted(*triangle)] == rank).then_some([a?, b?, c?])
    };
    triangles.iter().filter_map(here).collect()
}

/// Returns, for each face (sorted nodes), the lowest rank that has an element with this face.
fn lowest_ranks<'a>(
    triangles: impl Iterator<Item = &'a [u32; 3]>,
    domain: &dyn Domain,
    rank_of_tet: &[u32],
) -> BTreeMap<[u32; 3], u32> {
    let mut lowest: BTreeMap<_, _> = triangles.map(|&t| (sorted(t), u32::MAX)).collect();
    if lowest.is_empty() {
        return lowest;
    }
    for (tet, &rank) in rank_of_tet.iter().enumerate() {
        let corners = &domain.nodes_of(tet)[..4];
        for without in 0..4 {
            let face = [0, 1, 2].map(|k| corners[k + usize::from(k >= without)]);
            lowest.entry(sorted(face)).and_modify(|least| *least = rank.min(*least));
        }
    }
    lowest
}

fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}
