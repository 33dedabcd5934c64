//! Quadrature on triangles.

/// Returns the seven-point quadrature rule of a triangle, exact to degree 5: barycentric coordinates and fraction
/// of the area of each point.
///
/// Reference: Radon, Monatsh. Math. 52 (1948) 286, doi:10.1007/BF01525334.
pub(crate) fn seven() -> [([f64; 3], f64); 7] {
    let root = 15f64.sqrt();
    let mut points = [([1.0 / 3.0; 3], 0.225); 7];
    for (ring, sign) in [1.0, -1.0].into_iter().enumerate() {
        let (near, weight) = ((6.0 - sign * root) / 21.0, (155.0 - sign * root) / 1200.0);
        for k in 0..3 {
            let mut at = [near; 3];
            at[k] = 1.0 - 2.0 * near;
            points[1 + 3 * ring + k] = (at, weight);
        }
    }
    points
}

#[cfg(test)]
#[path = "../../tests/unit/triangle.rs"]
mod tests;
