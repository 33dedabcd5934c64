//! Convex polyhedra constructed by cuts with planes.

use crate::mesh::vector::{Point, add, cross, dot, mean, norm, scale, sub};

/// Two points are identical if their distance is at most this factor times the size of the polyhedron.
const SAME: f64 = 1e-10;
/// Factor by which the distance to the bounding box is multiplied before it is compared with a limit. In spite of
/// rounding errors, the product does not exceed the distance to the polyhedron.
const ROUNDING: f64 = 1.0 - 1e-12;

/// A bounded convex polyhedron, stored as a list of faces.
///
/// A polyhedron starts as a cube and is cut by half-spaces. Volume, area and signed distance are exact up to
/// rounding.
///
/// # Example
/// ```
/// use fem_mesh::ConvexPolyhedron;
///
/// let mut half = ConvexPolyhedron::cube([0.0; 3], 1.0);
/// assert!(half.cut([1.0, 0.0, 0.0], 0.0));
/// assert!((half.volume() - 4.0).abs() < 1e-14);
/// assert!((half.signed_distance([2.0, 2.0, 0.0]) - 5.0_f64.sqrt()).abs() < 1e-14);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ConvexPolyhedron {
    faces: Vec<Facet>,
    /// Minimum and maximum coordinates of the corners.
    bounds: [Point; 2],
}

/// A face of a polyhedron.
#[derive(Clone, Debug, PartialEq)]
struct Facet {
    /// Outward unit normal n of the face.
    normal: Point,
    /// Offset d of the plane of the face: all points x of the body satisfy n · x ≤ d.
    offset: f64,
    /// Corners of the face, counter-clockwise seen from outside.
    corners: Vec<Point>,
}

impl ConvexPolyhedron {
    /// Creates an axis-aligned cube of edge length `2 * half_edge`.
    pub fn cube(centre: [f64; 3], half_edge: f64) -> ConvexPolyhedron {
        let mut faces = Vec::with_capacity(6);
        for axis in 0..3 {
            for sign in [-1.0, 1.0] {
                let mut normal = [0.0; 3];
                normal[axis] = sign;
                let mut corners: Vec<Point> = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
                    .map(|[a, b]| {
                        let mut corner = centre;
                        corner[axis] += sign * half_edge;
                        corner[(axis + 1) % 3] += a * half_edge;
                        corner[(axis + 2) % 3] += b * half_edge;
                        corner
                    })
                    .into();
                if sign < 0.0 {
                    corners.reverse();
                }
                let offset = sign * centre[axis] + half_edge;
                faces.push(Facet { normal, offset, corners });
            }
        }
        let bounds = [centre.map(|x| x - half_edge), centre.map(|x| x + half_edge)];
        ConvexPolyhedron { faces, bounds }
    }

    /// Intersects the polyhedron with the half-space `normal · x ≤ offset` (unit normal); returns whether a part
    /// was cut off.
    pub fn cut(&mut self, normal: [f64; 3], offset: f64) -> bool {
        let [low, high] = self.bounds;
        let farthest = std::array::from_fn(|k| if normal[k] > 0.0 { high[k] } else { low[k] });
        if self.faces.is_empty() || dot(normal, farthest) <= offset {
            return false;
        }
        let height = |p: Point| dot(normal, p) - offset;
        let same = SAME * (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max);
        if self.corners().all(|p| height(p) <= same) {
            return false;
        }
        let mut rim: Vec<Point> = Vec::new();
        for face in &mut self.faces {
            let old = std::mem::take(&mut face.corners);
            for (k, &p) in old.iter().enumerate() {
                let q = old[(k + 1) % old.len()];
                let (a, b) = (height(p), height(q));
                if a <= same {
                    face.corners.push(p);
                    if a >= -same {
                        rim.push(p);
                    }
                }
                if (a > same && b < -same) || (a < -same && b > same) {
                    let crossing = add(p, scale(sub(q, p), a / (a - b)));
                    face.corners.push(crossing);
                    rim.push(crossing);
                }
            }
        }
        self.faces.retain(|face| face.corners.len() >= 3);
        let corners = around(normal, rim, same);
        if corners.len() >= 3 {
            self.faces.push(Facet { normal, offset, corners });
        }
        self.bounds =
            self.corners().fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[a, b], p| {
                [std::array::from_fn(|k| a[k].min(p[k])), std::array::from_fn(|k| b[k].max(p[k]))]
            });
        true
    }

    /// Iterates over the corners of all faces; a corner is repeated for every face that contains it.
    pub(crate) fn corners(&self) -> impl Iterator<Item = Point> + '_ {
        self.faces.iter().flat_map(|face| face.corners.iter().copied())
    }

    /// Returns the number of faces.
    pub fn faces(&self) -> usize {
        self.faces.len()
    }

    /// Returns the largest distance of a corner from a point.
    pub fn reach(&self, from: [f64; 3]) -> f64 {
        self.corners().map(|p| norm(sub(p, from))).fold(0.0, f64::max)
    }

    /// Returns the volume of the polyhedron; 0 for an empty polyhedron.
    pub fn volume(&self) -> f64 {
        let Some(apex) = self.faces.first().map(|face| face.corners[0]) else { return 0.0 };
        // add up the volumes of pyramids that have a common apex and one face each as base
        self.faces
            .iter()
            .map(|face| (face.offset - dot(face.normal, apex)) * face.area() / 3.0)
            .sum()
    }

    /// Returns the surface area.
    pub fn area(&self) -> f64 {
        self.faces.iter().map(Facet::area).sum()
    }

    /// Returns the signed distance from a point to the surface, negative inside.
    pub fn signed_distance(&self, point: [f64; 3]) -> f64 {
        self.nearest_below(point, f64::INFINITY).map_or(f64::INFINITY, |(distance, _)| distance)
    }

    /// Returns the signed distance to the surface and its gradient. The result may be `None` if the distance is not
    /// less than `limit`.
    pub(crate) fn nearest_below(&self, point: Point, limit: f64) -> Option<(f64, Point)> {
        let [low, high] = self.bounds;
        let beside = |k: usize| (low[k] - point[k]).max(point[k] - high[k]).max(0.0);
        if limit > 0.0 && ROUNDING * norm([0, 1, 2].map(beside)) >= limit {
            return None;
        }
        let (mut highest, mut top) = (f64::NEG_INFINITY, self.faces.first()?);
        for face in &self.faces {
            let height = face.height(point);
            // return early: the distance to the plane of a face is a lower bound of the distance to the body
            if height >= limit {
                return None;
            }
            if height >= highest {
                (highest, top) = (height, face);
            }
        }
        if highest <= 0.0 {
            return Some((highest, top.normal));
        }
        // the nearest point of the body lies on a face whose outer side faces the point; in most cases, this is the
        // face whose plane is farthest from the point
        let (mut distance, mut foot) = top.nearest(point);
        if distance > highest {
            for face in &self.faces {
                let height = face.height(point);
                if height > 0.0 && height < distance {
                    let (other_distance, other_foot) = face.nearest(point);
                    if other_distance < distance {
                        (distance, foot) = (other_distance, other_foot);
                    }
                }
            }
        }
        let away = sub(point, foot);
        let length = norm(away);
        Some((distance, if length > 0.0 { scale(away, 1.0 / length) } else { top.normal }))
    }
}

impl Facet {
    fn height(&self, point: Point) -> f64 {
        dot(self.normal, point) - self.offset
    }

    fn edges(&self) -> impl Iterator<Item = (Point, Point)> + '_ {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().copied().zip(next.copied())
    }

    fn area(&self) -> f64 {
        let origin = self.corners[0];
        let twice =
            self.edges().map(|(a, b)| cross(sub(a, origin), sub(b, origin))).fold([0.0; 3], add);
        0.5 * norm(twice)
    }

    /// Returns the distance of a point from this polygon, and the nearest point of the polygon.
    fn nearest(&self, point: Point) -> (f64, Point) {
        let beside =
            |(a, b): (Point, Point)| dot(cross(self.normal, sub(b, a)), sub(point, a)) < 0.0;
        if !self.edges().any(beside) {
            let height = self.height(point);
            return (height.abs(), sub(point, scale(self.normal, height)));
        }
        let on_edge = |(a, b): (Point, Point)| {
            let edge = sub(b, a);
            let t = (dot(sub(point, a), edge) / dot(edge, edge)).clamp(0.0, 1.0);
            let foot = add(a, scale(edge, t));
            (norm(sub(point, foot)), foot)
        };
        let nearest = self.edges().map(on_edge).min_by(|a, b| a.0.total_cmp(&b.0));
        nearest.unwrap_or((f64::INFINITY, point))
    }
}

/// Sorts points counter-clockwise around a normal and removes duplicates.
fn around(normal: Point, points: Vec<Point>, same: f64) -> Vec<Point> {
    if points.len() < 3 {
        return Vec::new();
    }
    let centre = mean(points.iter().copied());
    // choose a coordinate axis that is not parallel to the normal, to construct a basis of the plane
    let smallest = (0..3).min_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs()));
    let mut start = [0.0; 3];
    start[smallest.unwrap_or(0)] = 1.0;
    let u = cross(normal, start);
    let v = cross(normal, u);
    let mut turned: Vec<(f64, Point)> = points
        .into_iter()
        .map(|p| (dot(v, sub(p, centre)).atan2(dot(u, sub(p, centre))), p))
        .collect();
    turned.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut corners: Vec<Point> = turned.into_iter().map(|(_, p)| p).collect();
    corners.dedup_by(|a, b| norm(sub(*a, *b)) <= same);
    while corners.len() > 1 && norm(sub(corners[0], corners[corners.len() - 1])) <= same {
        corners.pop();
    }
    corners
}
