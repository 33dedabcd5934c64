//! Viscoelastic and plastic laws at a point, against closed forms.

use nalgebra::{Matrix3, Rotation3};

use super::conformance::Deformed;
use super::*;

const YOUNG: f64 = 275.0;
const POISSON: f64 = 0.25;

fn series() -> Viscoelasticity {
    Viscoelasticity::shear([
        PronyTerm { fraction: 0.3, time_s: 0.1 },
        PronyTerm { fraction: 0.2, time_s: 1.0 },
    ])
}

fn steel() -> Plasticity {
    let hardening = Hardening::Voce { saturation_mpa: 1100.94, rate: 1.94557 };
    let rate = Some(PlasticRate::JohnsonCook { c: 0.0398, reference_per_s: 1e-5 });
    Plasticity { hardening, rate, ..Plasticity::new(233.22) }
}

fn field(split: Split) -> PhaseField {
    PhaseField { split, ..PhaseField::new(0.06) }
}

fn broken(material: Material) -> Material {
    material.with_fracture(Fracture::new(0.01))
}

#[test]
fn viscoelastic_laws_conform() {
    let mut both = series();
    both.bulk = vec![PronyTerm { fraction: 0.4, time_s: 0.3 }];
    both.moduli = PronyModuli::LongTerm;
    let rubber = MooneyRivlin { c10_mpa: 40.0, c01_mpa: 15.0, bulk_mpa: 200.0 };
    let rubber = Material::hyperelastic(rubber).expect("a law");
    for series in [series(), both] {
        for law in [Material::hencky(YOUNG, POISSON), rubber.clone()] {
            let material = law.with_viscoelasticity(series.clone());
            assert_material(&material, None);
            for split in [Split::None, Split::VolumetricDeviatoric] {
                assert_material(&broken(material.clone()), Some(&field(split)));
                let kept = PhaseField { degrade: EnergySet::default(), ..field(split) };
                assert_material(&broken(material.clone()), Some(&kept));
            }
        }
    }
}

#[test]
fn plastic_laws_conform() {
    let cone = |dilatancy_deg| YieldCriterion::DruckerPrager { friction_deg: 30.0, dilatancy_deg };
    let soft =
        Plasticity { hardening: Hardening::Linear { modulus_mpa: 30.0 }, ..Plasticity::new(4.0) };
    let swift = Hardening::Swift { factor_mpa: 30.0, offset: 0.01, exponent: 0.4 };
    let laws = [
        steel(),
        Plasticity { yield_mpa: 5.0, ..steel() },
        soft.clone(),
        Plasticity { hardening: swift, ..soft.clone() },
        Plasticity { criterion: cone(30.0), ..soft.clone() },
        Plasticity { criterion: cone(10.0), ..soft },
    ];
    for law in laws {
        let material = Material::hencky(YOUNG, POISSON).with_plasticity(law);
        assert_material(&material, None);
        for split in [Split::None, Split::VolumetricDeviatoric] {
            assert_material(&broken(material.clone()), Some(&field(split)));
            let all = EnergySet { viscous: true, plastic: true };
            let all = PhaseField { drive: all, degrade: all, ..field(split) };
            assert_material(&broken(material.clone()), Some(&all));
        }
    }
}

#[test]
fn elastic_laws_that_are_no_sum_of_volume_and_shape_are_refused() {
    let material = Material::neo_hookean(YOUNG, POISSON).with_viscoelasticity(series());
    let error = material.validate("binder", None).expect_err("refused");
    assert!(error.to_string().contains("binder"), "{error}");
    let material = Material::neo_hookean(YOUNG, POISSON).with_plasticity(steel());
    assert!(material.validate("binder", None).is_err());
}

/// Deforms a point along a path of displacement gradients, all of the same duration.
fn along(material: &Material, path: impl Iterator<Item = Matrix3<f64>>, dt: f64) -> Vec<Deformed> {
    let point = material.at_point(None);
    let mut old = vec![0.0; material.state_len()];
    path.map(|h| {
        let at = Deformed::from_state(&point, &h, 1.0, dt, &old).expect("det F > 0");
        old.clone_from(&at.state);
        at
    })
    .collect()
}

/// Shear by γ in the plane xy: the shear stress at small strain is G γ.
fn sheared(gamma: f64) -> Matrix3<f64> {
    Matrix3::new(0.0, gamma, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
}

fn shear_modulus() -> f64 {
    YOUNG / (2.0 * (1.0 + POISSON))
}

/// G(t) = G₀ (γ_∞ + Σ γ_i e^(−t/τ_i)) after a jump in one very short increment.
#[test]
fn a_held_shear_relaxes_by_the_prony_series() {
    let material = Material::hencky(YOUNG, POISSON).with_viscoelasticity(series());
    let point = material.at_point(None);
    let gamma = 1e-6;
    let mut old = vec![0.0; material.state_len()];
    let mut time = 0.0;
    for step in 0..60 {
        let dt = if step == 0 { 1e-9 } else { 0.05 };
        time += dt;
        let at = Deformed::from_state(&point, &sheared(gamma), 1.0, dt, &old).expect("sound");
        let exact = shear_modulus() * gamma * series().relaxed_shear(time);
        let stress = at.piola()[(0, 1)];
        assert!((stress / exact - 1.0).abs() < 1e-6, "{stress} and {exact} MPa at {time} s");
        old = at.state;
    }
}

/// Storage and loss modulus over six decades of frequency, from the last of some periods of a harmonic shear.
/// The reference temperature is above absolute zero, and a part of each modulus remains.
#[test]
fn series_without_a_remaining_modulus_or_a_real_temperature_are_refused() {
    let refused = |series: &Viscoelasticity, fragments: [&str; 2]| {
        let message = series.validate("material.matrix").expect_err("refused").to_string();
        assert!(fragments.iter().all(|fragment| message.contains(fragment)), "{message}");
    };
    for (shift, table) in [
        (TimeShift::Wlf { c1: 17.44, c2_kelvin: 51.6, reference_celsius: -280.0 }, "shift.wlf"),
        (
            TimeShift::Arrhenius { energy_kj_per_mol: 80.0, reference_celsius: -280.0 },
            "shift.arrhenius",
        ),
    ] {
        let shifted = Viscoelasticity { shift: Some(shift), ..series() };
        refused(&shifted, [table, "reference_celsius = -280"]);
        assert!(shift.validate("test", 20.0).is_err());
    }
    let of = |fractions: [f64; 2], moduli| {
        let terms = fractions.map(|fraction| PronyTerm { fraction, time_s: 1.0 });
        Viscoelasticity { moduli, ..Viscoelasticity::shear(terms) }
    };
    for moduli in [PronyModuli::Instantaneous, PronyModuli::LongTerm] {
        refused(&of([0.25, 0.75], moduli), ["viscoelastic.shear", "fraction = 1"]);
        assert!(of([0.25, 0.749_999], moduli).validate("material.matrix").is_ok());
    }
    refused(&of([0.25, 0.749_999_9], PronyModuli::LongTerm), ["fraction = 0.9999999", "0.999999"]);
    assert!(of([0.25, 0.749_999_9], PronyModuli::Instantaneous).validate("matrix").is_ok());
}

#[test]
fn harmonic_shear_has_the_storage_and_loss_modulus_of_the_series() {
    let material = Material::hencky(YOUNG, POISSON).with_viscoelasticity(series());
    for decade in -3..=3 {
        let omega = 10f64.powi(decade);
        let steps = 2000;
        let dt = std::f64::consts::TAU / (omega * f64::from(steps));
        // the transient decays with the longest relaxation time, 1 s
        let periods = 2 + (20.0 * omega / std::f64::consts::TAU).min(300.0) as i32;
        let gamma = 1e-6;
        let total = periods * steps;
        let path = (1..=total).map(|k| sheared(gamma * (omega * dt * f64::from(k)).sin()));
        let stress: Vec<f64> =
            along(&material, path, dt).iter().map(|at| at.piola()[(0, 1)]).collect();
        let mut moduli = [0.0; 2];
        for k in total - steps + 1..=total {
            let (sin, cos) = (omega * dt * f64::from(k)).sin_cos();
            let value = stress[k as usize - 1] * 2.0 / (gamma * f64::from(steps) * shear_modulus());
            moduli[0] += value * sin;
            moduli[1] += value * cos;
        }
        let exact = series().dynamic_shear(omega);
        for (found, exact) in moduli.iter().zip(exact) {
            assert!((found - exact).abs() < 1e-3, "{moduli:?} and {exact:?} at {omega} rad/s");
        }
    }
}

/// The stress after a rotation of the relaxed, finitely strained body is the rotated stress. This holds although a
/// second, different strain has turned the axes of the strain away from the axes of the stored stresses.
#[test]
fn a_rotation_between_increments_rotates_the_stress() {
    let material = Material::hencky(YOUNG, POISSON).with_viscoelasticity(series());
    let (first, second) = (0.4 * sheared(1.0), 0.3 * sheared(1.0).transpose());
    let turn = Rotation3::from_euler_angles(0.3, 1.1, -0.4).into_inner();
    let identity = Matrix3::identity();
    let turned = turn * (identity + second) - identity;
    let [plain, rotated] = [second, turned].map(|end| {
        let path = [first, end];
        along(&material, path.into_iter(), 0.07).pop().expect("two increments").piola()
    });
    assert!((turn * plain - rotated).norm() < 1e-10 * YOUNG);
}

/// Uniaxial stress: the lateral stretch follows from zero lateral stress. τ = σ_y(α), ln λ = τ/E + α.
#[test]
fn uniaxial_tension_follows_the_hardening() {
    let law = Plasticity { rate: None, ..steel() };
    let material = Material::hencky(199_950.0, 0.27).with_plasticity(law.clone());
    let point = material.at_point(None);
    let mut old = vec![0.0; material.state_len()];
    for step in 1..=50 {
        let axial = 0.01 * f64::from(step);
        let mut lateral = -0.5 * axial;
        let mut at = None;
        for _ in 0..60 {
            let h = Matrix3::from_diagonal(
                &[lateral.exp_m1(), lateral.exp_m1(), axial.exp_m1()].into(),
            );
            let now = Deformed::from_state(&point, &h, 1.0, 1.0, &old).expect("sound");
            let stress = now.piola()[(0, 0)] * (1.0 + h[(0, 0)]);
            // bulk stiffness: both lateral strains change together
            lateral -= stress / (2.0 * point.moduli.bulk);
            at = Some(now);
        }
        let at = at.expect("an iteration");
        let alpha = at.state[6];
        let tau = at.piola()[(2, 2)] * axial.exp();
        let Hardening::Voce { saturation_mpa, rate } = law.hardening else { unreachable!() };
        let exact = law.yield_mpa + saturation_mpa * -(-rate * alpha).exp_m1();
        assert!((tau / exact - 1.0).abs() < 1e-9, "{tau} and {exact} MPa at strain {axial}");
        assert!((axial - alpha - tau / 199_950.0).abs() < 1e-9);
        // C_p⁻¹ has the determinant one: plastic flow keeps the volume
        let [xx, yx, yy, zx, zy, zz] = *at.state.first_chunk::<6>().expect("six values");
        let plastic = Matrix3::new(xx, yx, zx, yx, yy, zy, zx, zy, zz) + Matrix3::identity();
        assert!((plastic.determinant() - 1.0).abs() < 1e-10);
        old = at.state;
    }
}

/// Pure tension beyond the apex of the cone: the mean stress is cohesion / tan(friction).
#[test]
fn hydrostatic_tension_ends_at_the_apex_of_the_cone() {
    let criterion = YieldCriterion::DruckerPrager { friction_deg: 30.0, dilatancy_deg: 30.0 };
    let law = Plasticity { criterion, ..Plasticity::new(2.0) };
    let material = Material::hencky(YOUNG, POISSON).with_plasticity(law);
    let path = (1..5).map(|k| Matrix3::identity() * (0.02 * f64::from(k)));
    for at in along(&material, path, 1.0) {
        let h = at.principal.push[0].iter().map(|x| x * x).sum::<f64>().sqrt().recip();
        let pressure = at.piola().trace() / 3.0 * h;
        let exact = 2.0 / 30f64.to_radians().tan();
        assert!((pressure / exact - 1.0).abs() < 1e-9, "{pressure} and {exact} MPa");
    }
}

/// Uniaxial strain rates: the yield stress rises by 1 + C ln(α̇/ε̇₀).
#[test]
fn the_rate_factor_is_that_of_johnson_and_cook() {
    let rate = Some(PlasticRate::JohnsonCook { c: 0.05, reference_per_s: 1e-3 });
    let law = Plasticity { rate, ..Plasticity::new(200.0) };
    let material = Material::hencky(200_000.0, 0.3).with_plasticity(law);
    for per_second in [1e-4, 1e-3, 1.0, 1e3] {
        // without hardening, the rate of plastic shear equals the rate of shear once the stress is constant
        let gamma = 0.02;
        let dt = 3f64.sqrt().recip() * gamma / per_second;
        let path = (1..=20).map(|k| sheared(gamma * f64::from(k)));
        let at = along(&material, path, dt).pop().expect("an increment");
        let stress = at.response.stress;
        let mean = stress.iter().sum::<f64>() / 3.0;
        let square: f64 = stress.iter().map(|t| (t - mean).powi(2)).sum();
        let found = (1.5 * square).sqrt();
        let exact = 200.0 * (1.0 + 0.05 * (per_second / 1e-3f64).ln().max(0.0));
        // logarithmic shear rate and shear rate differ at 40 % shear
        assert!((found / exact - 1.0).abs() < 2e-3, "{found} and {exact} MPa");
    }
}
