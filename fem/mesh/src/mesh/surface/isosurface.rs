//! Zero isosurface of values on a regular grid, by the method of tetrahedral cells.
//!
//! Each cell of the grid is divided into six tetrahedra around its diagonal. In each tetrahedron the surface consists
//! of one or two triangles. Unlike marching cubes, this method has no ambiguous cells: the surface is closed, and
//! each edge belongs to two triangles.
//!
//! # Reference
//! A. Doi, A. Koide, "An efficient method of triangulating equi-valued surfaces by using tetrahedral cells", IEICE
//! Trans. E74 (1991) 214–224.

use std::collections::HashMap;

use super::Surface;

/// Smallest distance of a surface point from both ends of its grid edge, relative to the length of the edge. This
/// minimum prevents degenerate triangles.
const LEAST_SHARE: f64 = 0.05;
/// The six tetrahedra of a cell. The corners of a tetrahedron are the corners on a path of three edges from the lowest
/// corner of the cell to the highest corner. An entry contains the order of the axes along the path, and whether the
/// volume of the tetrahedron is positive.
const PATHS: [([usize; 3], bool); 6] = [
    ([0, 1, 2], true),
    ([1, 2, 0], true),
    ([2, 0, 1], true),
    ([0, 2, 1], false),
    ([2, 1, 0], false),
    ([1, 0, 2], false),
];
/// Even permutations of the four corners of a tetrahedron; entry k begins with corner k.
const FIRST: [[usize; 4]; 4] = [[0, 1, 2, 3], [1, 0, 3, 2], [2, 3, 0, 1], [3, 2, 1, 0]];
/// Even permutations of the four corners of a tetrahedron; each entry begins with a different pair of corners.
const PAIRS: [[usize; 4]; 6] =
    [[0, 1, 2, 3], [0, 2, 3, 1], [0, 3, 1, 2], [1, 2, 0, 3], [1, 3, 2, 0], [2, 3, 0, 1]];

/// Returns the surface that encloses all negative values of a grid, in units of grid cells, relative to the first grid
/// point. Values outside the grid count as positive. Therefore, where a value on the boundary of the grid is negative,
/// the surface lies half a cell outside the grid.
pub(crate) fn isosurface(size: [usize; 3], value: &dyn Fn([usize; 3]) -> f64) -> Surface {
    // the grid is padded by one layer on each side with copies of its outermost values, which an empty grid does not
    // have
    if size.contains(&0) {
        return Surface::default();
    }
    let padded = size.map(|n| n + 2);
    let index = |[x, y, z]: [usize; 3]| x + padded[0] * (y + padded[1] * z);
    let mut points = Points { on_edges: HashMap::new(), surface: Surface::default(), padded };
    let mut values = Vec::with_capacity(padded.iter().product());
    for z in 0..padded[2] {
        for y in 0..padded[1] {
            for x in 0..padded[0] {
                let at = [x, y, z];
                let nearest = std::array::from_fn(|k| at[k].clamp(1, size[k]) - 1);
                let is_outside = (0..3).any(|k| nearest[k] + 1 != at[k]);
                let nearest_value = value(nearest);
                values.push(if is_outside { nearest_value.abs() } else { nearest_value });
            }
        }
    }
    for z in 0..padded[2] - 1 {
        for y in 0..padded[1] - 1 {
            for x in 0..padded[0] - 1 {
                let corner = |bits: usize| {
                    let at = index([x + (bits & 1), y + (bits >> 1 & 1), z + (bits >> 2)]);
                    (at, values[at])
                };
                let inside = (0..8).filter(|&bits| corner(bits).1 < 0.0).count();
                if inside == 0 || inside == 8 {
                    continue;
                }
                for ([first, second, _], is_positive) in PATHS {
                    let bits = [0, 1 << first, (1 << first) | (1 << second), 7];
                    points.tetrahedron(bits.map(corner), is_positive);
                }
            }
        }
    }
    points.surface
}

/// The surface under construction and the grid edges on which its points lie.
struct Points {
    /// Index of the surface point on each grid edge. An edge is given by the two indices of its ends in the padded
    /// grid.
    on_edges: HashMap<[usize; 2], u32>,
    surface: Surface,
    /// Size of the padded grid.
    padded: [usize; 3],
}

impl Points {
    /// Returns the index of the surface point on a grid edge. Each end of the edge is given by its grid index and its
    /// value.
    fn on_edge(&mut self, a: (usize, f64), b: (usize, f64)) -> u32 {
        let [low, high] = if a.0 < b.0 { [a, b] } else { [b, a] };
        let share = (low.1 / (low.1 - high.1)).clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
        let [nx, ny, _] = self.padded;
        let at =
            |index: usize| [index % nx, index / nx % ny, index / nx / ny].map(|k| k as f64 - 1.0);
        let surface = &mut self.surface;
        *self.on_edges.entry([low.0, high.0]).or_insert_with(|| {
            let (from, to) = (at(low.0), at(high.0));
            surface.points.push(std::array::from_fn(|k| from[k] + share * (to[k] - from[k])));
            surface.points.len() as u32 - 1
        })
    }

    /// Adds the triangles inside a tetrahedron, given the grid index and the value of each corner.
    fn tetrahedron(&mut self, corners: [(usize, f64); 4], is_positive: bool) {
        let is_inside = corners.map(|(_, value)| value < 0.0);
        let inside = is_inside.iter().filter(|&&is| is).count();
        let add = |points: &mut Points, [a, b, c]: [u32; 3], is_outward: bool| {
            points.surface.triangles.push(if is_outward { [a, b, c] } else { [a, c, b] });
        };
        match inside {
            1 | 3 => {
                let alone = is_inside.iter().position(|&is| is == (inside == 1)).unwrap_or(0);
                let [a, b, c, d] = FIRST[alone].map(|k| corners[k]);
                let triangle = [self.on_edge(a, b), self.on_edge(a, c), self.on_edge(a, d)];
                add(self, triangle, is_positive == (inside == 1));
            }
            2 => {
                let is_pair = |order: &&[usize; 4]| is_inside[order[0]] && is_inside[order[1]];
                let order = PAIRS.iter().find(is_pair).unwrap_or(&PAIRS[0]);
                let [a, b, c, d] = order.map(|k| corners[k]);
                let [ac, ad] = [self.on_edge(a, c), self.on_edge(a, d)];
                let [bd, bc] = [self.on_edge(b, d), self.on_edge(b, c)];
                add(self, [ac, ad, bd], is_positive);
                add(self, [ac, bd, bc], is_positive);
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::mesh::vector::{dot, norm, sub};

    /// Returns the signed distance of a grid point from a sphere.
    fn ball(centre: [f64; 3], radius: f64) -> impl Fn([usize; 3]) -> f64 {
        move |at| norm(sub(at.map(|k| k as f64), centre)) - radius
    }

    #[test]
    fn the_surface_of_a_ball_is_closed_and_oriented_and_second_order_accurate() {
        let mut errors = Vec::new();
        for n in [24_usize, 48] {
            let (centre, radius) =
                ([0.49 * n as f64, 0.51 * n as f64, 0.5 * n as f64], 0.3 * n as f64);
            let surface = isosurface([n; 3], &ball(centre, radius));
            assert_eq!(surface.open_edges(), 0);
            assert_eq!(surface.parts().len(), 1);
            let edges = 3 * surface.triangles.len() / 2;
            assert_eq!(surface.points.len() + surface.triangles.len(), edges + 2, "Euler");
            for triangle in 0..surface.triangles.len() {
                let [a, b, c] = surface.corners(triangle);
                let normal = crate::mesh::vector::cross(sub(b, a), sub(c, a));
                assert!(dot(normal, sub(a, centre)) > 0.0);
            }
            errors.push(1.0 - surface.volume() / (4.0 / 3.0 * PI * radius.powi(3)));
        }
        assert!(errors[0] > 0.0 && errors[0] < 0.01, "{errors:?}");
        assert!(errors[1] < 0.35 * errors[0], "{errors:?}");
    }

    #[test]
    fn surfaces_cut_by_the_frame_or_touching_at_edges_are_closed() {
        // a ball centred at a corner of the grid: on three sides, the surface is half a cell outside the grid and has
        // chamfered edges
        let surface = isosurface([12; 3], &ball([0.0; 3], 8.0));
        assert_eq!(surface.open_edges(), 0);
        let expected = PI / 6.0 * 512.0 + 1.5 * PI / 4.0 * 64.0 + 0.75 * 8.0 + 0.125;
        assert!((surface.volume() / expected - 1.0).abs() < 0.07, "{}", surface.volume());
        // a checkerboard: the cubes of negative values meet only at edges and corners
        let board = |at: [usize; 3]| if at.iter().sum::<usize>() % 2 == 0 { -1.0 } else { 1.0 };
        let surface = isosurface([5; 3], &board);
        assert_eq!(surface.open_edges(), 0);
        assert!(surface.volume() > 0.0);
        let mut passes: HashMap<[u32; 2], usize> = HashMap::new();
        for &[a, b, c] in &surface.triangles {
            for [p, q] in [[a, b], [b, c], [c, a]] {
                *passes.entry([p.min(q), p.max(q)]).or_default() += 1;
            }
        }
        assert!(passes.values().all(|&count| count == 2), "an edge does not have two triangles");
    }
}
