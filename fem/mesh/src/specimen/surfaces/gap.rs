//! Smallest distance between two closed surfaces; each surface may be scaled about a point.
//!
//! # Reference
//! C. Ericson, "Real-time collision detection", Morgan Kaufmann (2005), sections 5.1.9 (segments) and 5.3.6 (segment
//! and triangle).

use super::triangle_tree::{TreePart, Triangle, TriangleTree};
use crate::mesh::vector::{Point, add, cross, dot, norm, scale, sub};

/// A surface scaled about a point.
#[derive(Clone, Copy)]
pub(super) struct ScaledSurface<'a> {
    pub(super) tree: &'a TriangleTree,
    pub(super) centre: Point,
    pub(super) factor: f64,
}

impl ScaledSurface<'_> {
    fn scaled(&self, x: Point) -> Point {
        add(self.centre, scale(sub(x, self.centre), self.factor))
    }

    pub(super) fn bounds(&self) -> [Point; 2] {
        self.tree.bounds().map(|x| self.scaled(x))
    }

    /// Returns whether a point lies inside the scaled surface.
    fn holds(&self, x: Point) -> bool {
        let [low, high] = self.bounds();
        let in_box = (0..3).all(|k| x[k] >= low[k] && x[k] <= high[k]);
        let before = add(self.centre, scale(sub(x, self.centre), 1.0 / self.factor));
        in_box && self.tree.below(before, 0.0).is_some()
    }

    /// Returns any corner of the scaled surface, or `None` for a surface without triangles.
    fn a_corner(&self) -> Option<Point> {
        let mut index = 0;
        loop {
            let part = self.tree.part(index)?;
            match part.children {
                Some([first, _]) => index = first,
                None => return Some(self.scaled(part.triangles.first()?.corners[0])),
            }
        }
    }

    /// Returns the box of the tree with the given index (0 for the root), and its scaled bounds.
    fn part(&self, index: usize) -> Option<(TreePart<'_>, [Point; 2])> {
        let part = self.tree.part(index)?;
        let bounds = part.bounds.map(|x| self.scaled(x));
        Some((part, bounds))
    }
}

/// Accuracy of the search for the smallest distance.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Search {
    /// The search must find the smallest distance.
    Least,
    /// The search only decides whether the distance is below the limit. The returned distance need not be the smallest
    /// distance.
    Any,
}

/// Returns the smallest distance between two surfaces if the distance is below `limit`, otherwise `None`. The distance
/// is 0 if the surfaces intersect or one surface lies inside the other surface.
pub(super) fn gap_below(
    a: &ScaledSurface<'_>,
    b: &ScaledSurface<'_>,
    limit: f64,
    search: Search,
) -> Option<f64> {
    let mut best = limit;
    let mut stack = vec![(0_usize, 0_usize)];
    while let Some((first, second)) = stack.pop() {
        let (Some((one, one_bounds)), Some((other, other_bounds))) =
            (a.part(first), b.part(second))
        else {
            continue;
        };
        if box_gap(one_bounds, other_bounds) >= best {
            continue;
        }
        let size = |[low, high]: [Point; 2]| norm(sub(high, low));
        let pairs = match (one.children, other.children) {
            (Some([p, q]), Some(_)) if size(one_bounds) >= size(other_bounds) => {
                [(p, second), (q, second)]
            }
            (_, Some([p, q])) => [(first, p), (first, q)],
            (Some([p, q]), None) => [(p, second), (q, second)],
            (None, None) => {
                for triangle in one.triangles {
                    let corners = triangle.corners.map(|x| a.scaled(x));
                    for facing in other.triangles {
                        best = best.min(triangle_gap(
                            corners,
                            facing.corners.map(|x| b.scaled(x)),
                            best,
                        ));
                    }
                }
                if best == 0.0 || (best < limit && search == Search::Any) {
                    return Some(best);
                }
                continue;
            }
        };
        let distance = |&(p, q): &(usize, usize)| match (a.part(p), b.part(q)) {
            (Some((_, p_bounds)), Some((_, q_bounds))) => box_gap(p_bounds, q_bounds),
            _ => f64::INFINITY,
        };
        // push the closer pair of boxes last, so that this pair is visited first
        let is_sorted = distance(&pairs[0]) >= distance(&pairs[1]);
        stack.extend(if is_sorted { pairs } else { [pairs[1], pairs[0]] });
    }
    let lies_within = |inner: &ScaledSurface<'_>, outer: &ScaledSurface<'_>| {
        inner.a_corner().is_some_and(|corner| outer.holds(corner))
    };
    if lies_within(a, b) || lies_within(b, a) {
        return Some(0.0);
    }
    (best < limit).then_some(best)
}

/// Returns the distance between two boxes, given by minimum and maximum coordinates.
pub(super) fn box_gap([low, high]: [Point; 2], [other_low, other_high]: [Point; 2]) -> f64 {
    norm(std::array::from_fn(|k| (low[k] - other_high[k]).max(other_low[k] - high[k]).max(0.0)))
}

/// Returns the distance between two triangles, or `limit` if the distance is not smaller than `limit`.
fn triangle_gap(one: [Point; 3], other: [Point; 3], limit: f64) -> f64 {
    let bounds = |[a, b, c]: [Point; 3]| {
        let low = std::array::from_fn(|k| f64::min(a[k], b[k]).min(c[k]));
        let high = std::array::from_fn(|k| f64::max(a[k], b[k]).max(c[k]));
        [low, high]
    };
    if box_gap(bounds(one), bounds(other)) >= limit {
        return limit;
    }
    let mut least = limit;
    for (corners, facing) in [(one, other), (other, one)] {
        for k in 0..3 {
            let x = corners[k];
            least = least.min(norm(sub(x, Triangle::nearest_point(facing, x))));
            if pierces(x, corners[(k + 1) % 3], facing) {
                return 0.0;
            }
        }
    }
    for i in 0..3 {
        for j in 0..3 {
            let edge = [one[i], one[(i + 1) % 3]];
            least = least.min(segment_gap(edge, [other[j], other[(j + 1) % 3]]));
        }
    }
    least
}

/// Returns whether a segment intersects the interior of a triangle.
fn pierces(p: Point, q: Point, [a, b, c]: [Point; 3]) -> bool {
    let normal = cross(sub(b, a), sub(c, a));
    let (before, behind) = (dot(normal, sub(p, a)), dot(normal, sub(q, a)));
    if before * behind >= 0.0 {
        return false;
    }
    let x = add(p, scale(sub(q, p), before / (before - behind)));
    let side = |u: Point, v: Point| dot(normal, cross(sub(v, u), sub(x, u))) > 0.0;
    side(a, b) && side(b, c) && side(c, a)
}

/// Returns the distance between two segments.
fn segment_gap([p, p_end]: [Point; 2], [q, q_end]: [Point; 2]) -> f64 {
    let (d, e, r) = (sub(p_end, p), sub(q_end, q), sub(p, q));
    let (dd, ee, er) = (dot(d, d), dot(e, e), dot(e, r));
    let dr = dot(d, r);
    let at = |num: f64, den: f64| if den > 0.0 { (num / den).clamp(0.0, 1.0) } else { 0.0 };
    let de = dot(d, e);
    let mut s = at(de * er - dr * ee, dd * ee - de * de);
    let mut t = if ee > 0.0 { (de * s + er) / ee } else { 0.0 };
    if t < 0.0 {
        (s, t) = (at(-dr, dd), 0.0);
    } else if t > 1.0 {
        (s, t) = (at(de - dr, dd), 1.0);
    } else if ee == 0.0 {
        s = at(-dr, dd);
    }
    norm(sub(add(p, scale(d, s)), add(q, scale(e, t))))
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// Compares `triangle_gap` with the smallest distance between sample points of both triangles.
    #[test]
    fn the_gap_of_triangles_agrees_with_the_gap_of_sample_points() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let mut touching = 0;
        for _ in 0..200 {
            let mut triangle = |shift: f64| -> [Point; 3] {
                std::array::from_fn(|_| {
                    [random.random::<f64>() + shift, random.random(), random.random()]
                })
            };
            let (one, other) = (triangle(0.0), triangle(0.6));
            let gap = triangle_gap(one, other, f64::INFINITY);
            let n = 40;
            let points = |[a, b, c]: [Point; 3]| -> Vec<Point> {
                (0..=n)
                    .flat_map(|i| (0..=n - i).map(move |j| (i, j)))
                    .map(|(i, j)| {
                        let (u, v) = (i as f64 / n as f64, j as f64 / n as f64);
                        add(a, add(scale(sub(b, a), u), scale(sub(c, a), v)))
                    })
                    .collect()
            };
            let (own_points, facing) = (points(one), points(other));
            let sampled =
                own_points.iter().flat_map(|p| facing.iter().map(move |q| norm(sub(*p, *q))));
            let sampled = sampled.fold(f64::INFINITY, f64::min);
            assert!(
                gap <= sampled + 1e-12 && sampled - gap < 0.04,
                "{gap}, between sample points {sampled}"
            );
            touching += usize::from(gap == 0.0);
            assert_eq!(triangle_gap(one, other, 0.5 * gap), 0.5 * gap);
        }
        assert!(touching > 5 && touching < 150, "{touching}");
    }
}
