//! Uniaxial compression between frictionless platens, compared with closed forms.
//!
//! The state is uniform on any prism. Therefore every element order and quadrature rule must reproduce the state within
//! the tolerance of the solver. The reference solution (`Oracle`) has no finite elements: it is one scalar equation for
//! the damage.

use crate::support::{HEIGHT, RADIUS, loading, matrix, peak, phase_field, prism, test};
use fem::{DamageQuadrature, Fracture, Material, Order, PhaseField, Split};

const LENGTH: f64 = 0.06;

fn area() -> f64 {
    std::f64::consts::PI * RADIUS * RADIUS
}

/// Returns the axial logarithmic strain, positive in compression, and the axial stretch.
fn strain(displacement: f64) -> (f64, f64) {
    let stretch = 1.0 - displacement / HEIGHT;
    (-stretch.ln(), stretch)
}

/// Reference solution of a uniform specimen: force and driving energy for a given damage.
struct Oracle {
    material: Material,
    split: Split,
}

impl Oracle {
    fn fracture(&self) -> Fracture {
        self.material.fracture.expect("a material that breaks")
    }

    fn degradation(&self, phi: f64) -> f64 {
        let eta = self.fracture().residual_stiffness;
        (1.0 - eta) * (1.0 - phi) * (1.0 - phi) + eta
    }

    /// Returns the axial Kirchhoff stress and ψ⁺ for zero lateral stress, MPa.
    fn state(&self, e: f64, phi: f64) -> (f64, f64) {
        let elasticity = &self.material.elasticity;
        let (young, nu, g) = (elasticity.young_mpa(), elasticity.poisson(), self.degradation(phi));
        match self.split {
            Split::None => (g * young * e, 0.5 * young * e * e),
            Split::Spectral => {
                let (lame, mu) =
                    (young * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), young / (2.0 * (1.0 + nu)));
                // lateral strain t > 0 while the volume decreases: g 2μ t + λ (2t − e) = 0
                let t = 0.5 * lame * e / (g * mu + lame);
                (2.0 * mu * e + lame * (e - 2.0 * t), 2.0 * mu * t * t)
            }
            Split::VolumetricDeviatoric => {
                let (bulk, mu) = (young / (3.0 * (1.0 - 2.0 * nu)), young / (2.0 * (1.0 + nu)));
                // lateral strain t (positive outwards): g 2μ (t + e)/3 + K (2t − e) = 0
                let t = e * (bulk - 2.0 / 3.0 * g * mu) / (2.0 / 3.0 * g * mu + 2.0 * bulk);
                let stress = g * 2.0 * mu * 2.0 / 3.0 * (e + t) + bulk * (e - 2.0 * t);
                (stress, mu * 2.0 / 3.0 * (e + t).powi(2))
            }
        }
    }

    fn force(&self, displacement: f64, phi: f64) -> f64 {
        let (e, stretch) = strain(displacement);
        area() * self.state(e, phi).0 / stretch
    }

    /// Returns ξ φ̇ = 2 (1 − η)(1 − φ) ψ⁺ − Gc/ℓ₀ φ, MPa.
    fn damage_force(&self, displacement: f64, phi: f64) -> f64 {
        let m = self.fracture();
        let psi = self.state(strain(displacement).0, phi).1;
        let resistance = m.toughness_n_per_mm / LENGTH;
        2.0 * (1.0 - m.residual_stiffness) * (1.0 - phi) * psi - resistance * phi
    }

    /// Integrates the damage by the backward Euler rule, each step by bisection. Returns displacement (mm), force (N) and
    /// φ of each step.
    fn backward_euler(&self, total: f64, duration: f64, steps: u32) -> Vec<[f64; 3]> {
        let mut phi = 0.0;
        let dt = duration / f64::from(steps);
        (1..=steps)
            .map(|k| {
                let u = total * f64::from(k) / f64::from(steps);
                let old = phi;
                let balance = |phi: f64| {
                    self.damage_force(u, phi) - self.fracture().viscosity_mpa_s * (phi - old) / dt
                };
                let (mut low, mut high) = (0.0, 1.0);
                for _ in 0..100 {
                    phi = 0.5 * (low + high);
                    if balance(phi) > 0.0 { low = phi } else { high = phi }
                }
                [u, self.force(u, phi), phi]
            })
            .collect()
    }

    /// Returns displacement (mm), force (N) and φ at the peak in the limit of small time steps, by a Runge–Kutta method.
    fn exact_peak(&self, total: f64, duration: f64) -> [f64; 3] {
        let steps = 20_000;
        let h = duration / f64::from(steps);
        let rate = |t: f64, phi: f64| {
            self.damage_force(total * t / duration, phi) / self.fracture().viscosity_mpa_s
        };
        let (mut phi, mut best) = (0.0, [0.0; 3]);
        for k in 0..steps {
            let t = h * f64::from(k);
            let a = rate(t, phi);
            let b = rate(t + 0.5 * h, phi + 0.5 * h * a);
            let c = rate(t + 0.5 * h, phi + 0.5 * h * b);
            let d = rate(t + h, phi + h * c);
            phi += h / 6.0 * (a + 2.0 * b + 2.0 * c + d);
            let u = total * (t + h) / duration;
            let force = self.force(u, phi);
            if force > best[1] {
                best = [u, force, phi];
            }
        }
        best
    }
}

#[test]
fn elastic_force_is_exact_for_both_elements_and_laws() {
    let (e, stretch) = strain(0.22);
    let hencky = area() * 275.0 * e / stretch;
    assert!((hencky - 291.5410).abs() < 5e-5, "the reference solution: {hencky}");
    for order in [Order::Linear, Order::Quadratic] {
        let outcome =
            test(prism(3, false), order, vec![matrix()], None, loading(0.22, 1.0, 2), 1e-11)
                .run(&mut ());
        let last = outcome.curve.last().expect("two points");
        assert!((last.force_n - hencky).abs() < 1e-9 * hencky, "{order:?}: {}", last.force_n);
        let energy = area() * HEIGHT * 0.5 * 275.0 * e * e;
        assert!((last.elastic_n_mm - energy).abs() < 1e-9 * energy);
    }
    // neo-Hookean: the lateral stretch s solves μ (s² − 1) + λ ln(s² stretch) = 0
    let soft = Material::neo_hookean(275.0, 0.25);
    let (mu, lame) = (110.0, 110.0);
    let (mut low, mut high) = (1.0f64, 1.1f64);
    for _ in 0..100 {
        let s = 0.5 * (low + high);
        if mu * (s * s - 1.0) + lame * (s * s * stretch).ln() < 0.0 { low = s } else { high = s }
    }
    let axial = mu * (stretch * stretch - 1.0) + lame * (low * low * stretch).ln();
    let exact = -area() * axial / stretch;
    for order in [Order::Linear, Order::Quadratic] {
        let outcome =
            test(prism(2, false), order, vec![soft.clone()], None, loading(0.22, 1.0, 2), 1e-11)
                .run(&mut ());
        let force = outcome.curve[1].force_n;
        assert!((force - exact).abs() < 1e-9 * exact, "{order:?}: {force} instead of {exact}");
    }
}

/// Compares finite elements with the reference solution of the same time integration rule, step by step.
fn assert_steps(split: Split, order: Order, quadrature: DamageQuadrature) {
    let field = PhaseField { quadrature, ..phase_field(split) };
    let oracle = Oracle { material: matrix(), split };
    let outcome =
        test(prism(2, false), order, vec![matrix()], Some(field), loading(0.22, 1.0, 11), 1e-11)
            .run(&mut ());
    let exact = oracle.backward_euler(0.22, 1.0, 11);
    assert_eq!(outcome.curve.len(), exact.len(), "{:?}", outcome.end);
    for (point, [u, force, phi]) in outcome.curve.iter().zip(exact) {
        assert!((point.displacement_mm - u).abs() < 1e-14);
        assert!(
            (point.force_n - force).abs() < 1e-8 * force,
            "{split:?} {order:?} {quadrature:?} at {u}: {} for {force}",
            point.force_n
        );
        assert!((point.phi_mean - phi).abs() < 1e-8 && (point.phi_max - phi).abs() < 1e-8);
    }
}

#[test]
fn damage_steps_are_exact_for_every_element_rule_and_split() {
    for split in [Split::None, Split::VolumetricDeviatoric, Split::Spectral] {
        for order in [Order::Linear, Order::Quadratic] {
            use DamageQuadrature::{Consistent, Eleven, Vertex};
            for quadrature in [Vertex, Consistent, Eleven] {
                assert_steps(split, order, quadrature);
            }
        }
    }
}

/// Compares the peak (displacement, force, φ) with published values, which were computed with 20 000 backward Euler steps
/// to 0.22 mm. The reference solution reproduces the published digits. The finite elements converge with O(Δt) to the
/// limit of small time steps.
fn assert_peak(split: Split, duration: f64, total: f64, published: [f64; 3], digits: [f64; 3]) {
    let oracle = Oracle { material: matrix(), split };
    let path = oracle.backward_euler(0.22, duration, 20_000);
    let top = path.iter().max_by(|a, b| a[1].total_cmp(&b[1])).expect("steps");
    for k in 0..3 {
        assert!((top[k] - published[k]).abs() < digits[k], "{top:?} instead of {published:?}");
    }
    // load only up to `total`, at the same rate, because the curve beyond the peak is not compared
    let duration = duration * total / 0.22;
    let exact = oracle.exact_peak(total, duration);
    let error = |steps: u32| {
        let field = phase_field(split);
        let outcome = test(
            prism(1, false),
            Order::Linear,
            vec![matrix()],
            Some(field),
            loading(total, duration, steps),
            1e-9,
        )
        .run(&mut ());
        peak(&outcome).1 - exact[1]
    };
    let errors = [44, 88, 176].map(error);
    for pair in errors.windows(2) {
        let ratio = pair[0] / pair[1];
        assert!((1.85..2.15).contains(&ratio), "errors {errors:?} N do not halve");
    }
    assert!(errors[2].abs() < 0.01 * exact[1], "{errors:?}");
}

#[test]
fn viscous_peak_at_one_second() {
    assert_peak(Split::None, 1.0, 0.22, [0.13559, 122.855, 0.1624], [5e-6, 5e-4, 5e-5]);
}

#[test]
fn viscous_peak_at_the_experimental_rate() {
    assert_peak(Split::None, 29.4, 0.11, [0.04794, 41.393, 0.16991], [5e-6, 5e-4, 5e-6]);
}

#[test]
fn viscous_peak_with_the_volumetric_deviatoric_split() {
    let published = [0.1452, 135.32, 0.1747];
    assert_peak(Split::VolumetricDeviatoric, 1.0, 0.22, published, [5e-5, 5e-3, 5e-5]);
}

#[test]
fn rate_independent_damage_follows_its_closed_form() {
    // σ = E ε/(1 + E ε² ℓ₀/Gc)² with φ = E ε²/(E ε² + Gc/ℓ₀), exact at every step for η = 0
    let brittle = matrix().with_fracture(Fracture::new(0.0025));
    let (young, toughness) = (brittle.elasticity.young_mpa(), 0.0025);
    let critical = (toughness / (3.0 * LENGTH * young)).sqrt();
    let strength = 9.0 / 16.0 * young * critical;
    assert!((critical - 7.1067e-3).abs() < 5e-8 && (strength - 1.09932).abs() < 5e-6);
    // with this displacement, the peak is at step 20 of 25
    let total = HEIGHT * (1.0 - (-1.25 * critical).exp());
    let outcome = test(
        prism(2, false),
        Order::Linear,
        vec![brittle],
        Some(phase_field(Split::None)),
        loading(total, 1.0, 25),
        1e-12,
    )
    .run(&mut ());
    assert_eq!(outcome.curve.len(), 25, "{:?}", outcome.end);
    for point in &outcome.curve {
        let (e, stretch) = strain(point.displacement_mm);
        let phi = young * e * e / (young * e * e + toughness / LENGTH);
        let stress = young * e / (1.0 + young * e * e * LENGTH / toughness).powi(2);
        assert!((point.phi_mean - phi).abs() < 1e-7, "φ {} instead of {phi}", point.phi_mean);
        assert!((point.force_n * stretch / area() - stress).abs() < 1e-7 * strength);
        assert!(stress <= strength * (1.0 + 1e-12));
    }
}

#[test]
fn rate_independent_peak_with_residual_stiffness() {
    let slow =
        matrix().with_fracture(Fracture { residual_stiffness: 0.01, ..Fracture::new(0.0025) });
    let outcome = test(
        prism(1, false),
        Order::Linear,
        vec![slow],
        Some(phase_field(Split::None)),
        loading(0.04, 1.0, 80),
        1e-10,
    )
    .run(&mut ());
    let (displacement, force) = peak(&outcome);
    assert!((force - 22.024).abs() < 5e-4, "{force} N");
    assert!((displacement - 0.03185).abs() < 2e-5, "{displacement} mm");
}
