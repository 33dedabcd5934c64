//! Grains as convex polyhedra, bounded by random facets and by radical planes between neighbouring grains.

use std::collections::HashMap;
use std::f64::consts::PI;

use rand::Rng;
use rand_distr::{Distribution, UnitSphere};
use rayon::prelude::*;

use super::relax::Spheres;
use crate::mesh::vector::{Point, add, dot, norm, scale, sub};
use crate::specimen::grains::{ConvexPolyhedron, Grain, GrainShape};

/// Number of random directions that are drawn per facet. The direction that is farthest from the previous facets is
/// chosen.
const CANDIDATES: usize = 8;
/// Range of the distances of facets from the centre, relative to the radius of the sphere.
const FACET: std::ops::Range<f64> = 0.8..1.0;
/// Number of sides of a prism that is inscribed in the cylinder and contains all polyhedra.
const WALL: usize = 64;
/// The search for the growth factor of the facets ends when its interval is narrower than this width.
const TOLERANCE: f64 = 1e-9;
/// Maximum number of steps of the Illinois method, which narrows the interval before the bisection.
const MOST_STEPS: usize = 20;
/// Largest factor by which the distances of facets from the centre are multiplied to reach the requested volume.
const MOST_GROWTH: f64 = 4.0;

/// Facets of one grain. Each facet is given by its unit normal and its distance from the centre.
type Facets = Vec<(Point, f64)>;

/// Draws random facets for every sphere.
pub(super) fn draw_facets<R: Rng>(radii: &[f64], facets: usize, rng: &mut R) -> Vec<Facets> {
    radii
        .iter()
        .map(|radius| {
            let mut drawn: Facets = Vec::with_capacity(facets);
            for _ in 0..facets {
                let nearest = |u: Point| drawn.iter().map(|&(n, _)| dot(n, u)).fold(-1.0, f64::max);
                let mut best: Point = UnitSphere.sample(rng);
                for _ in 1..CANDIDATES {
                    let other: Point = UnitSphere.sample(rng);
                    if nearest(other) < nearest(best) {
                        best = other;
                    }
                }
                drawn.push((best, radius * rng.random_range(FACET)));
            }
            drawn
        })
        .collect()
}

/// Scales the distances of all facets by one factor so that the polyhedra have the requested total volume.
///
/// Two neighbours stay on different sides of their radical plane, each at least half a gap away from the plane.
/// Therefore they cannot overlap. If the requested volume cannot be reached, the error is the largest possible volume
/// (mm³).
pub(super) fn grow(spheres: &Spheres, facets: &[Facets], volume: f64) -> Result<Vec<Grain>, f64> {
    let missing = |growth: f64| {
        volume - polyhedra(spheres, facets, growth).iter().map(Grain::volume_mm3).sum::<f64>()
    };
    let most = volume - missing(MOST_GROWTH);
    if most < volume {
        return Err(most);
    }
    let [too_small, large_enough] = bracket(missing, [0.0, MOST_GROWTH], [volume, volume - most]);
    // the bisection starts from the whole interval, so that its result does not depend on the bracket; outside the
    // bracket, the sign is known without the construction of polyhedra
    let (mut low, mut high) = (0.0, MOST_GROWTH);
    let mut middle = 0.5 * (low + high);
    while high - low > TOLERANCE {
        middle = 0.5 * (low + high);
        if middle <= too_small || middle < large_enough && missing(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    Ok(polyhedra(spheres, facets, middle))
}

/// Narrows an interval around the root of a decreasing function to about [`TOLERANCE`], by the Illinois method and one
/// evaluation at a distance of [`TOLERANCE`] from each end. `ends` are the ends of the interval, `values` the values of
/// the function at the ends.
///
/// # Reference
/// M. Dowell, P. Jarratt, "A modified regula falsi method for computing the root of an equation", BIT 11 (1971)
/// 168–174, doi:10.1007/BF01934364.
fn bracket(value: impl Fn(f64) -> f64, mut ends: [f64; 2], mut values: [f64; 2]) -> [f64; 2] {
    let mut last = None;
    for _ in 0..MOST_STEPS {
        let [[a, b], [fa, fb]] = [ends, values];
        let root = (a * fb - b * fa) / (fb - fa);
        if !(root > a && root < b) {
            break;
        }
        let root_value = value(root);
        let side = usize::from(root_value <= 0.0);
        let step = (root - ends[side]).abs();
        (ends[side], values[side]) = (root, root_value);
        if last == Some(side) {
            values[1 - side] *= 0.5;
        }
        last = Some(side);
        if step < 0.1 * TOLERANCE {
            break;
        }
    }
    for beside in [ends[0] + TOLERANCE, ends[1] - TOLERANCE] {
        if beside > ends[0] && beside < ends[1] {
            ends[usize::from(value(beside) <= 0.0)] = beside;
        }
    }
    ends
}

/// Returns the polyhedra that replace the spheres; the distances of the facets are multiplied by `growth`.
fn polyhedra(spheres: &Spheres, facets: &[Facets], growth: f64) -> Vec<Grain> {
    let half = 0.5 * spheres.gap;
    let near = Near::new(spheres);
    facets
        .par_iter()
        .enumerate()
        .map(|(i, facets)| {
            let (centre, radius) = (spheres.centres[i], spheres.radii[i]);
            let mut body = ConvexPolyhedron::cube(centre, 1.5 * radius * growth);
            for &(normal, distance) in facets {
                body.cut(normal, dot(normal, centre) + growth * distance);
            }
            body.cut([0.0, 0.0, -1.0], -half);
            body.cut([0.0, 0.0, 1.0], spheres.cylinder_height - half);
            cut_wall(&mut body, centre, spheres.cylinder_radius - half);
            near.cut(&mut body, spheres, i);
            Grain { centre, shape: GrainShape::Polyhedron(body) }
        })
        .collect()
}

/// Cuts a polyhedron with the sides of the prism inscribed in the cylinder.
fn cut_wall(body: &mut ConvexPolyhedron, centre: Point, radius: f64) {
    if centre[0].hypot(centre[1]) + body.reach(centre) < radius * (PI / WALL as f64).cos() {
        return;
    }
    for k in 0..WALL {
        let angle = 2.0 * PI * k as f64 / WALL as f64;
        body.cut([angle.cos(), angle.sin(), 0.0], radius * (PI / WALL as f64).cos());
    }
}

/// Spatial index of the spheres: a grid of cells.
struct Near {
    /// Edge length of a cell (mm).
    width: f64,
    /// Radius of the largest sphere (mm).
    largest: f64,
    cells: HashMap<[i64; 3], Vec<usize>>,
}

impl Near {
    fn new(spheres: &Spheres) -> Near {
        let largest = spheres.radii.iter().copied().fold(0.0, f64::max);
        let volume = spheres.cylinder_radius.powi(2) * spheres.cylinder_height;
        let width = (volume / spheres.radii.len() as f64).cbrt();
        let mut near = Near { width, largest, cells: HashMap::new() };
        for (i, &centre) in spheres.centres.iter().enumerate() {
            near.cells.entry(near.cell(centre)).or_default().push(i);
        }
        near
    }

    fn cell(&self, point: Point) -> [i64; 3] {
        point.map(|x| (x / self.width).floor() as i64)
    }

    /// Cuts the polyhedron of sphere `i` with the radical planes between this sphere and its neighbours. All points of
    /// a radical plane have the same power with respect to both spheres. Each plane is moved towards the sphere by half
    /// the gap.
    fn cut(&self, body: &mut ConvexPolyhedron, spheres: &Spheres, i: usize) {
        let (centre, radius) = (spheres.centres[i], spheres.radii[i]);
        let mut reach = body.reach(centre);
        // the radical plane to a sphere whose distance exceeds `far` does not intersect the polyhedron
        let edge = reach + 0.5 * spheres.gap;
        let far = edge + (edge * edge + self.largest * self.largest).sqrt();
        let (low, high) = (self.cell(centre.map(|x| x - far)), self.cell(centre.map(|x| x + far)));
        let mut others: Vec<usize> = Vec::new();
        for a in low[0]..=high[0] {
            for b in low[1]..=high[1] {
                for c in low[2]..=high[2] {
                    others.extend(self.cells.get(&[a, b, c]).into_iter().flatten());
                }
            }
        }
        others.sort_unstable();
        for j in others.into_iter().filter(|&j| j != i) {
            let apart = sub(spheres.centres[j], centre);
            let distance = norm(apart);
            let plane = (distance * distance + radius * radius - spheres.radii[j].powi(2))
                / (2.0 * distance)
                - 0.5 * spheres.gap;
            if plane < reach {
                let normal = scale(apart, 1.0 / distance);
                if body.cut(normal, dot(normal, add(centre, scale(normal, plane)))) {
                    reach = body.reach(centre);
                }
            }
        }
    }
}
