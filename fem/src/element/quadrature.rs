//! Symmetric quadrature rules on the tetrahedron. The weights of a rule sum to one.

/// Quadrature point: barycentric coordinates, and weight as a fraction of the volume.
#[derive(Clone, Copy, Debug)]
pub(super) struct QuadraturePoint {
    pub at: [f64; 4],
    pub weight: f64,
}

/// Returns the one-point quadrature rule, whose point is the centroid; exact to degree 1.
pub(super) fn one() -> Vec<QuadraturePoint> {
    vec![QuadraturePoint { at: [0.25; 4], weight: 1.0 }]
}

/// Returns the four-point quadrature rule with the coordinates (5 − √5)/20 and (5 + 3√5)/20: exact to degree 2.
/// Point k is nearest to vertex k.
pub(super) fn four() -> Vec<QuadraturePoint> {
    let far = (5.0 - 5f64.sqrt()) / 20.0;
    corners(far, 0.25)
}

/// Returns the eleven-point quadrature rule: exact to degree 4, with a negative weight at the centroid (Keast,
/// Comput. Methods Appl. Mech. Engrg. 55 (1986) 339, doi:10.1016/0045-7825(86)90059-9).
pub(super) fn eleven() -> Vec<QuadraturePoint> {
    let mut points = vec![QuadraturePoint { at: [0.25; 4], weight: -148.0 / 1875.0 }];
    points.extend(corners(1.0 / 14.0, 343.0 / 7500.0));
    points.extend(edges(0.25 * (1.0 - (5.0f64 / 14.0).sqrt()), 56.0 / 375.0));
    points
}

/// Returns the fourteen-point quadrature rule with positive weights: exact to degree 5 (Walkington, Quadrature on
/// simplices of arbitrary dimension, Carnegie Mellon 2000).
pub(super) fn fourteen() -> Vec<QuadraturePoint> {
    let mut points = corners(0.310_885_919_263_300_6, 0.112_687_925_718_015_85);
    points.extend(corners(0.092_735_250_310_891_22, 0.073_493_043_116_361_96));
    points.extend(edges(0.045_503_704_125_649_65, 0.042_546_020_777_081_466));
    points
}

/// Returns the six points whose coordinates are permutations of (a, a, ½ − a, ½ − a).
fn edges(a: f64, weight: f64) -> Vec<QuadraturePoint> {
    let mut points = Vec::new();
    for i in 0..4 {
        for j in i + 1..4 {
            let mut at = [a; 4];
            at[i] = 0.5 - a;
            at[j] = 0.5 - a;
            points.push(QuadraturePoint { at, weight });
        }
    }
    points
}

/// Returns the four points whose coordinates are permutations of (a, a, a, 1 − 3a).
fn corners(a: f64, weight: f64) -> Vec<QuadraturePoint> {
    (0..4)
        .map(|k| {
            let mut at = [a; 4];
            at[k] = 1.0 - 3.0 * a;
            QuadraturePoint { at, weight }
        })
        .collect()
}

#[cfg(test)]
#[path = "../../tests/unit/quadrature.rs"]
mod tests;
