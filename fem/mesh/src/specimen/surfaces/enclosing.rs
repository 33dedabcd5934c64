//! Smallest enclosing cylinder of a set of grains.
//!
//! # Reference
//! E. Welzl, "Smallest enclosing disks (balls and ellipsoids)", LNCS 555 (1991) 359–370, doi:10.1007/BFb0038202;
//! implemented with three nested loops, as in M. de Berg et al., "Computational geometry", Springer (2008), section
//! 4.7.

use fem_image::Cylinder;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::mesh::Surface;

/// Relative tolerance of the radius in the test whether a point lies in a circle.
const ROUNDING: f64 = 1e-12;

/// Returns the smallest cylinder with axis along z that contains all points of the surfaces, enlarged by `margin_mm`
/// on each side, or `None` if the surfaces have no points.
///
/// # Example
/// ```
/// use fem_mesh::{CylinderLattice, Surface, enclosing_cylinder, stl};
///
/// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.7 }.build()?;
/// let surface = Surface::new(&stl::specimen(&mesh));
/// let cylinder = enclosing_cylinder(&[surface], 0.1).unwrap();
/// assert!((cylinder.radius_mm - 2.6).abs() < 1e-9 && (cylinder.height_mm() - 4.6).abs() < 1e-9);
/// # Ok::<(), fem_mesh::LatticeError>(())
/// ```
pub fn enclosing_cylinder(surfaces: &[Surface], margin_mm: f64) -> Option<Cylinder> {
    let points = || surfaces.iter().flat_map(|surface| &surface.points);
    let mut plan: Vec<[f64; 2]> = points().map(|&[x, y, _]| [x, y]).collect();
    // with the points in random order, the nested loops take linear time on average
    plan.shuffle(&mut Xoshiro256PlusPlus::seed_from_u64(1));
    let Circle { centre, radius } = least_circle(&plan)?;
    let bottom = points().map(|p| p[2]).fold(f64::INFINITY, f64::min);
    let top = points().map(|p| p[2]).fold(f64::NEG_INFINITY, f64::max);
    Some(Cylinder {
        centre_mm: centre,
        radius_mm: radius + margin_mm,
        bottom_mm: bottom - margin_mm,
        top_mm: top + margin_mm,
        lean: [0.0; 2],
    })
}

/// A circle (mm).
#[derive(Clone, Copy, Debug)]
struct Circle {
    centre: [f64; 2],
    radius: f64,
}

impl Circle {
    fn through_two(p: [f64; 2], q: [f64; 2]) -> Circle {
        let centre = [0.5 * (p[0] + q[0]), 0.5 * (p[1] + q[1])];
        Circle { centre, radius: distance(centre, p).max(distance(centre, q)) }
    }

    /// Returns the circle through three points. For collinear points, the longest distance between two points is the
    /// diameter of the circle.
    fn through(p: [f64; 2], q: [f64; 2], r: [f64; 2]) -> Circle {
        let ([ax, ay], [bx, by]) = ([q[0] - p[0], q[1] - p[1]], [r[0] - p[0], r[1] - p[1]]);
        let double = 2.0 * (ax * by - ay * bx);
        let (aa, bb) = (ax * ax + ay * ay, bx * bx + by * by);
        let centre = [p[0] + (by * aa - ay * bb) / double, p[1] + (ax * bb - bx * aa) / double];
        let radius = [p, q, r].map(|x| distance(centre, x)).into_iter().fold(0.0, f64::max);
        if radius.is_finite() && centre.iter().all(|x| x.is_finite()) {
            return Circle { centre, radius };
        }
        let pairs =
            [Circle::through_two(p, q), Circle::through_two(q, r), Circle::through_two(r, p)];
        pairs
            .into_iter()
            .fold(pairs[0], |most, next| if next.radius > most.radius { next } else { most })
    }

    fn holds(&self, x: [f64; 2]) -> bool {
        distance(self.centre, x) <= self.radius * (1.0 + ROUNDING)
    }
}

fn distance(p: [f64; 2], q: [f64; 2]) -> f64 {
    (p[0] - q[0]).hypot(p[1] - q[1])
}

/// Returns the smallest enclosing circle of the points, or `None` without points.
fn least_circle(points: &[[f64; 2]]) -> Option<Circle> {
    let mut circle = Circle { centre: *points.first()?, radius: 0.0 };
    for (i, &p) in points.iter().enumerate() {
        if circle.holds(p) {
            continue;
        }
        circle = Circle { centre: p, radius: 0.0 };
        for (j, &q) in points[..i].iter().enumerate() {
            if circle.holds(q) {
                continue;
            }
            circle = Circle::through_two(p, q);
            for &r in &points[..j] {
                if !circle.holds(r) {
                    circle = Circle::through(p, q, r);
                }
            }
        }
    }
    Some(circle)
}
