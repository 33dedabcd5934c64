//! Quality measure that limits each movement of a node: the cosine of the smallest dihedral angle.

use crate::mesh::vector::{Point, cross, dot, sub};

/// Returns the cosine of an angle that is given in degrees.
pub(super) fn cosine(degrees: f64) -> f64 {
    degrees.to_radians().cos()
}

/// Returns the cosine of the smallest dihedral angle of a tetrahedron, or infinity if it is inverted.
pub(super) fn worst_cosine(p: [Point; 4]) -> f64 {
    let (a, b, c) = (sub(p[1], p[0]), sub(p[2], p[0]), sub(p[3], p[0]));
    // outward normals of three faces, scaled by the areas of the faces; the fourth normal follows, because all four
    // normals add up to zero
    let (n1, n2, n3) = (cross(c, b), cross(a, c), cross(b, a));
    if -dot(a, n1) <= 0.0 {
        return f64::INFINITY;
    }
    let n0 = [0, 1, 2].map(|k| -(n1[k] + n2[k] + n3[k]));
    let normals = [n0, n1, n2, n3];
    let inverse = normals.map(|n| dot(n, n).sqrt().recip());
    let mut worst = -1.0_f64;
    for i in 0..4 {
        for j in 0..i {
            worst = worst.max(-dot(normals[i], normals[j]) * inverse[i] * inverse[j]);
        }
    }
    worst
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dihedral_angles_of_known_tetrahedra() {
        let corner = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        // a tetrahedron at the corner of a cube has three dihedral angles of 90° and three of arctan √2 = 54.74°
        assert!((worst_cosine(corner) - 1.0 / 3.0_f64.sqrt()).abs() < 1e-15);
        let regular = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
        assert!(
            (worst_cosine([regular[0], regular[2], regular[1], regular[3]]) - 1.0 / 3.0).abs()
                < 1e-15
        );
        assert_eq!(worst_cosine(regular), f64::INFINITY);
        assert!((cosine(60.0) - 0.5).abs() < 1e-15);
    }
}
