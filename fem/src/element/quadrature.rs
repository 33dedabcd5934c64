//! Symmetric integration rules on the tetrahedron; weights sum to one.

/// A point in barycentric coordinates, with its share of the volume.
#[derive(Clone, Copy, Debug)]
pub(crate) struct QuadraturePoint {
    pub(crate) at: [f64; 4],
    pub(crate) weight: f64,
}

/// The centroid: exact to degree 1.
pub(crate) fn one() -> Vec<QuadraturePoint> {
    vec![QuadraturePoint { at: [0.25; 4], weight: 1.0 }]
}

/// Four points, (5 ± √5 …)/20: exact to degree 2. Point k is the one next to vertex k.
pub(crate) fn four() -> Vec<QuadraturePoint> {
    let far = (5.0 - 5f64.sqrt()) / 20.0;
    corners(far, 0.25)
}

/// Fourteen points with positive weights: exact to degree 5 (Walkington, Quadrature on simplices
/// of arbitrary dimension, Carnegie Mellon 2000).
pub(crate) fn fourteen() -> Vec<QuadraturePoint> {
    let mut points = corners(0.310_885_919_263_300_6, 0.112_687_925_718_015_85);
    points.extend(corners(0.092_735_250_310_891_22, 0.073_493_043_116_361_96));
    let near = 0.045_503_704_125_649_65;
    for i in 0..4 {
        for j in i + 1..4 {
            let mut at = [near; 4];
            at[i] = 0.5 - near;
            at[j] = 0.5 - near;
            points.push(QuadraturePoint { at, weight: 0.042_546_020_777_081_466 });
        }
    }
    points
}

/// The four permutations of (a, a, a, 1 − 3a).
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
mod tests {
    use super::*;

    /// ∫ λ₀^a λ₁^b λ₂^c λ₃^d dV / V = 3! a! b! c! d! / (a + b + c + d + 3)!
    fn exact(powers: [u32; 4]) -> f64 {
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        6.0 * powers.iter().map(|&p| factorial(p)).product::<f64>()
            / factorial(powers.iter().sum::<u32>() + 3)
    }

    #[test]
    fn monomials_up_to_the_stated_degree_are_exact() {
        for (rule, degree) in [(one(), 1), (four(), 2), (fourteen(), 5)] {
            for a in 0..=degree {
                for b in 0..=degree - a {
                    for c in 0..=degree - a - b {
                        for d in 0..=degree - a - b - c {
                            let powers = [a, b, c, d];
                            let value: f64 = rule
                                .iter()
                                .map(|q| {
                                    q.weight
                                        * (0..4)
                                            .map(|k| q.at[k].powi(powers[k] as i32))
                                            .product::<f64>()
                                })
                                .sum();
                            assert!(
                                (value - exact(powers)).abs() < 2e-15,
                                "{} points, {powers:?}",
                                rule.len()
                            );
                        }
                    }
                }
            }
        }
    }
}
