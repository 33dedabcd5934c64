//! Signed distance to a closed triangle surface, by a tree of bounding boxes.
//!
//! # References
//! J. A. Bærentzen, H. Aanæs, "Signed distance computation using the angle weighted pseudonormal", IEEE
//! Trans. Vis. Comput. Graph. 11 (2005) 243–253, doi:10.1109/TVCG.2005.49.

use std::collections::HashMap;

use crate::mesh::Surface;
use crate::mesh::triangle::{Feature, nearest};
use crate::mesh::vector::{Point, add, cross, dot, norm, scale, sub};

/// Largest number of triangles in a leaf of the tree.
const LEAF: usize = 4;

/// The triangles of a surface, and a tree of their bounding boxes. Each triangle has pseudonormals, which determine the
/// sign of the distance.
#[derive(Clone, Debug)]
pub(super) struct TriangleTree {
    triangles: Vec<Triangle>,
    /// Bounding boxes in depth-first order.
    nodes: Vec<Node>,
}

/// A triangle with the pseudonormals of its face, edges and corners.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub(super) corners: [Point; 3],
    /// Normal of the face.
    face: Point,
    /// Pseudonormals of the edges 01, 12, 20.
    edges: [Point; 3],
    /// Angle-weighted pseudonormals of the corners.
    at_corners: [Point; 3],
}

/// A box of the tree, with its two child boxes or, for a leaf, its triangles.
pub(super) struct TreePart<'a> {
    pub(super) bounds: [Point; 2],
    /// Indices of the two child boxes; `None` for a leaf.
    pub(super) children: Option<[usize; 2]>,
    /// Triangles of a leaf; empty for a box with children.
    pub(super) triangles: &'a [Triangle],
}

/// A bounding box. In a leaf, `first` is the index of the first triangle. In a box with children, `first` is the index
/// of the second child; the first child is the next node.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: Point,
    high: Point,
    first: u32,
    /// Number of triangles of a leaf; 0 for a box with children.
    count: u32,
}

impl TriangleTree {
    /// Builds the tree of a closed surface whose normals point outwards.
    pub(super) fn new(surface: &Surface) -> TriangleTree {
        let unit = |v: Point| {
            let length = norm(v);
            if length > 0.0 { scale(v, 1.0 / length) } else { [0.0; 3] }
        };
        let at = |corner: u32| surface.points[corner as usize];
        let mut of_edge: HashMap<[u32; 2], Point> = HashMap::new();
        let mut of_corner = vec![[0.0; 3]; surface.points.len()];
        let normal = |t: &[u32; 3]| {
            let [a, b, c] = t.map(at);
            unit(cross(sub(b, a), sub(c, a)))
        };
        for t in &surface.triangles {
            let face = normal(t);
            for k in 0..3 {
                let [p, q, r] = [0, 1, 2].map(|i| t[(k + i) % 3]);
                let edge = of_edge.entry([p.min(q), p.max(q)]).or_default();
                *edge = add(*edge, face);
                let (u, v) = (sub(at(q), at(p)), sub(at(r), at(p)));
                let angle = norm(cross(u, v)).atan2(dot(u, v));
                of_corner[p as usize] = add(of_corner[p as usize], scale(face, angle));
            }
        }
        let triangle = |t: &[u32; 3]| Triangle {
            corners: t.map(at),
            face: normal(t),
            edges: std::array::from_fn(|k| {
                let (p, q) = (t[k], t[(k + 1) % 3]);
                of_edge[&[p.min(q), p.max(q)]]
            }),
            at_corners: t.map(|corner| of_corner[corner as usize]),
        };
        let triangles = surface.triangles.iter().map(triangle).collect();
        let mut tree = TriangleTree { triangles, nodes: Vec::new() };
        tree.divide(0, surface.triangles.len());
        tree
    }

    /// Returns the minimum and maximum coordinates of the surface.
    pub(super) fn bounds(&self) -> [Point; 2] {
        self.nodes.first().map_or([[0.0; 3]; 2], |root| [root.low, root.high])
    }

    /// Returns the box with the given index (0 for the root), or `None` if there is no such box.
    pub(super) fn part(&self, index: usize) -> Option<TreePart<'_>> {
        let node = self.nodes.get(index)?;
        let (first, count) = (node.first as usize, node.count as usize);
        let is_leaf = count > 0 || self.triangles.is_empty();
        Some(TreePart {
            bounds: [node.low, node.high],
            children: (!is_leaf).then_some([index + 1, first]),
            triangles: if is_leaf { &self.triangles[first..first + count] } else { &[] },
        })
    }

    /// Builds the tree of a range of triangles and appends its boxes to `nodes` in depth-first order.
    fn divide(&mut self, from: usize, to: usize) {
        let part = &mut self.triangles[from..to];
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for point in part.iter().flat_map(|t| t.corners) {
            low = std::array::from_fn(|k| low[k].min(point[k]));
            high = std::array::from_fn(|k| high[k].max(point[k]));
        }
        let node = self.nodes.len();
        let count = if part.len() <= LEAF { part.len() as u32 } else { 0 };
        self.nodes.push(Node { low, high, first: from as u32, count });
        if part.len() <= LEAF {
            return;
        }
        let widest = (0..3).max_by(|&a, &b| (high[a] - low[a]).total_cmp(&(high[b] - low[b])));
        let axis = widest.unwrap_or(0);
        let centre = |t: &Triangle| t.corners.iter().map(|p| p[axis]).sum::<f64>();
        let half = part.len() / 2;
        part.select_nth_unstable_by(half, |a, b| centre(a).total_cmp(&centre(b)));
        self.divide(from, from + half);
        self.nodes[node].first = self.nodes.len() as u32;
        self.divide(from + half, to);
    }

    /// Returns the signed distance of a point (negative inside) and its gradient, or `None` if the distance is not
    /// below `limit`.
    pub(super) fn below(&self, x: Point, limit: f64) -> Option<(f64, Point)> {
        let mut best = (f64::INFINITY, x, [0.0; 3]);
        let mut stack = vec![0_usize];
        while let Some(index) = stack.pop() {
            let Some(node) = self.nodes.get(index) else { break };
            if node.distance(x) >= best.0 {
                continue;
            }
            if node.count > 0 {
                let first = node.first as usize;
                for triangle in &self.triangles[first..first + node.count as usize] {
                    let (point, normal) = triangle.nearest(x);
                    let distance = norm(sub(x, point));
                    if distance < best.0 {
                        best = (distance, point, normal);
                    }
                }
                continue;
            }
            let mut children = [index + 1, node.first as usize];
            if self.nodes[children[0]].distance(x) < self.nodes[children[1]].distance(x) {
                children.swap(0, 1);
            }
            stack.extend(children);
        }
        let (distance, point, normal) = best;
        let away = sub(x, point);
        let sign = if dot(away, normal) < 0.0 { -1.0 } else { 1.0 };
        let gradient = match distance > 0.0 {
            true => scale(away, sign / distance),
            false => scale(normal, 1.0 / norm(normal)),
        };
        (sign * distance < limit).then_some((sign * distance, gradient))
    }
}

impl Node {
    /// Returns the distance of a point from the box; 0 inside.
    fn distance(&self, x: Point) -> f64 {
        let outside: Point =
            std::array::from_fn(|k| (self.low[k] - x[k]).max(x[k] - self.high[k]).max(0.0));
        norm(outside)
    }
}

impl Triangle {
    /// Returns the point of a triangle with the given corners that is nearest to `x`.
    pub(super) fn nearest_point(corners: [Point; 3], x: Point) -> Point {
        nearest(corners, x).0
    }

    /// Returns the point of the triangle nearest to `x`, and the pseudonormal of the face, edge or corner that contains
    /// this point.
    fn nearest(&self, x: Point) -> (Point, Point) {
        let (point, feature) = nearest(self.corners, x);
        let pseudonormal = match feature {
            Feature::Face => self.face,
            Feature::Edge(edge) => self.edges[edge],
            Feature::Corner(corner) => self.at_corners[corner],
        };
        (point, pseudonormal)
    }
}
