//! Integration on triangles.

/// The seven-point rule, exact to degree 5: barycentric coordinates and share of the area.
///
/// Reference: Radon, Monatsh. Math. 52 (1948) 286, doi:10.1007/BF01525334.
pub(super) fn seven() -> [([f64; 3], f64); 7] {
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
mod tests {
    use super::*;

    #[test]
    fn monomials_up_to_degree_five_are_exact() {
        // ∫ λ₀^a λ₁^b λ₂^c dA / A = 2 a! b! c! / (a + b + c + 2)!
        let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
        for (a, b, c) in (0..6)
            .flat_map(|a| (0..6 - a).flat_map(move |b| (0..6 - a - b).map(move |c| (a, b, c))))
        {
            let exact = 2.0 * factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + 2);
            let value: f64 = seven()
                .iter()
                .map(|(l, w)| w * l[0].powi(a as i32) * l[1].powi(b as i32) * l[2].powi(c as i32))
                .sum();
            assert!((value - exact).abs() < 1e-15, "{a} {b} {c}: {value} instead of {exact}");
        }
    }
}
