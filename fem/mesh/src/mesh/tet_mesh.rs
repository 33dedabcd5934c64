//! The tetrahedral mesh: its data and basic geometric queries.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::curved::Jacobian;
use super::topology::{EDGES, EdgePoint, FACES, edges_of, middle, sorted};
use super::vector::{Point, cross, mean, norm, scale, sub, tet_volume};
use crate::error::MeshError;
use fem_image::DisjointSets;

/// An edge is straight if its mid-edge point differs from the midpoint of its ends by at most this factor times the
/// extent of the mesh.
const STRAIGHT: f64 = 1e-12;

/// The second phase of a tetrahedron that contains two phases.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mixture {
    /// Volume fraction of the second phase (the grain) in the tetrahedron, in [0, 1]. The fraction is 0 if the
    /// tetrahedron consists only of the material of its region.
    pub fraction: f32,
    /// Unit normal of the interface inside the tetrahedron, pointing towards the matrix; the zero vector if there is no
    /// interface.
    pub normal: [f32; 3],
    /// Region of the second phase, an index into [`TetMesh::regions`]; 1 in a mesh of matrix and grain.
    pub region: u16,
}

impl Default for Mixture {
    /// Returns the mixture of a tetrahedron that consists of one phase.
    fn default() -> Self {
        Self { fraction: 0.0, normal: [0.0; 3], region: 1 }
    }
}

/// A conforming mesh of tetrahedra with named regions and named boundary surfaces.
///
/// Coordinates are in mm; the axis of the specimen is z. The element order is not part of the mesh: a simulation with
/// quadratic elements adds the mid-edge nodes. `edge_points` gives the positions of these nodes on curved edges; linear
/// elements ignore them.
///
/// # Example
/// ```
/// use fem_mesh::TetMesh;
/// use std::collections::BTreeMap;
///
/// let mesh = TetMesh {
///     nodes: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
///     tets: vec![[0, 1, 2, 3]],
///     region_of: vec![0],
///     regions: vec!["matrix".into()],
///     grain_of: None,
///     surfaces: BTreeMap::from([("bottom".into(), vec![[0, 2, 1]])]),
///     ..TetMesh::default()
/// };
/// mesh.validate()?;
/// assert!((mesh.volume() - 1.0 / 6.0).abs() < 1e-15);
/// # Ok::<(), fem_mesh::MeshError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TetMesh {
    /// Coordinates of the nodes (mm).
    pub nodes: Vec<[f64; 3]>,
    /// Nodes of each tetrahedron, ordered so that its volume is positive.
    pub tets: Vec<[u32; 4]>,
    /// Region of each tetrahedron, an index into `regions`.
    pub region_of: Vec<u16>,
    /// Names of the regions, such as `matrix` and `grain`; in a specimen the matrix comes first, the phases of
    /// the grains follow.
    pub regions: Vec<String>,
    /// Grain number of each tetrahedron, from 1, or 0 in the matrix; `None` if the mesh has no grain numbers.
    pub grain_of: Option<Vec<u32>>,
    /// Named parts of the boundary, such as `bottom`, `top` and `side`: triangles, counter-clockwise seen from
    /// outside.
    pub surfaces: BTreeMap<String, Vec<[u32; 3]>>,
    /// Curved edges for quadratic elements: the two nodes (the smaller first) and the coordinates of the mid-edge
    /// node (mm). Sorted by nodes; empty for a straight mesh.
    pub edge_points: Vec<([u32; 2], [f64; 3])>,
    /// Second phase of each tetrahedron, if the mesh does not resolve some of the grains. A tetrahedron in the matrix
    /// region with a fraction above 0 is a mixture of matrix and one other phase.
    pub mixture: Option<Vec<Mixture>>,
}

/// A face of one tetrahedron.
pub(super) struct Face {
    /// Nodes of the face in increasing order.
    pub(super) key: [u32; 3],
    /// Nodes of the face, counter-clockwise seen from outside.
    pub(super) outward: [u32; 3],
    pub(super) tet: u32,
}

impl TetMesh {
    /// Returns the coordinates of the corners of a tetrahedron (mm).
    ///
    /// # Panics
    /// If the tetrahedron or one of its nodes does not exist.
    pub fn corners(&self, tet: usize) -> [[f64; 3]; 4] {
        self.tets[tet].map(|node| self.nodes[node as usize])
    }

    /// Returns the mid-edge points of the quadratic element (mm), on the edges 01, 12, 20, 03, 13, 23 of a
    /// tetrahedron, or `None` if all edges are straight.
    ///
    /// # Panics
    /// The panics of [`TetMesh::corners`].
    pub fn middles(&self, tet: usize) -> Option<[[f64; 3]; 6]> {
        if self.edge_points.is_empty() {
            return None;
        }
        let stored = edges_of(&self.tets[tet])
            .map(|key| self.edge_points.binary_search_by_key(&key, |&(edge, _)| edge).ok());
        if stored == [None; 6] {
            return None;
        }
        let corners = self.corners(tet);
        Some(std::array::from_fn(|edge| match stored[edge] {
            Some(index) => self.edge_points[index].1,
            None => mean(EDGES[edge].map(|corner| corners[corner]).into_iter()),
        }))
    }

    /// Returns the volume of a tetrahedron (mm³), with its curved edges. The volume is negative if the tetrahedron is
    /// inverted.
    ///
    /// # Panics
    /// The panics of [`TetMesh::corners`].
    pub fn tet_volume(&self, tet: usize) -> f64 {
        match self.middles(tet) {
            Some(middles) => Jacobian::of(&self.corners(tet), &middles).mean / 6.0,
            None => tet_volume(self.corners(tet)),
        }
    }

    /// Returns the volumes of all tetrahedra (mm³).
    pub fn volumes(&self) -> Vec<f64> {
        (0..self.tets.len()).into_par_iter().map(|tet| self.tet_volume(tet)).collect()
    }

    /// Returns the volume of the whole mesh (mm³).
    pub fn volume(&self) -> f64 {
        self.volumes().iter().sum()
    }

    /// Returns the total volume of the tetrahedra of a region (mm³).
    ///
    /// # Errors
    /// [`MeshError::NoSuchRegion`] if the mesh has no region of that name.
    pub fn region_volume(&self, name: &str) -> Result<f64, MeshError> {
        let region = self.regions.iter().position(|r| r == name).ok_or_else(|| {
            MeshError::NoSuchRegion { name: name.into(), regions: self.regions.clone() }
        })?;
        let volumes = self.volumes().into_iter().zip(&self.region_of);
        Ok(volumes.filter(|&(_, &r)| usize::from(r) == region).map(|(volume, _)| volume).sum())
    }

    /// Returns the volume of each region (mm³), in the order of [`TetMesh::regions`]. A mixture contributes to both
    /// of its phases according to their fractions, whereas [`TetMesh::region_volume`] adds up whole tetrahedra.
    pub fn phase_volumes(&self) -> Vec<f64> {
        let mut sums = vec![0.0; self.regions.len()];
        for (tet, volume) in self.volumes().into_iter().enumerate() {
            let region = usize::from(self.region_of[tet]);
            let mixture = self.mixture.as_ref().map(|all| all[tet]).unwrap_or_default();
            let share = f64::from(mixture.fraction);
            sums[region] += (1.0 - share) * volume;
            if share > 0.0 {
                sums[usize::from(mixture.region)] += share * volume;
            }
        }
        sums
    }

    /// Returns the mesh with a region for each tetrahedron of one phase: a tetrahedron whose second phase has the fraction
    /// 1 becomes a tetrahedron of this phase. If no mixture remains, the mesh has no list of mixtures.
    pub fn with_pure_tetrahedra(mut self) -> TetMesh {
        let regions = self.regions.len();
        let Some(mixture) = &mut self.mixture else { return self };
        let mut changed = false;
        for (mixture, region) in mixture.iter_mut().zip(&mut self.region_of) {
            // [`TetMesh::validate`] reports a region that does not exist
            if mixture.fraction == 1.0 && usize::from(mixture.region) < regions {
                *region = mixture.region;
                *mixture = Mixture::default();
                changed = true;
            }
        }
        if changed && mixture.iter().all(|mixture| mixture.fraction == 0.0) {
            self.mixture = None;
        }
        self
    }

    /// Returns the mean edge length (mm) over the edges of all tetrahedra. An edge that several tetrahedra share counts
    /// once per tetrahedron.
    pub fn mean_edge(&self) -> f64 {
        let total: f64 = (0..self.tets.len())
            .map(|tet| {
                let p = self.corners(tet);
                EDGES.iter().map(|&[a, b]| norm(sub(p[a], p[b]))).sum::<f64>()
            })
            .sum();
        total / (6 * self.tets.len().max(1)) as f64
    }

    /// Returns the sorted list of all edges, each listed once with its smaller node first.
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let mut edges: Vec<[u32; 2]> = self.tets.iter().flat_map(edges_of).collect();
        edges.par_sort_unstable();
        edges.dedup();
        edges
    }

    /// Returns all edges with their mid-edge points, curved or straight, sorted by node numbers.
    pub(crate) fn all_edges(&self) -> Vec<EdgePoint> {
        let mut curved = self.edge_points.iter().peekable();
        let point = |edge: [u32; 2]| match curved.next_if(|(next, _)| *next == edge) {
            Some(&curved) => curved,
            None => (edge, middle(&self.nodes, edge)),
        };
        self.edges().into_iter().map(point).collect()
    }

    /// Returns the faces that belong to exactly one tetrahedron, counter-clockwise seen from outside.
    pub fn boundary_faces(&self) -> Vec<[u32; 3]> {
        let faces = self.sorted_faces();
        faces
            .chunk_by(|a, b| a.key == b.key)
            .filter(|shared| shared.len() == 1)
            .map(|shared| shared[0].outward)
            .collect()
    }

    /// Returns the pairs of tetrahedra that share a face.
    pub(crate) fn neighbours(&self) -> Vec<[u32; 2]> {
        let faces = self.sorted_faces();
        faces
            .chunk_by(|a, b| a.key == b.key)
            .filter(|shared| shared.len() == 2)
            .map(|shared| [shared[0].tet, shared[1].tet])
            .collect()
    }

    /// Returns, for each tetrahedron, the lowest index among the tetrahedra connected to it through faces.
    pub fn parts_by_faces(&self) -> Vec<u32> {
        let mut connected = DisjointSets::new(self.tets.len());
        self.neighbours().iter().for_each(|&[a, b]| connected.join(a, b));
        (0..self.tets.len() as u32).map(|tet| connected.root(tet)).collect()
    }

    /// Returns the area of the boundary (mm²).
    pub fn boundary_area(&self) -> f64 {
        let area = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|n| self.nodes[n as usize]);
            0.5 * norm(cross(sub(b, a), sub(c, a)))
        };
        self.boundary_faces().iter().map(area).sum()
    }

    /// Returns the longest side of the bounding box of the nodes (mm).
    pub fn largest_extent(&self) -> f64 {
        let side = |k: usize| {
            let at = self.nodes.iter().map(|x| x[k]);
            at.clone().fold(f64::MIN, f64::max) - at.fold(f64::MAX, f64::min)
        };
        (0..3).map(side).fold(0.0, f64::max)
    }

    pub(super) fn sorted_faces(&self) -> Vec<Face> {
        let mut faces: Vec<Face> = Vec::with_capacity(4 * self.tets.len());
        for (tet, nodes) in self.tets.iter().enumerate() {
            for local in FACES {
                let outward = local.map(|l| nodes[l]);
                faces.push(Face { key: sorted(outward), outward, tet: tet as u32 });
            }
        }
        faces.par_sort_unstable_by_key(|face| (face.key, face.tet));
        faces
    }

    /// Returns the Euler characteristic, vertices − edges + faces − tetrahedra: 1 for a body without holes or
    /// cavities.
    pub fn euler_characteristic(&self) -> i64 {
        let faces = self.sorted_faces().chunk_by(|a, b| a.key == b.key).count();
        let mut nodes = vec![false; self.nodes.len()];
        self.tets.as_flattened().iter().for_each(|&node| nodes[node as usize] = true);
        let nodes = nodes.into_iter().filter(|&used| used).count();
        nodes as i64 - self.edges().len() as i64 + faces as i64 - self.tets.len() as i64
    }

    /// Replaces the regions. `region_of` gets the centroid of a tetrahedron (mm) and returns the index in `names` of
    /// the tetrahedron's region. [`TetMesh::validate`] reports a region without a tetrahedron and an index without a
    /// name.
    pub fn with_regions(mut self, names: &[&str], region_of: impl Fn([f64; 3]) -> u16) -> TetMesh {
        let centroid = |tet: usize| mean(self.corners(tet).into_iter());
        self.region_of = (0..self.tets.len()).map(|tet| region_of(centroid(tet))).collect();
        self.regions = names.iter().map(|&name| name.into()).collect();
        self
    }

    /// Replaces the surfaces: `name_of` gets the centroid (mm) and the outward unit normal of each boundary face and
    /// returns the name of its surface, or `None` for a face that belongs to no surface.
    ///
    /// # Example
    /// The top of a block in two parts:
    /// ```
    /// use fem_mesh::Block;
    ///
    /// let mesh = Block::new([2.0, 1.0, 1.0], [4, 2, 2]).build()?.with_surfaces(|[x, ..], normal| {
    ///     let top = if x < 1.0 { "loaded" } else { "free" };
    ///     (normal[2] > 0.5).then_some(top)
    /// });
    /// assert_eq!(mesh.surfaces["loaded"].len(), mesh.surfaces["free"].len());
    /// # Ok::<(), fem_mesh::BlockError>(())
    /// ```
    pub fn with_surfaces<'a>(
        mut self,
        name_of: impl Fn([f64; 3], [f64; 3]) -> Option<&'a str>,
    ) -> TetMesh {
        let mut surfaces: BTreeMap<String, Vec<[u32; 3]>> = BTreeMap::new();
        for face in self.boundary_faces() {
            let [a, b, c] = face.map(|node| self.nodes[node as usize]);
            let area = cross(sub(b, a), sub(c, a));
            let normal = scale(area, 1.0 / norm(area));
            if let Some(name) = name_of(mean([a, b, c].into_iter()), normal) {
                surfaces.entry(name.into()).or_default().push(face);
            }
        }
        self.surfaces = surfaces;
        self
    }

    /// Moves every node and every mid-edge point by a map (mm to mm). An edge that the map bends becomes curved, for
    /// quadratic elements. [`TetMesh::validate`] reports tetrahedra that the map folds.
    ///
    /// # Example
    /// A quarter of a ring with radii of 1 and 2 mm:
    /// ```
    /// use fem_mesh::Block;
    ///
    /// let mesh = Block::new([1.0, 1.0, 0.5], [2, 6, 1]).build()?.mapped(|[x, y, z]| {
    ///     let (radius, angle) = (1.0 + x, std::f64::consts::FRAC_PI_2 * y);
    ///     [radius * angle.cos(), radius * angle.sin(), z]
    /// });
    /// mesh.validate()?;
    /// let exact = 0.25 * std::f64::consts::PI * (4.0 - 1.0) * 0.5;
    /// assert!((mesh.volume() / exact - 1.0).abs() < 1e-4);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn mapped(mut self, map: impl Fn([f64; 3]) -> [f64; 3]) -> TetMesh {
        let edges = self.all_edges();
        self.nodes.iter_mut().for_each(|node| *node = map(*node));
        let size = self.largest_extent();
        let moved = edges.into_iter().map(|(edge, point)| (edge, map(point)));
        let is_bent = |&(edge, point): &EdgePoint| {
            norm(sub(point, middle(&self.nodes, edge))) > STRAIGHT * size
        };
        self.edge_points = moved.filter(is_bent).collect();
        self
    }

    /// Removes the nodes that no tetrahedron uses and renumbers the remaining nodes in their original order.
    pub(crate) fn without_unused_nodes(mut self) -> TetMesh {
        let mut number = vec![u32::MAX; self.nodes.len()];
        for &node in self.tets.iter().flatten() {
            number[node as usize] = 0;
        }
        let mut used_nodes: Vec<Point> = Vec::new();
        for (number, &point) in number.iter_mut().zip(&self.nodes) {
            if *number == 0 {
                *number = used_nodes.len() as u32;
                used_nodes.push(point);
            }
        }
        self.nodes = used_nodes;
        for node in self.tets.iter_mut().flatten() {
            *node = number[*node as usize];
        }
        // a surface triangle with a removed node gets the invalid number `u32::MAX`, which `validate` reports
        for node in self.surfaces.values_mut().flatten().flatten() {
            *node = number[*node as usize];
        }
        self.edge_points.retain(|(edge, _)| edge.iter().all(|&n| number[n as usize] != u32::MAX));
        for node in self.edge_points.iter_mut().flat_map(|(edge, _)| edge) {
            *node = number[*node as usize];
        }
        self
    }
}
