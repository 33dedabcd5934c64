//! The geometry of a quadratic tetrahedron: is it folded, and how large is it?
//!
//! Its Jacobian is a cubic over the reference tetrahedron. In Bernstein form the smallest
//! coefficient bounds it from below and the mean of the coefficients is its mean, so both
//! questions are answered without sampling.
//!
//! # Reference
//! A. Johnen, J.-F. Remacle, C. Geuzaine, "Geometrical validity of curvilinear finite elements",
//! J. Comput. Phys. 233 (2013) 359–372, doi:10.1016/j.jcp.2012.08.051.

use super::vector::{Point, cross, dot};

/// Local numbers of the point between two corners, in the order of the edges 01, 12, 20, 03, 13,
/// 23; a corner with itself is not used.
const BETWEEN: [[usize; 4]; 4] = [[9, 0, 2, 3], [0, 9, 1, 4], [2, 1, 9, 5], [3, 4, 5, 9]];

/// What the Jacobian determinant of a quadratic tetrahedron is like (mm³); a straight one has
/// six times its volume everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jacobian {
    /// It is nowhere less than this.
    pub(crate) lowest: f64,
    /// Its mean, six times the volume.
    pub(crate) mean: f64,
}

impl Jacobian {
    /// Of the tetrahedron with these corners and these points on its edges 01, 12, 20, 03, 13, 23.
    pub(crate) fn of(corners: &[Point; 4], middles: &[Point; 6]) -> Jacobian {
        // control points of the quadratic map
        let control = |i: usize, j: usize| -> Point {
            if i == j {
                return corners[i];
            }
            let middle = middles[BETWEEN[i][j]];
            std::array::from_fn(|k| 2.0 * middle[k] - 0.5 * (corners[i][k] + corners[j][k]))
        };
        // the derivative along edge 0k is linear, with one control vector a corner
        let slopes: [[Point; 4]; 3] = std::array::from_fn(|k| {
            std::array::from_fn(|i| {
                let (to, from) = (control(i, k + 1), control(i, 0));
                std::array::from_fn(|axis| 2.0 * (to[axis] - from[axis]))
            })
        });
        // a coefficient is the mean over the products that share its exponents, which are the
        // digits of a number to the base 4: how often each corner occurs
        let mut sums = [(0.0, 0.0); 64 * 4];
        for i in 0..4 {
            for j in 0..4 {
                let normal = cross(slopes[0][i], slopes[1][j]);
                for k in 0..4 {
                    let exponents =
                        [i, j, k].iter().map(|&corner| 1 << (2 * corner)).sum::<usize>();
                    let (sum, count) = &mut sums[exponents];
                    *sum += dot(normal, slopes[2][k]);
                    *count += 1.0;
                }
            }
        }
        let coefficients =
            sums.iter().filter(|(_, count)| *count > 0.0).map(|(sum, count)| sum / count);
        let (lowest, total) =
            coefficients.fold((f64::INFINITY, 0.0), |(low, total), x| (low.min(x), total + x));
        Jacobian { lowest, mean: total / 20.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tet_mesh::EDGES;
    use crate::mesh::vector::{add, norm, scale, sub, tet_volume};

    const CORNERS: [Point; 4] =
        [[0.1, 0.0, 0.2], [1.3, 0.1, 0.0], [0.2, 1.1, 0.1], [0.0, 0.2, 0.9]];

    fn middles(shift: impl Fn(usize) -> Point) -> [Point; 6] {
        std::array::from_fn(|edge| {
            let [a, b] = EDGES[edge].map(|k| CORNERS[k]);
            add(scale(add(a, b), 0.5), shift(edge))
        })
    }

    /// The determinant at one point, by differences of the map itself.
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
            // exact for a quadratic map, whatever the step
            sub(map(plus), map(minus))
        };
        dot(slope(0), cross(slope(1), slope(2)))
    }

    #[test]
    fn a_straight_one_has_six_times_its_volume_everywhere() {
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
        assert!(jacobian.lowest <= lowest && jacobian.lowest > 0.5 * lowest, "{jacobian:?}");
        assert!((jacobian.mean / (sum / count) - 1.0).abs() < 0.01, "{jacobian:?}");
        assert!(norm(shift(3)) > 0.01);
    }

    #[test]
    fn an_edge_bent_through_the_body_is_folded() {
        let middles = middles(|edge| if edge == 0 { [0.0, 0.8, 0.4] } else { [0.0; 3] });
        assert!(Jacobian::of(&CORNERS, &middles).lowest < 0.0);
    }
}
