//! Part of a tetrahedron on one side of a plane. The plane is a level set of a linear function, which is given by its
//! values at the vertices of the tetrahedron.

use crate::mesh::vector::{Point, add, scale, sub};

/// Number of halvings of the interval of levels in [`level_of`]; further halvings do not change a
/// double-precision number.
const HALVINGS: u32 = 60;

/// Returns the fraction of a tetrahedron's volume in which a linear function is below a level. `values` are the values
/// of the function at the vertices.
pub(super) fn fraction_below(values: [f64; 4], level: f64) -> f64 {
    let mut v = values;
    v.sort_unstable_by(f64::total_cmp);
    if level <= v[0] {
        return 0.0;
    }
    if level >= v[3] {
        return 1.0;
    }
    // position of the level on the edge between the vertices i and j, as a fraction of the edge from i
    let cut = |i: usize, j: usize| (level - v[i]) / (v[j] - v[i]);
    if level < v[1] {
        return cut(0, 1) * cut(0, 2) * cut(0, 3);
    }
    if level >= v[2] {
        // the part above the level is a tetrahedron at vertex 3: subtract its fraction from 1
        return 1.0 - (1.0 - cut(0, 3)) * (1.0 - cut(1, 3)) * (1.0 - cut(2, 3));
    }
    // the part below the level is a wedge with the edge 01, divided into three tetrahedra
    let [a, b, c, d] = [cut(0, 2), cut(0, 3), cut(1, 2), cut(1, 3)];
    c * d + a * (1.0 - c) * d + a * b * (1.0 - d)
}

/// Returns the level below which a linear function is in the fraction `fraction` of a tetrahedron's volume.
pub(super) fn level_of(values: [f64; 4], fraction: f64) -> f64 {
    let mut low = values.into_iter().fold(f64::INFINITY, f64::min);
    let mut high = values.into_iter().fold(f64::NEG_INFINITY, f64::max);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if fraction_below(values, middle) < fraction { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

/// Returns triangles that cover the intersection of a tetrahedron with the plane on which a linear function has the
/// value `level`.
pub(super) fn section(corners: [Point; 4], values: [f64; 4], level: f64) -> Vec<[Point; 3]> {
    let mut order = [0, 1, 2, 3];
    order.sort_by(|&i, &j| values[i].total_cmp(&values[j]));
    let (v, x) = (order.map(|i| values[i]), order.map(|i| corners[i]));
    let cut = |i: usize, j: usize| {
        let share = (level - v[i]) / (v[j] - v[i]);
        add(x[i], scale(sub(x[j], x[i]), share))
    };
    match v.iter().filter(|value| **value < level).count() {
        1 => vec![[cut(0, 1), cut(0, 2), cut(0, 3)]],
        2 => {
            let [a, b, c, d] = [cut(0, 2), cut(0, 3), cut(1, 3), cut(1, 2)];
            vec![[a, b, c], [a, c, d]]
        }
        3 => vec![[cut(0, 3), cut(1, 3), cut(2, 3)]],
        _ => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::vector::{cross, norm};

    /// The derivative of the volume below a level is the area of the section, divided by the slope of the function.
    #[test]
    fn volume_below_a_level_is_the_integral_of_the_area_of_the_section() {
        let corners = [[0.1, 0.0, 0.2], [1.3, 0.1, 0.0], [0.2, 1.1, 0.1], [0.0, 0.3, 0.9]];
        let normal = [0.48, 0.6, 0.64];
        let values = corners.map(|x| crate::mesh::vector::dot(normal, x));
        let volume = crate::mesh::vector::tet_volume(corners);
        let (low, high) = (values.iter().copied().fold(9.0, f64::min), 1.1);
        let steps = 20_000;
        let mut integral = 0.0;
        for step in 0..steps {
            let at = |k: f64| low + (high - low) * k / f64::from(steps);
            let area: f64 = section(corners, values, at(f64::from(step) + 0.5))
                .iter()
                .map(|[a, b, c]| 0.5 * norm(cross(sub(*b, *a), sub(*c, *a))))
                .sum();
            integral += area * (high - low) / f64::from(steps);
            let below = fraction_below(values, at(f64::from(step) + 1.0));
            assert!((integral / volume - below).abs() < 1e-6, "{below} at step {step}");
        }
        assert!(fraction_below(values, 2.0) == 1.0 && fraction_below(values, low) == 0.0);
    }

    #[test]
    fn equal_values_at_vertices_are_no_division_by_zero() {
        assert_eq!(fraction_below([0.0, 0.0, 0.0, 1.0], 0.5), 0.875);
        assert_eq!(fraction_below([1.0, 0.0, 1.0, 1.0], 0.5), 0.125);
        assert_eq!(fraction_below([0.0, 0.0, 1.0, 1.0], 0.5), 0.5);
        assert_eq!(fraction_below([2.0; 4], 2.0), 0.0);
        for fraction in [0.01, 0.3, 0.77] {
            let level = level_of([0.0, 0.0, 1.0, 1.0], fraction);
            assert!((fraction_below([0.0, 0.0, 1.0, 1.0], level) - fraction).abs() < 1e-14);
        }
    }
}
