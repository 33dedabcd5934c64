//! Validity checks of a mesh.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::curved::Jacobian;
use super::tet_mesh::Face;
use super::topology::{EDGES, edges_of, is_even_turn, sorted};
use super::vector::{norm, sub, tet_volume};
use super::{Mixture, TetMesh};
use crate::error::MeshError;
use fem_image::DisjointSets;

/// A tetrahedron is degenerate if its volume is at most this factor times the cube of its longest edge.
const DEGENERATE: f64 = 1e-10;
/// Largest number of errors that a message lists.
const LISTED: usize = 5;

impl TetMesh {
    /// Checks that the mesh is valid: every tetrahedron has a positive volume and a region; a face is shared by at
    /// most two tetrahedra; the mesh is connected; surface triangles are boundary faces oriented outwards, each
    /// listed once; edge points belong to existing edges and fold no tetrahedron; mixtures have fractions in [0, 1]
    /// and unit normals.
    ///
    /// The volume of a tetrahedron with curved edges takes these edges into account. The volume of the straight
    /// tetrahedron with the same corners may be negative.
    ///
    /// # Errors
    /// The error of the first check that fails, with the entity and a remedy. Several errors of one check are
    /// combined in [`MeshError::Several`].
    pub fn validate(&self) -> Result<(), MeshError> {
        if self.tets.is_empty() {
            return Err(MeshError::Empty);
        }
        self.validate_nodes()?;
        self.validate_edge_points()?;
        self.validate_volumes()?;
        self.validate_regions()?;
        self.validate_faces()?;
        self.validate_connection()?;
        self.validate_surfaces()?;
        self.validate_mixture()
    }

    /// Checks that all tetrahedra have a positive volume with straight edges, as linear elements require.
    ///
    /// # Errors
    /// [`MeshError::Inverted`] or [`MeshError::Degenerate`], or [`MeshError::Several`] of these.
    pub fn validate_straight(&self) -> Result<(), MeshError> {
        let tets = (0..self.tets.len()).into_par_iter();
        several(tets.filter_map(|tet| self.straight_fault(tet)).collect())
    }

    fn validate_nodes(&self) -> Result<(), MeshError> {
        if let Some(node) = self.nodes.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
            return Err(MeshError::NotFinite { node, point: self.nodes[node] });
        }
        let nodes = self.nodes.len();
        let missing = |entity: String, node: u32| MeshError::MissingNode { entity, node, nodes };
        let mut used = vec![false; nodes];
        for (tet, corners) in self.tets.iter().enumerate() {
            for &node in corners {
                *used
                    .get_mut(node as usize)
                    .ok_or_else(|| missing(format!("tetrahedron {tet}"), node))? = true;
            }
        }
        for (name, triangles) in &self.surfaces {
            for (k, triangle) in triangles.iter().enumerate() {
                if let Some(&node) = triangle.iter().find(|&&node| node as usize >= nodes) {
                    return Err(missing(format!("triangle {k} of surface `{name}`"), node));
                }
            }
        }
        match used.iter().position(|used| !used) {
            Some(node) => Err(MeshError::UnusedNode { node }),
            None => Ok(()),
        }
    }

    fn validate_volumes(&self) -> Result<(), MeshError> {
        let fault = |tet: usize| {
            let Some(middles) = self.middles(tet) else { return self.straight_fault(tet) };
            let jacobian = Jacobian::of(&self.corners(tet), &middles);
            let jacobian_mm3 = jacobian.lowest;
            jacobian.is_folded().then_some(MeshError::Folded { tet, jacobian_mm3 })
        };
        several((0..self.tets.len()).into_par_iter().filter_map(fault).collect())
    }

    /// Returns an error if a tetrahedron with straight edges does not have a positive volume.
    fn straight_fault(&self, tet: usize) -> Option<MeshError> {
        let p = self.corners(tet);
        let volume_mm3 = tet_volume(p);
        let longest_edge_mm = EDGES.iter().map(|&[a, b]| norm(sub(p[a], p[b]))).fold(0.0, f64::max);
        if volume_mm3.abs() <= DEGENERATE * longest_edge_mm.powi(3) {
            return Some(MeshError::Degenerate { tet, volume_mm3, longest_edge_mm });
        }
        (volume_mm3 < 0.0).then_some(MeshError::Inverted { tet, volume_mm3 })
    }

    fn validate_regions(&self) -> Result<(), MeshError> {
        let tets = self.tets.len();
        let labelled = |array, length: usize| {
            if length == tets { Ok(()) } else { Err(MeshError::Unlabelled { array, length, tets }) }
        };
        labelled("region_of", self.region_of.len())?;
        if let Some(grains) = &self.grain_of {
            labelled("grain_of", grains.len())?;
        }
        let mut used = vec![false; self.regions.len()];
        for (tet, &region) in self.region_of.iter().enumerate() {
            *used.get_mut(region as usize).ok_or_else(|| MeshError::UnknownRegion {
                tet,
                region,
                regions: self.regions.clone(),
            })? = true;
        }
        // a region may be without tetrahedra if its phase occurs in mixtures only
        let may_be_empty = self.mixture.is_some();
        match used.iter().position(|used| !used).filter(|_| !may_be_empty) {
            Some(k) => Err(MeshError::MissingRegion { name: self.regions[k].clone() }),
            None => Ok(()),
        }
    }

    fn validate_faces(&self) -> Result<(), MeshError> {
        let faces = self.sorted_faces();
        let fault = |shared: &[Face]| match shared {
            [a, b] if is_even_turn(a.outward, b.outward) => {
                Some(MeshError::Overlap { first: a.tet, second: b.tet })
            }
            [first, _, _, ..] => Some(MeshError::NonManifoldFace {
                face: first.key,
                count: shared.len(),
                tets: shared.iter().take(3).map(|face| face.tet).collect(),
            }),
            _ => None,
        };
        several(faces.chunk_by(|a, b| a.key == b.key).filter_map(fault).collect())
    }

    fn validate_connection(&self) -> Result<(), MeshError> {
        let mut connected = DisjointSets::new(self.nodes.len());
        for tet in &self.tets {
            for &node in &tet[1..] {
                connected.join(tet[0], node);
            }
        }
        let first = connected.root(self.tets[0][0]);
        match self.tets.iter().position(|tet| connected.root(tet[0]) != first) {
            Some(tet) => Err(MeshError::Disconnected { tet }),
            None => Ok(()),
        }
    }

    fn validate_surfaces(&self) -> Result<(), MeshError> {
        let boundary: BTreeMap<[u32; 3], [u32; 3]> =
            self.boundary_faces().into_iter().map(|face| (sorted(face), face)).collect();
        let mut listed: BTreeMap<[u32; 3], &str> = BTreeMap::new();
        let mut faults = Vec::new();
        for (name, triangles) in &self.surfaces {
            if triangles.is_empty() {
                faults.push(MeshError::EmptySurface { name: name.clone() });
            }
            for (triangle, &nodes) in triangles.iter().enumerate() {
                let surface = name.clone();
                match boundary.get(&sorted(nodes)) {
                    None => faults.push(MeshError::NotOnBoundary { surface, triangle, nodes }),
                    Some(&outward) if !is_even_turn(outward, nodes) => {
                        faults.push(MeshError::Inward { surface, triangle });
                    }
                    Some(_) => {
                        if let Some(first) = listed.insert(sorted(nodes), name) {
                            let (first, second) = (first.to_string(), surface);
                            faults.push(MeshError::DuplicateTriangle { nodes, first, second });
                        }
                    }
                }
            }
        }
        several(faults)
    }

    fn validate_edge_points(&self) -> Result<(), MeshError> {
        for (index, &(edge, point_mm)) in self.edge_points.iter().enumerate() {
            let fault = |fault| Err(MeshError::EdgePoint { edge, point_mm, fault });
            if point_mm.iter().any(|x| !x.is_finite()) {
                return fault("a coordinate is not finite; mesh the geometry again");
            }
            if edge[0] >= edge[1] || index > 0 && self.edge_points[index - 1].0 >= edge {
                return fault(
                    "`edge_points` must be sorted by edge, each edge with its smaller node first",
                );
            }
        }
        if self.edge_points.is_empty() {
            return Ok(());
        }
        let mut used = vec![false; self.edge_points.len()];
        for tet in &self.tets {
            for key in edges_of(tet) {
                if let Ok(index) = self.edge_points.binary_search_by_key(&key, |&(edge, _)| edge) {
                    used[index] = true;
                }
            }
        }
        if let Some(unused) = used.iter().position(|used| !used) {
            let (edge, point_mm) = self.edge_points[unused];
            let fault = "no tetrahedron has this edge; remove the point";
            return Err(MeshError::EdgePoint { edge, point_mm, fault });
        }
        Ok(())
    }

    fn validate_mixture(&self) -> Result<(), MeshError> {
        let Some(mixture) = &self.mixture else { return Ok(()) };
        let (length, tets) = (mixture.len(), self.tets.len());
        if length != tets {
            return Err(MeshError::Unlabelled { array: "mixture", length, tets });
        }
        for (tet, &Mixture { fraction, normal, region }) in mixture.iter().enumerate() {
            let length = norm(normal.map(f64::from));
            let is_direction = length == 0.0 || (length - 1.0).abs() < 1e-5;
            if !((0.0..=1.0).contains(&fraction) && is_direction) {
                return Err(MeshError::Mixture { tet, fraction, normal });
            }
            if fraction > 0.0 && usize::from(region) >= self.regions.len() {
                let regions = self.regions.clone();
                return Err(MeshError::UnknownRegion { tet, region, regions });
            }
        }
        Ok(())
    }
}

/// Combines errors into one error. A single error is returned unchanged; several errors become [`MeshError::Several`]
/// with the first five errors.
fn several(mut faults: Vec<MeshError>) -> Result<(), MeshError> {
    match faults.len() {
        0 => Ok(()),
        1 => Err(faults.remove(0)),
        count => {
            faults.truncate(LISTED);
            Err(MeshError::Several { first: faults, count })
        }
    }
}
