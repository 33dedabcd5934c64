//! Distribution of the reactions to prescribed values among the surfaces that prescribe them.
//!
//! A condition on a surface exerts forces only in the components that it prescribes, e.g. a plane of symmetry only
//! along its normal. At a node that surfaces share, several conditions may prescribe the same component. The force in
//! this component is then distributed to the surfaces in proportion to the area of their triangles at the node, so
//! that the forces of all surfaces add up to the force on the body. Node sets have no area: if one of the conditions
//! belongs to a node set, the force is divided equally.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

use crate::element::Domain;
use crate::parallel::Part;
use fem_mesh::TetMesh;

/// Displacement component of a node that a condition on a surface prescribes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Support {
    pub(super) node: u32,
    pub(super) component: usize,
    /// Fraction of the nodal force that belongs to the surface, in (0, 1].
    pub(super) share: f64,
}

/// The surfaces that prescribe each component of each node.
#[derive(Clone, Debug, Default)]
pub(super) struct Claims(BTreeMap<(u32, usize), BTreeSet<String>>);

impl Claims {
    /// Adds a surface that prescribes a component of its nodes.
    pub(super) fn add(&mut self, surface: &str, nodes: &[u32], component: usize) {
        for &node in nodes {
            let surfaces = self.0.entry((node, component)).or_default();
            if !surfaces.contains(surface) {
                surfaces.insert(surface.into());
            }
        }
    }

    /// Returns the supports of each surface, with the share of the nodal force that belongs to the surface.
    pub(super) fn into_supports(
        self,
        domain: &dyn Domain,
        mesh: &TetMesh,
    ) -> BTreeMap<String, Vec<Support>> {
        let mut areas: BTreeMap<&str, BTreeMap<u32, f64>> = BTreeMap::new();
        let have_areas =
            |names: &BTreeSet<String>| names.iter().all(|name| mesh.surfaces.contains_key(name));
        for surface in self.0.values().filter(|s| s.len() > 1 && have_areas(s)).flatten() {
            let on_surface = || areas_at_nodes(domain, mesh, &mesh.surfaces[surface]);
            areas.entry(surface).or_insert_with(on_surface);
        }
        let mut supports: BTreeMap<String, Vec<Support>> = BTreeMap::new();
        for (&(node, component), surfaces) in &self.0 {
            let weighted = have_areas(surfaces);
            let area = |surface: &String| {
                areas.get(surface.as_str()).filter(|_| weighted).map_or(1.0, |a| a[&node])
            };
            let sum: f64 = surfaces.iter().map(area).sum();
            for surface in surfaces {
                let support = Support { node, component, share: area(surface) / sum };
                supports.entry(surface.clone()).or_default().push(support);
            }
        }
        supports
    }
}

/// Returns the area of the triangles at each node of a surface, mm².
fn areas_at_nodes(
    domain: &dyn Domain,
    mesh: &TetMesh,
    triangles: &[[u32; 3]],
) -> BTreeMap<u32, f64> {
    let mut areas = BTreeMap::new();
    for triangle in triangles {
        let [a, b, c] = triangle.map(|n| Vector3::from(mesh.nodes[n as usize]));
        let area = 0.5 * (b - a).cross(&(c - a)).norm();
        for node in domain.nodes_on(&[*triangle]) {
            *areas.entry(node).or_insert(0.0) += area;
        }
    }
    areas
}

/// Returns the supports at the nodes that belong to this rank.
pub(super) fn of_part(supports: Vec<Support>, part: &Part) -> Vec<Support> {
    let local = part.local();
    let on_rank = |support: Support| {
        let node = local(support.node).filter(|&node| part.halo.owns(node))?;
        Some(Support { node, ..support })
    };
    supports.into_iter().filter_map(on_rank).collect()
}

/// Returns the sum of nodal forces, weighted by the shares of the supports, N.
pub(super) fn sum(supports: &[Support], forces: &[[f64; 4]]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for &Support { node, component, share } in supports {
        sum[component] += share * forces[node as usize][component];
    }
    sum
}
