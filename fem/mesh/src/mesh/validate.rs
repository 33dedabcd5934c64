//! The checks that make a mesh safe to simulate on.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::curved::Jacobian;
use super::tet_mesh::{EDGES, Parts, is_even_turn, sorted};
use super::vector::{norm, sub, tet_volume};
use super::{Mixture, TetMesh};
use crate::error::MeshError;

/// Volume below this times the cube of the longest edge counts as no volume at all.
const DEGENERATE: f64 = 1e-10;

impl TetMesh {
    /// Checks that the mesh is sound: every tetrahedron has volume, the right orientation and a
    /// region; faces are shared by two at most; all is connected; the surfaces are parts of the
    /// boundary, outward, each face once; edge points belong to edges and fold no tetrahedron;
    /// mixtures are fractions with unit normals.
    ///
    /// # Errors
    /// The first [`MeshError`] found, naming the entity and what helps.
    pub fn validate(&self) -> Result<(), MeshError> {
        if self.tets.is_empty() {
            return Err(MeshError::Empty);
        }
        self.validate_nodes()?;
        self.validate_volumes()?;
        self.validate_regions()?;
        self.validate_faces()?;
        self.validate_connection()?;
        self.validate_surfaces()?;
        self.validate_edge_points()?;
        self.validate_mixture()
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
        for tet in 0..self.tets.len() {
            let p = self.corners(tet);
            let volume_mm3 = tet_volume(p);
            let longest_edge_mm =
                EDGES.iter().map(|&[a, b]| norm(sub(p[a], p[b]))).fold(0.0, f64::max);
            if volume_mm3.abs() <= DEGENERATE * longest_edge_mm.powi(3) {
                return Err(MeshError::Degenerate { tet, volume_mm3, longest_edge_mm });
            }
            if volume_mm3 < 0.0 {
                return Err(MeshError::Inverted { tet, volume_mm3 });
            }
        }
        Ok(())
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
        // a phase may be there in mixtures alone
        let may_be_empty = self.mixture.is_some();
        match used.iter().position(|used| !used).filter(|_| !may_be_empty) {
            Some(k) => Err(MeshError::MissingRegion { name: self.regions[k].clone() }),
            None => Ok(()),
        }
    }

    fn validate_faces(&self) -> Result<(), MeshError> {
        for shared in self.sorted_faces().chunk_by(|a, b| a.key == b.key) {
            if shared.len() > 2 {
                return Err(MeshError::NonManifoldFace {
                    face: shared[0].key,
                    count: shared.len(),
                    tets: shared.iter().take(3).map(|face| face.tet).collect(),
                });
            }
            if let [a, b] = shared
                && is_even_turn(a.outward, b.outward)
            {
                return Err(MeshError::Overlap { first: a.tet, second: b.tet });
            }
        }
        Ok(())
    }

    fn validate_connection(&self) -> Result<(), MeshError> {
        let mut parts = Parts::new(self.nodes.len());
        for tet in &self.tets {
            for &node in &tet[1..] {
                parts.join(tet[0], node);
            }
        }
        let first = parts.root(self.tets[0][0]);
        match self.tets.iter().position(|tet| parts.root(tet[0]) != first) {
            Some(tet) => Err(MeshError::Disconnected { tet }),
            None => Ok(()),
        }
    }

    fn validate_surfaces(&self) -> Result<(), MeshError> {
        let boundary: BTreeMap<[u32; 3], [u32; 3]> =
            self.boundary_faces().into_iter().map(|face| (sorted(face), face)).collect();
        let mut listed: BTreeMap<[u32; 3], &str> = BTreeMap::new();
        for (name, triangles) in &self.surfaces {
            if triangles.is_empty() {
                return Err(MeshError::EmptySurface { name: name.clone() });
            }
            for (triangle, &nodes) in triangles.iter().enumerate() {
                let surface = || name.clone();
                let Some(&outward) = boundary.get(&sorted(nodes)) else {
                    return Err(MeshError::NotOnBoundary { surface: surface(), triangle, nodes });
                };
                if !is_even_turn(outward, nodes) {
                    return Err(MeshError::Inward { surface: surface(), triangle });
                }
                if let Some(first) = listed.insert(sorted(nodes), name) {
                    let first = first.to_string();
                    return Err(MeshError::DuplicateTriangle { nodes, first, second: surface() });
                }
            }
        }
        Ok(())
    }

    fn validate_edge_points(&self) -> Result<(), MeshError> {
        for (place, &(edge, point_mm)) in self.edge_points.iter().enumerate() {
            let fault = |fault| Err(MeshError::EdgePoint { edge, point_mm, fault });
            if point_mm.iter().any(|x| !x.is_finite()) {
                return fault("its point is not finite");
            }
            if edge[0] >= edge[1] || place > 0 && self.edge_points[place - 1].0 >= edge {
                return fault("edge points are sorted by their edges, the smaller node first");
            }
        }
        if self.edge_points.is_empty() {
            return Ok(());
        }
        let mut used = vec![false; self.edge_points.len()];
        for tet in &self.tets {
            for edge in EDGES {
                let [a, b] = edge.map(|corner| tet[corner]);
                let key = [a.min(b), a.max(b)];
                if let Ok(place) = self.edge_points.binary_search_by_key(&key, |&(edge, _)| edge) {
                    used[place] = true;
                }
            }
        }
        if let Some(place) = used.iter().position(|used| !used) {
            let (edge, point_mm) = self.edge_points[place];
            let fault = "no tetrahedron has this edge";
            return Err(MeshError::EdgePoint { edge, point_mm, fault });
        }
        let lowest =
            |tet: usize| Some(Jacobian::of(&self.corners(tet), &self.middles(tet)?).lowest);
        let folded = |tet: usize| {
            lowest(tet)
                .filter(|&low| low <= 0.0)
                .map(|jacobian_mm3| MeshError::Folded { tet, jacobian_mm3 })
        };
        match (0..self.tets.len()).into_par_iter().find_map_first(folded) {
            Some(error) => Err(error),
            None => Ok(()),
        }
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
