//! Decimation of closed triangle surfaces by edge collapse in the order of the quadric error.
//!
//! # Reference
//! M. Garland, P. S. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 97, 209–216,
//! doi:10.1145/258734.258849.

use std::cmp::{Ordering, Reverse};
use std::collections::{BTreeSet, BinaryHeap};

use nalgebra::{Matrix3, Vector3};

use super::Surface;
use crate::mesh::vector::{Point, add, cross, dot, norm, scale, sub};

/// Minimum number of triangles of a decimated surface: the number of faces of an icosahedron.
const LEAST_TRIANGLES: usize = 20;
/// Weight of the squared distance of the new point from the midpoint of the edge, relative to the trace of the quadric.
/// In flat regions and along ridges the quadric is singular, so that this additional term determines the new point.
const MIDDLE: f64 = 1e-3;
/// A collapse is skipped if it would rotate the normal of a triangle by an angle whose cosine is below this value.
const LEAST_COSINE: f64 = 0.2;
/// A collapse is skipped if the shape measure of a triangle (1 for an equilateral triangle) would fall below this
/// value, unless the triangle already has a smaller shape measure.
const LEAST_SHAPE: f64 = 0.15;

/// Reduces the number of triangles of a surface by `factor`, but not below 20 triangles.
///
/// Edges collapse in the order of their quadric error. A collapse that would change the topology, flip a triangle or
/// create a very thin triangle is skipped. A closed surface therefore stays closed, but `factor` may not be reached.
/// Finally the surface is scaled about its centroid to its original volume. A factor of at most 1 returns the surface
/// unchanged.
///
/// # Example
/// ```
/// use fem_mesh::{CylinderLattice, Surface, decimated, stl};
///
/// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.4 }.build()?;
/// let surface = Surface::new(&stl::specimen(&mesh));
/// let coarse = decimated(&surface, 4.0);
/// assert_eq!(coarse.triangles.len(), surface.triangles.len() / 4);
/// assert_eq!(coarse.open_edges(), 0);
/// assert!((coarse.volume() / surface.volume() - 1.0).abs() < 1e-9);
/// # Ok::<(), fem_mesh::LatticeError>(())
/// ```
pub fn decimated(surface: &Surface, factor: f64) -> Surface {
    let all = surface.triangles.len();
    let target = ((all as f64 / factor) as usize).max(LEAST_TRIANGLES);
    if factor.is_nan() || factor <= 1.0 || target >= all {
        return surface.clone();
    }
    let mut collapse = Collapse::new(surface);
    collapse.run(target);
    let coarse = collapse.surface();
    let ratio = surface.volume() / coarse.volume();
    match ratio.is_finite() && ratio > 0.0 {
        true => coarse.scaled(ratio.cbrt()),
        false => surface.clone(),
    }
}

/// Quadric xᵀ A x + 2 b·x + c: the sum of the squared distances (mm²) of a point x from the planes of triangles,
/// weighted by the areas of the triangles (mm²).
#[derive(Clone, Copy, Debug)]
struct Quadric {
    a: Matrix3<f64>,
    b: Vector3<f64>,
    c: f64,
}

impl Quadric {
    const ZERO: Quadric = Quadric {
        a: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0),
        b: Vector3::new(0.0, 0.0, 0.0),
        c: 0.0,
    };

    fn of_triangle([p, q, r]: [Point; 3]) -> Quadric {
        let double = cross(sub(q, p), sub(r, p));
        let length = norm(double);
        if length == 0.0 {
            return Quadric::ZERO;
        }
        let normal = Vector3::from(scale(double, 1.0 / length));
        let (area, offset) = (0.5 * length, -normal.dot(&Vector3::from(p)));
        Quadric {
            a: area * normal * normal.transpose(),
            b: area * offset * normal,
            c: area * offset * offset,
        }
    }

    fn plus(&self, other: &Quadric) -> Quadric {
        Quadric { a: self.a + other.a, b: self.b + other.b, c: self.c + other.c }
    }

    /// Returns the point that replaces an edge, and the error of this point. The point minimises the quadric plus a
    /// small term that draws the point to the midpoint of the edge.
    fn minimum(&self, ends: [Point; 2]) -> (Point, f64) {
        let middle = Vector3::from(scale(add(ends[0], ends[1]), 0.5));
        let weight = MIDDLE * self.a.trace();
        let matrix = self.a + Matrix3::from_diagonal_element(weight);
        let solved = matrix.cholesky().map(|factor| factor.solve(&(weight * middle - self.b)));
        let x = solved.unwrap_or(middle);
        let error = x.dot(&(self.a * x)) + 2.0 * self.b.dot(&x) + self.c;
        // in flat regions the quadric error is zero; with the added term, the shortest edges collapse first
        let edge = sub(ends[1], ends[0]);
        (x.into(), error.max(0.0) + 1e-9 * self.a.trace() * dot(edge, edge))
    }
}

/// An edge that may collapse. `versions` are the versions of the end points at the time when the error was computed. A
/// candidate with outdated versions is skipped.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    error: f64,
    edge: [u32; 2],
    versions: [u32; 2],
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Candidate) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    fn cmp(&self, other: &Candidate) -> Ordering {
        let errors = self.error.total_cmp(&other.error);
        errors
            .then_with(|| self.edge.cmp(&other.edge))
            .then_with(|| self.versions.cmp(&other.versions))
    }
}

/// State of the decimation of a surface, in which edges collapse one after the other.
struct Collapse {
    /// Coordinates of the points relative to `origin`, because quadrics lose precision far from the origin.
    points: Vec<Point>,
    origin: Point,
    /// Corners of each triangle; `None` for a triangle that has collapsed.
    triangles: Vec<Option<[u32; 3]>>,
    /// Number of triangles that have not collapsed.
    remaining: usize,
    /// Indices of the triangles at each point.
    around: Vec<Vec<u32>>,
    quadrics: Vec<Quadric>,
    versions: Vec<u32>,
    /// Whether each point must not move, because the surface around this point is not a disc.
    is_locked: Vec<bool>,
    queue: BinaryHeap<Reverse<Candidate>>,
}

impl Collapse {
    fn new(surface: &Surface) -> Collapse {
        let origin = surface.points.first().copied().unwrap_or_default();
        let count = surface.points.len();
        let mut collapse = Collapse {
            points: surface.points.iter().map(|&p| sub(p, origin)).collect(),
            origin,
            triangles: surface.triangles.iter().copied().map(Some).collect(),
            remaining: surface.triangles.len(),
            around: vec![Vec::new(); count],
            quadrics: vec![Quadric::ZERO; count],
            versions: vec![0; count],
            is_locked: Vec::new(),
            queue: BinaryHeap::new(),
        };
        let mut edges = BTreeSet::new();
        for (number, &triangle) in (0..).zip(&surface.triangles) {
            let quadric = Quadric::of_triangle(collapse.corners(triangle));
            for k in 0..3 {
                let (p, q) = (triangle[k], triangle[(k + 1) % 3]);
                collapse.around[p as usize].push(number);
                collapse.quadrics[p as usize] = collapse.quadrics[p as usize].plus(&quadric);
                edges.insert([p.min(q), p.max(q)]);
            }
        }
        collapse.is_locked = (0..count as u32).map(|point| !collapse.is_disc(point)).collect();
        edges.into_iter().for_each(|edge| collapse.enqueue(edge));
        collapse
    }

    fn corners(&self, triangle: [u32; 3]) -> [Point; 3] {
        triangle.map(|corner| self.points[corner as usize])
    }

    fn triangles_at(&self, point: u32) -> impl Iterator<Item = (u32, [u32; 3])> {
        let around = self.around[point as usize].iter();
        around.filter_map(|&number| Some((number, self.triangles[number as usize]?)))
    }

    fn neighbours(&self, point: u32) -> BTreeSet<u32> {
        self.triangles_at(point).flat_map(|(_, t)| t).filter(|&other| other != point).collect()
    }

    /// Returns whether the surface around a point is a disc, i.e. whether the triangles at the point form one closed
    /// fan.
    fn is_disc(&self, point: u32) -> bool {
        let next: Vec<[u32; 2]> =
            self.triangles_at(point).map(|(_, t)| opposite(t, point)).collect();
        let Some(&[first, mut here]) = next.first() else { return false };
        let mut steps = 1;
        while here != first && steps <= next.len() {
            let mut on = next.iter().filter(|edge| edge[0] == here);
            let (Some(edge), None) = (on.next(), on.next()) else { return false };
            here = edge[1];
            steps += 1;
        }
        steps == next.len()
    }

    fn enqueue(&mut self, edge: [u32; 2]) {
        let [a, b] = edge.map(|end| end as usize);
        if self.is_locked[a] || self.is_locked[b] {
            return;
        }
        let quadric = self.quadrics[a].plus(&self.quadrics[b]);
        let (_, error) = quadric.minimum([self.points[a], self.points[b]]);
        let versions = [self.versions[a], self.versions[b]];
        self.queue.push(Reverse(Candidate { error, edge, versions }));
    }

    fn run(&mut self, target: usize) {
        while self.remaining > target {
            let Some(Reverse(Candidate { edge, versions, .. })) = self.queue.pop() else { return };
            let [a, b] = edge;
            if edge.map(|end| self.versions[end as usize]) != versions {
                continue;
            }
            let quadric = self.quadrics[a as usize].plus(&self.quadrics[b as usize]);
            let ends = edge.map(|end| self.points[end as usize]);
            let (merged, _) = quadric.minimum(ends);
            if self.keeps_topology(edge) && self.keeps_shape(edge, merged) {
                self.collapse(edge, merged, quadric);
                for other in self.neighbours(a) {
                    self.enqueue([a.min(other), a.max(other)]);
                }
            }
            debug_assert!(a < b);
        }
    }

    /// Checks the link condition, i.e. that a collapse of the edge does not change the topology: the ends of the edge
    /// have exactly two common neighbours, and these two neighbours are not joined by triangles at both ends.
    fn keeps_topology(&self, [a, b]: [u32; 2]) -> bool {
        let opposite_corners: BTreeSet<u32> = self
            .triangles_at(a)
            .filter(|(_, t)| t.contains(&b))
            .flat_map(|(_, t)| t.into_iter().filter(move |&corner| corner != a && corner != b))
            .collect();
        let common: BTreeSet<u32> =
            self.neighbours(a).intersection(&self.neighbours(b)).copied().collect();
        if opposite_corners.len() != 2 || common != opposite_corners {
            return false;
        }
        let joins = |end: u32| {
            self.triangles_at(end).any(|(_, t)| common.iter().all(|corner| t.contains(corner)))
        };
        !(joins(a) && joins(b))
    }

    /// Returns whether moving both ends to `target` neither flips a triangle nor creates a very thin triangle.
    fn keeps_shape(&self, [a, b]: [u32; 2], target: Point) -> bool {
        let keeps = |end: u32, other: u32| {
            self.triangles_at(end).filter(|(_, t)| !t.contains(&other)).all(|(_, t)| {
                let before = self.corners(t);
                let after = std::array::from_fn(|k| if t[k] == end { target } else { before[k] });
                let (old, new) = (double_area(before), double_area(after));
                let turns = dot(old, new) < LEAST_COSINE * norm(old) * norm(new);
                norm(new) > 0.0 && !turns && shape(after) >= LEAST_SHAPE.min(shape(before))
            })
        };
        keeps(a, b) && keeps(b, a)
    }

    /// Merges both ends of an edge into its first end, which moves to `target`.
    fn collapse(&mut self, [a, b]: [u32; 2], target: Point, quadric: Quadric) {
        let moved: Vec<(u32, [u32; 3])> = self.triangles_at(b).collect();
        for (number, triangle) in moved {
            if triangle.contains(&a) {
                self.triangles[number as usize] = None;
                self.remaining -= 1;
                continue;
            }
            let renamed = triangle.map(|corner| if corner == b { a } else { corner });
            self.triangles[number as usize] = Some(renamed);
            self.around[a as usize].push(number);
        }
        self.around[b as usize].clear();
        let triangles = &self.triangles;
        self.around[a as usize].retain(|&number| triangles[number as usize].is_some());
        self.points[a as usize] = target;
        self.quadrics[a as usize] = quadric;
        self.versions[a as usize] += 1;
        self.versions[b as usize] += 1;
    }

    fn surface(&self) -> Surface {
        let mut number = vec![None; self.points.len()];
        let mut surface = Surface::default();
        for triangle in self.triangles.iter().flatten() {
            let renamed = triangle.map(|corner| {
                *number[corner as usize].get_or_insert_with(|| {
                    surface.points.push(add(self.points[corner as usize], self.origin));
                    surface.points.len() as u32 - 1
                })
            });
            surface.triangles.push(renamed);
        }
        surface
    }
}

/// Returns the edge opposite to a corner, in the orientation of the triangle.
fn opposite([a, b, c]: [u32; 3], corner: u32) -> [u32; 2] {
    match corner {
        _ if corner == a => [b, c],
        _ if corner == b => [c, a],
        _ => [a, b],
    }
}

fn double_area([a, b, c]: [Point; 3]) -> Point {
    cross(sub(b, a), sub(c, a))
}

/// Returns the shape measure of a triangle: its area divided by the sum of the squared edges, scaled to 1 for an
/// equilateral triangle.
fn shape(corners: [Point; 3]) -> f64 {
    let [a, b, c] = corners;
    let squares: f64 = [sub(b, a), sub(c, b), sub(a, c)].into_iter().map(|e| dot(e, e)).sum();
    if squares > 0.0 { 2.0 * 3.0_f64.sqrt() * norm(double_area(corners)) / squares } else { 0.0 }
}
