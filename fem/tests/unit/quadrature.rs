//! Quadrature rules of the tetrahedron, compared with exact integrals of monomials.

use super::*;

/// ∫ λ₀^a λ₁^b λ₂^c λ₃^d dV / V = 3! a! b! c! d! / (a + b + c + d + 3)!
fn exact(powers: [u32; 4]) -> f64 {
    let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
    6.0 * powers.iter().map(|&p| factorial(p)).product::<f64>()
        / factorial(powers.iter().sum::<u32>() + 3)
}

#[test]
fn monomials_up_to_the_stated_degree_are_exact() {
    for (rule, degree) in [(one(), 1), (four(), 2), (eleven(), 4), (fourteen(), 5)] {
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
