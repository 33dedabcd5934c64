//! Validity and volume of a quadratic tetrahedron.
//!
//! The Jacobian determinant of a quadratic tetrahedron is a cubic polynomial over the reference tetrahedron. The
//! smallest coefficient of its Bernstein form is a lower bound of the determinant, and the mean of the coefficients is
//! the mean of the determinant. After a bisection of the reference tetrahedron, the bounds of both halves are closer to
//! the minimum.
//!
//! # Reference
//! A. Johnen, J.-F. Remacle, C. Geuzaine, "Geometrical validity of curvilinear finite elements",
//! J. Comput. Phys. 233 (2013) 359–372, doi:10.1016/j.jcp.2012.08.051.

use super::vector::{Point, cross, dot};

/// Index of the mid-edge point between two corners, in the order of the edges 01, 12, 20, 03, 13, 23. The diagonal
/// entries (9) are not used.
const BETWEEN: [[usize; 4]; 4] = [[9, 0, 2, 3], [0, 9, 1, 4], [2, 1, 9, 5], [3, 4, 5, 9]];

/// Tolerance of the lower bound of the Jacobian determinant, relative to the mean absolute Bernstein coefficient. An
/// element whose smallest determinant is positive but below this tolerance may count as folded.
const TIGHT: f64 = 1e-3;
/// Largest depth of the recursive bisection of the reference tetrahedron: each of the six edges is bisected four times.
const DEEPEST: usize = 24;
/// Edges of the reference tetrahedron in the order in which they are bisected. Opposite edges are consecutive, so that
/// the sub-tetrahedra stay compact.
const BISECTED: [[usize; 2]; 6] = [[0, 1], [2, 3], [0, 2], [1, 3], [0, 3], [1, 2]];

/// Bernstein coefficients of a cubic polynomial over a tetrahedron. The index of a coefficient, written in base 4, has
/// one digit per corner: the exponent of this corner's barycentric coordinate. Most of the 256 entries are not used.
type Cubic = [f64; 256];

/// Returns the indices of the 20 used entries of a [`Cubic`]: the exponents in such an index add up to 3.
fn used_indices() -> impl Iterator<Item = usize> {
    (0..256).filter(|index| (0..4).map(|corner| index >> (2 * corner) & 3).sum::<usize>() == 3)
}

/// Returns the coefficients of the cubic over one half of its tetrahedron. In this half, the midpoint between the
/// corners `moved` and `fixed` replaces the corner `moved`.
fn half(cubic: &Cubic, fixed: usize, moved: usize) -> Cubic {
    const BINOMIAL: [[f64; 4]; 4] =
        [[1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [1.0, 2.0, 1.0, 0.0], [1.0, 3.0, 3.0, 1.0]];
    let mut halved = [0.0; 256];
    for index in used_indices() {
        let exponent = index >> (2 * moved) & 3;
        let terms = (0..=exponent).map(|k| {
            BINOMIAL[exponent][k] * cubic[index + (k << (2 * fixed)) - (k << (2 * moved))]
        });
        halved[index] = terms.sum::<f64>() / f64::from(1 << exponent);
    }
    halved
}

/// Bounds and mean of the Jacobian determinant of a quadratic tetrahedron (mm³). For a straight tetrahedron the
/// determinant is constant, six times the volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jacobian {
    /// Lower bound of the Jacobian determinant. For a valid tetrahedron, the bound is below the minimum by at most
    /// 0.001 of the mean.
    pub(crate) lowest: f64,
    /// Mean of the Jacobian determinant, six times the volume of the tetrahedron.
    pub(crate) mean: f64,
}

impl Jacobian {
    /// Computes the bound and the mean from the corners and the mid-edge points of the edges 01, 12, 20, 03, 13, 23.
    pub(crate) fn of(corners: &[Point; 4], middles: &[Point; 6]) -> Jacobian {
        let cubic = determinant(corners, middles);
        let mean = used_indices().map(|index| cubic[index]).sum::<f64>() / 20.0;
        let size = used_indices().map(|index| cubic[index].abs()).sum::<f64>() / 20.0;
        Jacobian { lowest: lower_bound(&cubic, TIGHT * size), mean }
    }

    /// Returns whether the lower bound of the determinant is not positive, so that the tetrahedron counts as folded.
    pub(crate) fn is_folded(&self) -> bool {
        self.lowest.is_nan() || self.lowest <= 0.0
    }
}

/// Returns a lower bound of a cubic polynomial over its tetrahedron. The bound is at most `tight` below the minimum,
/// unless the largest depth of bisection is reached. Returns NaN if `tight` is not finite.
fn lower_bound(cubic: &Cubic, tight: f64) -> f64 {
    let low =
        |cubic: &Cubic| used_indices().map(|index| cubic[index]).fold(f64::INFINITY, f64::min);
    // the value of the cubic at a corner is the coefficient with exponent 3 for that corner
    let at_corners =
        |cubic: &Cubic| (0..4).map(|corner| cubic[3 << (2 * corner)]).fold(f64::INFINITY, f64::min);
    if !tight.is_finite() {
        return f64::NAN;
    }
    let (mut least_value, mut bound) = (at_corners(cubic), f64::INFINITY);
    let mut pending = vec![(*cubic, 0)];
    while let Some((part, depth)) = pending.pop() {
        let low = low(&part);
        least_value = least_value.min(at_corners(&part));
        if depth == DEEPEST || low.is_nan() || low >= least_value - tight {
            bound = bound.min(low);
            continue;
        }
        let [a, b] = BISECTED[depth % BISECTED.len()];
        pending.push((half(&part, a, b), depth + 1));
        pending.push((half(&part, b, a), depth + 1));
    }
    bound
}

/// Returns the Bernstein coefficients of the Jacobian determinant.
fn determinant(corners: &[Point; 4], middles: &[Point; 6]) -> Cubic {
    // control points of the quadratic map in Bernstein form
    let control = |i: usize, j: usize| -> Point {
        if i == j {
            return corners[i];
        }
        let middle = middles[BETWEEN[i][j]];
        std::array::from_fn(|k| 2.0 * middle[k] - 0.5 * (corners[i][k] + corners[j][k]))
    };
    // the derivative along edge 0k is a linear function, given by one control vector per corner
    let slopes: [[Point; 4]; 3] = std::array::from_fn(|k| {
        std::array::from_fn(|i| {
            let (to, from) = (control(i, k + 1), control(i, 0));
            std::array::from_fn(|axis| 2.0 * (to[axis] - from[axis]))
        })
    });
    // a Bernstein coefficient is the mean of all products of control vectors with the same exponents
    let (mut sums, mut counts) = ([0.0; 256], [0.0; 256]);
    for i in 0..4 {
        for j in 0..4 {
            let normal = cross(slopes[0][i], slopes[1][j]);
            for k in 0..4 {
                let index = [i, j, k].iter().map(|&corner| 1 << (2 * corner)).sum::<usize>();
                sums[index] += dot(normal, slopes[2][k]);
                counts[index] += 1.0;
            }
        }
    }
    used_indices().for_each(|index| sums[index] /= counts[index]);
    sums
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::topology::EDGES;
    use crate::mesh::vector::{add, norm, scale, sub, tet_volume};

    const CORNERS: [Point; 4] =
        [[0.1, 0.0, 0.2], [1.3, 0.1, 0.0], [0.2, 1.1, 0.1], [0.0, 0.2, 0.9]];

    fn middles(shift: impl Fn(usize) -> Point) -> [Point; 6] {
        std::array::from_fn(|edge| {
            let [a, b] = EDGES[edge].map(|k| CORNERS[k]);
            add(scale(add(a, b), 0.5), shift(edge))
        })
    }

    /// Returns the Jacobian determinant at one point, from differences of the quadratic map.
    fn sampled(middles: &[Point; 6], at: [f64; 3]) -> f64 {
        let map = |[x, y, z]: [f64; 3]| -> Point {
            let l = [1.0 - x - y - z, x, y, z];
            let mut point = [0.0; 3];
            for (corner, &p) in CORNERS.iter().enumerate() {
                point = add(point, scale(p, l[corner] * (2.0 * l[corner] - 1.0)));
            }
            for (edge, &p) in middles.iter().enumerate() {
                let [a, b] = EDGES[edge];
                point = add(point, scale(p, 4.0 * l[a] * l[b]));
            }
            point
        };
        let slope = |k: usize| {
            let (mut plus, mut minus) = (at, at);
            plus[k] += 0.5;
            minus[k] -= 0.5;
            // a central difference of a quadratic map is exact for any step
            sub(map(plus), map(minus))
        };
        dot(slope(0), cross(slope(1), slope(2)))
    }

    #[test]
    fn a_straight_tetrahedron_has_six_times_its_volume_everywhere() {
        let jacobian = Jacobian::of(&CORNERS, &middles(|_| [0.0; 3]));
        let expected = 6.0 * tet_volume(CORNERS);
        assert!((jacobian.mean / expected - 1.0).abs() < 1e-13);
        assert!((jacobian.lowest / expected - 1.0).abs() < 1e-12);
    }

    #[test]
    fn bound_and_mean_agree_with_samples_of_the_determinant() {
        let shift = |e: usize| [0.05, -0.04, 0.06].map(|s| s * ((e * e + 1) as f64 * 1.7).sin());
        let middles = middles(shift);
        let jacobian = Jacobian::of(&CORNERS, &middles);
        let n = 40;
        let (mut sum, mut count, mut lowest) = (0.0, 0.0, f64::INFINITY);
        for (i, j, k) in (0..n * n * n).map(|c| (c % n, c / n % n, c / n / n)) {
            let at = [i, j, k].map(|x| (x as f64 + 0.5) / n as f64);
            if at.iter().sum::<f64>() < 1.0 {
                let value = sampled(&middles, at);
                lowest = lowest.min(value);
                sum += value;
                count += 1.0;
            }
        }
        let below = lowest - jacobian.lowest;
        assert!((-0.0..0.03 * jacobian.mean).contains(&below), "{jacobian:?} {lowest}");
        assert!((jacobian.mean / (sum / count) - 1.0).abs() < 0.01, "{jacobian:?}");
        assert!(norm(shift(3)) > 0.01);
    }

    #[test]
    fn an_edge_bent_through_the_body_is_folded() {
        let middles = middles(|edge| if edge == 0 { [0.0, 0.8, 0.4] } else { [0.0; 3] });
        assert!(Jacobian::of(&CORNERS, &middles).lowest < 0.0);
    }

    #[test]
    fn an_element_with_a_negative_coefficient_and_a_positive_determinant_is_not_folded() {
        // shifts of the midpoints of three edges; each test shape is bent by a fraction of these shifts
        const SHIFTS: [(usize, Point); 3] =
            [(2, [0.04, 0.09, -0.38]), (3, [0.54, 0.11, 0.07]), (4, [-0.01, 0.6, -0.01])];
        let bent = |share: f64| {
            middles(|edge| {
                let shift = SHIFTS.iter().find(|(bent, _)| *bent == edge);
                shift.map_or([0.0; 3], |(_, shift)| scale(*shift, share))
            })
        };
        let negative = |cubic: &Cubic| used_indices().any(|index| cubic[index] < 0.0);
        let mut checked = 0;
        for step in 0..=40 {
            let middles = bent(0.025 * f64::from(step));
            let jacobian = Jacobian::of(&CORNERS, &middles);
            let n = 60;
            let lowest = (0..=n)
                .flat_map(|i| {
                    (0..=n - i).flat_map(move |j| (0..=n - i - j).map(move |k| [i, j, k]))
                })
                .map(|at| sampled(&middles, at.map(|x| f64::from(x) / f64::from(n))))
                .fold(f64::INFINITY, f64::min);
            assert!(jacobian.lowest <= lowest + 1e-12, "{jacobian:?} {lowest}");
            assert!(jacobian.lowest > lowest - 0.01 * jacobian.mean.abs(), "{jacobian:?} {lowest}");
            checked +=
                i32::from(negative(&determinant(&CORNERS, &middles)) && !jacobian.is_folded());
        }
        assert!(
            checked > 0,
            "no valid element had a negative coefficient, so the test checks nothing"
        );
    }
}
