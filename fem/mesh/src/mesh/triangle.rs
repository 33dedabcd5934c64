//! The point of a triangle that is nearest to another point.
//!
//! Reference: C. Ericson, "Real-time collision detection", Morgan Kaufmann (2005), section 5.1.5.

use super::vector::{Point, add, dot, scale, sub};

/// Part of a triangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Feature {
    Face,
    /// Edge 01, 12 or 20.
    Edge(usize),
    Corner(usize),
}

/// Returns the point of a triangle nearest to `x`, and the part of the triangle that contains this point.
pub(crate) fn nearest([a, b, c]: [Point; 3], x: Point) -> (Point, Feature) {
    let (ab, ac, ax) = (sub(b, a), sub(c, a), sub(x, a));
    let (d1, d2) = (dot(ab, ax), dot(ac, ax));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (a, Feature::Corner(0));
    }
    let bx = sub(x, b);
    let (d3, d4) = (dot(ab, bx), dot(ac, bx));
    if d3 >= 0.0 && d4 <= d3 {
        return (b, Feature::Corner(1));
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (add(a, scale(ab, d1 / (d1 - d3))), Feature::Edge(0));
    }
    let cx = sub(x, c);
    let (d5, d6) = (dot(ab, cx), dot(ac, cx));
    if d6 >= 0.0 && d5 <= d6 {
        return (c, Feature::Corner(2));
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (add(a, scale(ac, d2 / (d2 - d6))), Feature::Edge(2));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let share = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return (add(b, scale(sub(c, b), share)), Feature::Edge(1));
    }
    let sum = va + vb + vc;
    (add(a, add(scale(ab, vb / sum), scale(ac, vc / sum))), Feature::Face)
}
