//! The mesh itself, and the checks that make it safe to simulate on.

use std::collections::BTreeMap;

use super::vector::{Point, norm, sub, tet_volume};
use crate::error::MeshError;

/// The faces of a tetrahedron, counter-clockwise seen from outside.
pub(crate) const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];
/// The edges of a tetrahedron.
pub(crate) const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

/// Volume below this times the cube of the longest edge counts as no volume at all.
const DEGENERATE: f64 = 1e-10;

/// A conforming mesh of linear tetrahedra with named regions and named boundary surfaces.
///
/// Coordinates are in mm, the specimen's axis is z. Element order is no property of the mesh:
/// a simulation adds the mid-edge nodes it needs.
///
/// # Example
/// ```
/// use fem::TetMesh;
/// use std::collections::BTreeMap;
///
/// let mesh = TetMesh {
///     nodes: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
///     tets: vec![[0, 1, 2, 3]],
///     region_of: vec![0],
///     regions: vec!["matrix".into()],
///     grain_of: None,
///     surfaces: BTreeMap::from([("bottom".into(), vec![[0, 2, 1]])]),
/// };
/// mesh.validate()?;
/// assert!((mesh.volume() - 1.0 / 6.0).abs() < 1e-15);
/// # Ok::<(), fem::MeshError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct TetMesh {
    /// Coordinates of the nodes (mm).
    pub nodes: Vec<[f64; 3]>,
    /// Nodes of each tetrahedron, so ordered that its volume is positive.
    pub tets: Vec<[u32; 4]>,
    /// For each tetrahedron, an index into `regions`.
    pub region_of: Vec<u16>,
    /// Names of the regions, as `matrix` and `grain`.
    pub regions: Vec<String>,
    /// For each tetrahedron 0 in the matrix, or the grain's number from 1, where grains are known.
    pub grain_of: Option<Vec<u32>>,
    /// Named parts of the boundary, as `bottom`, `top` and `side`: triangles, counter-clockwise
    /// seen from outside.
    pub surfaces: BTreeMap<String, Vec<[u32; 3]>>,
}

/// One face as one tetrahedron has it.
struct Face {
    key: [u32; 3],
    outward: [u32; 3],
    tet: u32,
}

impl TetMesh {
    /// The corners of a tetrahedron (mm).
    ///
    /// # Panics
    /// If there is no such tetrahedron or a node of it is missing.
    pub fn corners(&self, tet: usize) -> [[f64; 3]; 4] {
        self.tets[tet].map(|node| self.nodes[node as usize])
    }

    /// Volume of a tetrahedron (mm³), negative if it is inverted.
    ///
    /// # Panics
    /// As [`TetMesh::corners`].
    pub fn tet_volume(&self, tet: usize) -> f64 {
        tet_volume(self.corners(tet))
    }

    /// Volume of the whole mesh (mm³).
    pub fn volume(&self) -> f64 {
        (0..self.tets.len()).map(|tet| self.tet_volume(tet)).sum()
    }

    /// Volume of a region (mm³).
    ///
    /// # Errors
    /// [`MeshError::NoSuchRegion`] if the mesh has no region of that name.
    pub fn region_volume(&self, name: &str) -> Result<f64, MeshError> {
        let region = self.regions.iter().position(|r| r == name).ok_or_else(|| {
            MeshError::NoSuchRegion { name: name.into(), regions: self.regions.clone() }
        })?;
        Ok((0..self.tets.len())
            .zip(&self.region_of)
            .filter(|&(_, &of)| of as usize == region)
            .map(|(tet, _)| self.tet_volume(tet))
            .sum())
    }

    /// Length of the edges (mm), averaged over the tetrahedra's edges.
    pub fn mean_edge(&self) -> f64 {
        let total: f64 = (0..self.tets.len())
            .map(|tet| {
                let p = self.corners(tet);
                EDGES.iter().map(|&[a, b]| norm(sub(p[a], p[b]))).sum::<f64>()
            })
            .sum();
        total / (6 * self.tets.len().max(1)) as f64
    }

    /// The faces that belong to one tetrahedron only, counter-clockwise seen from outside.
    pub fn boundary_faces(&self) -> Vec<[u32; 3]> {
        let faces = self.sorted_faces();
        faces
            .chunk_by(|a, b| a.key == b.key)
            .filter(|shared| shared.len() == 1)
            .map(|shared| shared[0].outward)
            .collect()
    }

    /// Pairs of tetrahedra that share a face.
    pub(crate) fn neighbours(&self) -> Vec<[u32; 2]> {
        let faces = self.sorted_faces();
        faces
            .chunk_by(|a, b| a.key == b.key)
            .filter(|shared| shared.len() == 2)
            .map(|shared| [shared[0].tet, shared[1].tet])
            .collect()
    }

    fn sorted_faces(&self) -> Vec<Face> {
        let mut faces: Vec<Face> = Vec::with_capacity(4 * self.tets.len());
        for (tet, nodes) in self.tets.iter().enumerate() {
            for local in FACES {
                let outward = local.map(|l| nodes[l]);
                faces.push(Face { key: sorted(outward), outward, tet: tet as u32 });
            }
        }
        faces.sort_unstable_by_key(|face| (face.key, face.tet));
        faces
    }

    /// Checks that the mesh is sound: every tetrahedron has volume, the right orientation and a
    /// region; faces are shared by two at most; all is connected; the surfaces are parts of the
    /// boundary, outward, each face once.
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
        self.validate_surfaces()
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
        match used.iter().position(|used| !used) {
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

    /// The mesh of the nodes that tetrahedra use, in their old order, renumbered.
    pub(crate) fn without_unused_nodes(mut self) -> TetMesh {
        let mut number = vec![u32::MAX; self.nodes.len()];
        for &node in self.tets.iter().flatten() {
            number[node as usize] = 0;
        }
        let mut kept: Vec<Point> = Vec::new();
        for (number, &point) in number.iter_mut().zip(&self.nodes) {
            if *number == 0 {
                *number = kept.len() as u32;
                kept.push(point);
            }
        }
        self.nodes = kept;
        for node in self.tets.iter_mut().flatten() {
            *node = number[*node as usize];
        }
        // a triangle on a dropped node keeps an impossible number, which `validate` names
        for node in self.surfaces.values_mut().flatten().flatten() {
            *node = number[*node as usize];
        }
        self
    }
}

pub(crate) fn sorted(mut face: [u32; 3]) -> [u32; 3] {
    face.sort_unstable();
    face
}

/// Whether two triangles of the same nodes run the same way round.
pub(crate) fn is_even_turn(a: [u32; 3], b: [u32; 3]) -> bool {
    (0..3).any(|k| b == [a[k], a[(k + 1) % 3], a[(k + 2) % 3]])
}

/// Union–find over nodes or tetrahedra.
pub(crate) struct Parts(Vec<u32>);

impl Parts {
    pub(crate) fn new(count: usize) -> Parts {
        Parts((0..count as u32).collect())
    }

    pub(crate) fn root(&mut self, mut k: u32) -> u32 {
        while self.0[k as usize] != k {
            self.0[k as usize] = self.0[self.0[k as usize] as usize];
            k = self.0[k as usize];
        }
        k
    }

    pub(crate) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        // the smaller number is the root, so that the result does not depend on the order
        self.0[a.max(b) as usize] = a.min(b);
    }
}
