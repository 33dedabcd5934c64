//! The quadrature rule of the triangle, compared with exact integrals of monomials.

use super::*;

#[test]
fn monomials_up_to_degree_five_are_exact() {
    // ∫ λ₀^a λ₁^b λ₂^c dA / A = 2 a! b! c! / (a + b + c + 2)!
    let factorial = |n: u32| (1..=n).map(f64::from).product::<f64>();
    for (a, b, c) in
        (0..6).flat_map(|a| (0..6 - a).flat_map(move |b| (0..6 - a - b).map(move |c| (a, b, c))))
    {
        let exact = 2.0 * factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + 2);
        let value: f64 = seven()
            .iter()
            .map(|(l, w)| w * l[0].powi(a as i32) * l[1].powi(b as i32) * l[2].powi(c as i32))
            .sum();
        assert!((value - exact).abs() < 1e-15, "{a} {b} {c}: {value} instead of {exact}");
    }
}
