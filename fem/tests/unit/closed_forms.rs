//! Stress curves of the laws that are given by their energy, compared with published closed forms.

use nalgebra::Matrix3;

use super::conformance::Deformed;
use super::*;

fn stress(material: &Material, stretches: [f64; 3]) -> Matrix3<f64> {
    let gradient = Matrix3::from_diagonal(&stretches.map(|s| s - 1.0).into());
    piola(material, &gradient)
}

fn piola(material: &Material, gradient: &Matrix3<f64>) -> Matrix3<f64> {
    Deformed::new(&material.at_point(None), gradient, 1.0).expect("det F > 0").piola()
}

/// Returns the nominal stress in simple shear F = I + γ e₁⊗e₂.
fn shear_stress(material: &Material, gamma: f64) -> Matrix3<f64> {
    let mut gradient = Matrix3::zeros();
    gradient[(0, 1)] = gamma;
    piola(material, &gradient)
}

fn assert_close(value: f64, exact: f64, tolerance: f64, what: &str) {
    assert!((value - exact).abs() <= tolerance * exact.abs(), "{what}: {value} instead of {exact}");
}

/// Returns the free stretch, for which `stress` is zero, by bisection.
fn free(stress: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (0.02, 3.0);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if stress(middle) < 0.0 { low = middle } else { high = middle }
    }
    0.5 * (low + high)
}

const STRETCHES: [f64; 6] = [0.6, 0.9, 0.999, 1.001, 1.3, 2.0];

#[test]
fn saint_venant_kirchhoff_curves() {
    // E_i are the Green–Lagrange strains, E_young is Young's modulus, and P is the nominal stress.
    // uniaxial: E₂ = E₃ = −ν E₁, P = λ E_young (λ² − 1)/2; equibiaxial: E₃ = −2ν/(1 − ν) E₁,
    // P = λ E_young/(1 − ν) (λ² − 1)/2; simple shear: P₁₂ = μ γ + (λ/2 + μ) γ³ with Lamé's constant λ
    let (young, nu) = (275.0, 0.25);
    let law = SaintVenantKirchhoff { lame_mpa: 110.0, shear_mpa: 110.0 };
    let material = Material::hyperelastic(law).expect("a law");
    for s in STRETCHES {
        let green = 0.5 * (s * s - 1.0);
        if nu * (s * s - 1.0) < 1.0 {
            let t = (1.0 - 2.0 * nu * green).sqrt();
            let p = stress(&material, [s, t, t]);
            assert_close(p[(0, 0)], s * young * green, 1e-11, "uniaxial");
            assert!(p[(1, 1)].abs() < 1e-11 * young);
        }
        let square = 1.0 - 4.0 * nu / (1.0 - nu) * green;
        if square > 0.0 {
            let p = stress(&material, [s, s, square.sqrt()]);
            assert_close(p[(0, 0)], s * young / (1.0 - nu) * green, 1e-11, "equibiaxial");
            assert!(p[(2, 2)].abs() < 1e-11 * young);
        }
    }
    for gamma in [1e-3, 0.01, 0.5, 1.5] {
        let p = shear_stress(&material, gamma);
        assert_close(p[(0, 1)], 110.0 * gamma + 165.0 * gamma.powi(3), 1e-11, "shear");
    }
    // the limit point of a compressed bar
    let force = |s: f64| -s * young * 0.5 * (s * s - 1.0);
    let weakest = 1.0 / 3f64.sqrt();
    assert!(force(weakest) > force(weakest + 0.01) && force(weakest) > force(weakest - 0.01));
}

#[test]
fn mooney_rivlin_curves() {
    let (c10, c01) = (0.16, 0.04);
    let law = |bulk_mpa| {
        Material::hyperelastic(MooneyRivlin { c10_mpa: c10, c01_mpa: c01, bulk_mpa })
            .expect("a law")
    };
    // simple shear is isochoric, so that the shear stress does not depend on K: P₁₂ = 2 (C₁₀ + C₀₁) γ
    for gamma in [1e-3, 0.01, 0.5, 1.5] {
        let p = shear_stress(&law(3.0), gamma);
        assert_close(p[(0, 1)], 2.0 * (c10 + c01) * gamma, 1e-11, "shear");
    }
    // incompressible: uniaxial P = 2 (λ − λ⁻²)(C₁₀ + C₀₁/λ), equibiaxial
    // P = 2 (λ − λ⁻⁵)(C₁₀ + C₀₁ λ²); with K/μ = 10⁶, the error is of order 10⁻⁶
    let rubber = law(4e5);
    for s in STRETCHES {
        let t = free(|t| stress(&rubber, [s, t, t])[(1, 1)]);
        let exact = 2.0 * (s - s.powi(-2)) * (c10 + c01 / s);
        assert_close(stress(&rubber, [s, t, t])[(0, 0)], exact, 1e-5, "uniaxial");
        let t = free(|t| stress(&rubber, [s, s, t])[(2, 2)]);
        let exact = 2.0 * (s - s.powi(-5)) * (c10 + c01 * s * s);
        assert_close(stress(&rubber, [s, s, t])[(0, 0)], exact, 1e-5, "equibiaxial");
    }
    // a compressible law, compared with formulas of the principal stresses
    let (soft, bulk) = (law(0.7), 0.7);
    for stretches in [[1.3, 0.8, 0.9], [0.7, 0.7, 1.2], [1.1, 1.1, 1.1]] {
        let j: f64 = stretches.iter().product();
        let bar = stretches.map(|s| s * j.powf(-1.0 / 3.0));
        let sum = |power: i32| bar.iter().map(|s| s.powi(power)).sum::<f64>();
        for i in 0..3 {
            let tau = 2.0 * c10 * (bar[i].powi(2) - sum(2) / 3.0)
                - 2.0 * c01 * (bar[i].powi(-2) - sum(-2) / 3.0)
                + 0.5 * bulk * (j * j - 1.0);
            let p = stress(&soft, stretches)[(i, i)];
            assert!((p - tau / stretches[i]).abs() < 1e-13, "{p} and {}", tau / stretches[i]);
        }
    }
}

fn ogden<const K: usize>(terms: [(f64, f64); K], bulk_mpa: f64) -> Ogden {
    Ogden { terms: terms.map(OgdenTerm::from).to_vec(), bulk_mpa }
}

#[test]
fn ogden_curves() {
    let terms = [(0.63, 1.3), (0.0012, 5.0), (-0.01, -2.0)].map(OgdenTerm::from);
    let law = |bulk_mpa| {
        Material::hyperelastic(Ogden { terms: terms.to_vec(), bulk_mpa }).expect("a law")
    };
    let sum = |f: &dyn Fn(f64) -> f64| terms.iter().map(|t| t.mu_mpa * f(t.alpha)).sum::<f64>();
    // incompressible: uniaxial P = Σ μ (λ^(α−1) − λ^(−α/2−1)), equibiaxial
    // P = Σ μ (λ^(α−1) − λ^(−2α−1)) (Ogden 1972)
    let rubber = law(4e5);
    for s in [0.6, 0.9, 0.999, 1.001, 1.3, 2.0, 5.0] {
        let t = free(|t| stress(&rubber, [s, t, t])[(1, 1)]);
        let exact = sum(&|alpha| s.powf(alpha - 1.0) - s.powf(-0.5 * alpha - 1.0));
        assert_close(stress(&rubber, [s, t, t])[(0, 0)], exact, 1e-4, "uniaxial");
        if s < 3.0 {
            let t = free(|t| stress(&rubber, [s, s, t])[(2, 2)]);
            let exact = sum(&|alpha| s.powf(alpha - 1.0) - s.powf(-2.0 * alpha - 1.0));
            assert_close(stress(&rubber, [s, s, t])[(0, 0)], exact, 1e-4, "equibiaxial");
        }
    }
    // simple shear: principal stretches λ, 1/λ with λ − 1/λ = γ; τ₁₂ = Σ μ (λ^α − λ^−α)/(λ + 1/λ)
    for gamma in [1e-3, 0.01, 0.5, 1.5] {
        let s = 0.5 * gamma + f64::sqrt(1.0 + 0.25 * gamma * gamma);
        let exact = sum(&|alpha| (s.powf(alpha) - s.powf(-alpha)) / (s + 1.0 / s));
        assert_close(shear_stress(&law(2.0), gamma)[(0, 1)], exact, 1e-11, "shear");
    }
    // an Ogden law with two terms with the exponents ±2 is a Mooney–Rivlin law
    let twin = ogden([(0.32, 2.0), (-0.08, -2.0)], 0.7);
    let twin = Material::hyperelastic(twin).expect("a law");
    let mooney = MooneyRivlin { c10_mpa: 0.16, c01_mpa: 0.04, bulk_mpa: 0.7 };
    let mooney = Material::hyperelastic(mooney).expect("a law");
    let at = [1.4, 0.8, 0.7];
    assert!((stress(&twin, at) - stress(&mooney, at)).norm() < 1e-14);
}

/// At strains of 1e-6, every law equals Hooke's law up to terms of second order.
#[test]
fn small_strain_limit() {
    let laws = [
        Material::hyperelastic(MooneyRivlin { c10_mpa: 0.16, c01_mpa: 0.04, bulk_mpa: 0.7 }),
        Material::hyperelastic(ogden([(0.63, 1.3), (-0.01, -2.0)], 1.0)),
        Material::hyperelastic(SaintVenantKirchhoff { lame_mpa: 1.0, shear_mpa: 2.0 }),
    ];
    for material in laws.map(|law| law.expect("a law")) {
        let h: Matrix3<f64> = Matrix3::new(0.3, -0.8, 0.1, 0.4, -0.6, 0.9, -0.2, 0.5, 0.7) * 1e-6;
        let small = 0.5 * (h + h.transpose());
        let (young, nu) = (material.elasticity.young_mpa(), material.elasticity.poisson());
        let shear = young / (2.0 * (1.0 + nu));
        let lame = young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu));
        let hooke = 2.0 * shear * small + lame * small.trace() * Matrix3::identity();
        let p = piola(&material, &h);
        assert!((p - hooke).norm() < 1e-5 * hooke.norm(), "{p} instead of {hooke}");
    }
}

#[test]
fn invalid_laws_are_rejected() {
    #[derive(Debug)]
    struct Skew;
    impl HyperelasticLaw for Skew {
        fn energy<T: Scalar>(&self, strain: &PrincipalStrain<T>) -> T {
            let [a, b, c] = strain.log();
            a * a + b * b + c * c + a * a * b
        }
    }
    #[derive(Debug)]
    struct Prestressed;
    impl HyperelasticLaw for Prestressed {
        fn energy<T: Scalar>(&self, strain: &PrincipalStrain<T>) -> T {
            strain.power_sum(2.0)
        }
    }
    let message =
        |material: Result<Material, crate::FemError>| material.expect_err("refused").to_string();
    assert!(message(Material::hyperelastic(Skew)).contains("exchanged"));
    assert!(message(Material::hyperelastic(Prestressed)).contains("at zero strain is not zero"));
    let soft = MooneyRivlin { c10_mpa: -1.0, c01_mpa: 0.5, bulk_mpa: 3.0 };
    assert!(message(Material::hyperelastic(soft)).contains("μ = -"));
    let flat = ogden([(1.0, 0.0)], 3.0);
    assert!(message(ElasticLaw::Ogden(flat.clone()).material(1.0, 0.0)).contains("alpha = 0"));
    assert!(message(Material::hyperelastic(flat)).contains("not both positive"));
}
