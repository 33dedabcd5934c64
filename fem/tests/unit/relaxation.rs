//! Viscoelastic laws at a point, against equations that this file integrates by itself and against numbers.

use nalgebra::Matrix3;

use super::conformance::Deformed;
use super::*;

const YOUNG: f64 = 275.0;
const POISSON: f64 = 0.25;
const BULK: f64 = YOUNG / (3.0 * (1.0 - 2.0 * POISSON));
const SHEAR: f64 = YOUNG / (2.0 * (1.0 + POISSON));
const MOONEY: MooneyRivlin = MooneyRivlin { c10_mpa: 40.0, c01_mpa: 15.0, bulk_mpa: 200.0 };

fn terms(pairs: &[(f64, f64)]) -> Vec<PronyTerm> {
    pairs.iter().map(|&(fraction, time_s)| PronyTerm { fraction, time_s }).collect()
}

/// Series with terms of both moduli.
fn both(moduli: PronyModuli) -> Viscoelasticity {
    let (shear, bulk) = (terms(&[(0.3, 0.1), (0.2, 1.0)]), terms(&[(0.25, 0.3), (0.15, 2.0)]));
    Viscoelasticity { moduli, shear, bulk, shift: None }
}

/// Elastic law in uniaxial deformation, as a function of the axial and the lateral logarithmic strain: axial and lateral
/// component of the deviatoric Kirchhoff stress, and the mean Kirchhoff stress, MPa.
type Uniaxial = fn([f64; 2]) -> [f64; 3];

fn hencky([axial, lateral]: [f64; 2]) -> [f64; 3] {
    let deviator = 2.0 * SHEAR * (axial - lateral);
    [deviator * 2.0 / 3.0, -deviator / 3.0, BULK * (axial + 2.0 * lateral)]
}

/// dev τ = 2 C₁₀ dev b̄ − 2 C₀₁ dev b̄⁻¹, p = K (J² − 1)/2.
fn mooney_rivlin([axial, lateral]: [f64; 2]) -> [f64; 3] {
    let isochoric = 2.0 / 3.0 * (axial - lateral);
    let [a, b] = [isochoric, -0.5 * isochoric].map(|e| (2.0 * e).exp());
    let difference = 2.0 * MOONEY.c10_mpa * (a - b) - 2.0 * MOONEY.c01_mpa * (1.0 / a - 1.0 / b);
    let volume = 0.5 * MOONEY.bulk_mpa * (2.0 * (axial + 2.0 * lateral)).exp_m1();
    [difference * 2.0 / 3.0, -difference / 3.0, volume]
}

/// Uniaxial stress of Simo's law in the material frame, as ordinary differential equations. Each shear term has the
/// variables Q = H − S̃, axial and lateral, and each bulk term has one variable q = h − p with the elastic mean stress p:
/// dQ/dt = −(Q + S̃)/τ. S̃ = J^(2/3) dev τ/λ² follows from the strains, and the lateral strain from the lateral stress zero.
struct Reference {
    law: Uniaxial,
    series: Viscoelasticity,
}

impl Reference {
    /// Ratios of the instantaneous moduli to the moduli of the law.
    fn ratios(&self) -> [f64; 2] {
        [&self.series.shear, &self.series.bulk].map(|terms| match self.series.moduli {
            PronyModuli::Instantaneous => 1.0,
            PronyModuli::LongTerm => {
                1.0 / (1.0 - terms.iter().map(|term| term.fraction).sum::<f64>())
            }
        })
    }

    /// Elastic stress with the instantaneous moduli: S̃, axial and lateral, and the mean stress.
    fn elastic(&self, strain: [f64; 2]) -> [f64; 3] {
        let ([shear, bulk], [axial, lateral, mean]) = (self.ratios(), (self.law)(strain));
        let scale = (2.0 / 3.0 * (strain[0] + 2.0 * strain[1])).exp() * shear;
        [
            axial * scale * (-2.0 * strain[0]).exp(),
            lateral * scale * (-2.0 * strain[1]).exp(),
            mean * bulk,
        ]
    }

    /// Axial and lateral Kirchhoff stress.
    fn stress(&self, strain: [f64; 2], q: &[f64]) -> [f64; 2] {
        let s = self.elastic(strain);
        let scale = (-2.0 / 3.0 * (strain[0] + 2.0 * strain[1])).exp();
        let mut deviator = s;
        let Viscoelasticity { shear, bulk, .. } = &self.series;
        for (term, q) in shear.iter().zip(q.chunks(2)) {
            // S = γ_∞ S̃ + Σ γ H, and γ_∞ + Σ γ = 1
            (0..2).for_each(|k| deviator[k] += term.fraction * q[k]);
        }
        let mean: f64 =
            bulk.iter().zip(&q[2 * shear.len()..]).map(|(term, q)| term.fraction * q).sum();
        let [axial, lateral] = [0, 1].map(|k| scale * deviator[k] * (2.0 * strain[k]).exp());
        let third = (axial + 2.0 * lateral) / 3.0;
        [axial, lateral].map(|t| t - third + s[2] + mean)
    }

    /// Lateral strain at which the lateral stress is zero, by the secant method.
    fn lateral(&self, axial: f64, q: &[f64]) -> f64 {
        let stress = |lateral| self.stress([axial, lateral], q)[1];
        let (mut a, mut b) = (-0.3 * axial, -0.4 * axial - 1e-6);
        let (mut at_a, mut at_b) = (stress(a), stress(b));
        for _ in 0..50 {
            if at_b.abs() < 1e-12 || at_a == at_b {
                break;
            }
            (a, b) = (b, b - at_b * (b - a) / (at_b - at_a));
            (at_a, at_b) = (at_b, stress(b));
        }
        b
    }

    fn rates(&self, axial: f64, q: &[f64]) -> Vec<f64> {
        let s = self.elastic([axial, self.lateral(axial, q)]);
        let Viscoelasticity { shear, bulk, .. } = &self.series;
        let pairs = shear.iter().flat_map(|term| [(term.time_s, s[0]), (term.time_s, s[1])]);
        let driven = pairs.chain(bulk.iter().map(|term| (term.time_s, s[2])));
        driven.zip(q).map(|((time_s, s), q)| -(q + s) / time_s).collect()
    }

    /// Axial Kirchhoff stress at the end of each of `steps` equal steps, by the Runge–Kutta method of fourth order.
    fn run(&self, axial: impl Fn(f64) -> f64, end_s: f64, steps: usize) -> Vec<f64> {
        let Viscoelasticity { shear, bulk, .. } = &self.series;
        let mut q = vec![0.0; 2 * shear.len() + bulk.len()];
        let dt = end_s / steps as f64;
        let moved = |q: &[f64], rates: &[f64], by: f64| -> Vec<f64> {
            q.iter().zip(rates).map(|(q, rate)| q + by * rate).collect()
        };
        (0..steps)
            .map(|step| {
                let t = dt * step as f64;
                let first = self.rates(axial(t), &q);
                let second = self.rates(axial(t + 0.5 * dt), &moved(&q, &first, 0.5 * dt));
                let third = self.rates(axial(t + 0.5 * dt), &moved(&q, &second, 0.5 * dt));
                let fourth = self.rates(axial(t + dt), &moved(&q, &third, dt));
                for k in 0..q.len() {
                    q[k] += dt / 6.0 * (first[k] + 2.0 * (second[k] + third[k]) + fourth[k]);
                }
                let end = axial(t + dt);
                self.stress([end, self.lateral(end, &q)], &q)[0]
            })
            .collect()
    }
}

/// Axial Kirchhoff stress of the material in uniaxial stress, at the end of each step.
fn uniaxial(material: &Material, axial: impl Fn(f64) -> f64, end_s: f64, steps: usize) -> Vec<f64> {
    let point = material.at_point(None);
    let mut old = vec![0.0; material.state_len()];
    let dt = end_s / steps as f64;
    let mut lateral = 0.0;
    (1..=steps)
        .map(|step| {
            let stretch = axial(dt * step as f64).exp_m1();
            for _ in 0..40 {
                let h = Matrix3::from_diagonal(&[lateral, lateral, stretch].into());
                let at = Deformed::from_state(&point, &h, 1.0, dt, &old).expect("det F > 0");
                let (stress, moduli) = (at.piola(), at.moduli());
                if stress[(0, 0)].abs() < 1e-11 {
                    old = at.state;
                    return stress[(2, 2)] * (1.0 + stretch);
                }
                // both lateral stretches change together
                lateral -= stress[(0, 0)] / (moduli[(0, 0)] + moduli[(0, 4)]);
            }
            panic!("the lateral stress does not vanish in step {step}");
        })
        .collect()
}

/// A bar is stretched by 60 % or compressed to 65 % in 0.2 s and then held. The error of the algorithm is of second order
/// in the step.
#[test]
fn finite_uniaxial_relaxation_follows_the_differential_equation() {
    let rubber = || Material::hyperelastic(MOONEY).expect("a law");
    let laws: [(Material, Uniaxial); 2] =
        [(Material::hencky(YOUNG, POISSON), hencky), (rubber(), mooney_rivlin)];
    let shear = Viscoelasticity::shear(terms(&[(0.3, 0.1), (0.2, 1.0)]));
    let bulk = Viscoelasticity { shear: Vec::new(), ..both(PronyModuli::Instantaneous) };
    let all = [shear, bulk, both(PronyModuli::Instantaneous), both(PronyModuli::LongTerm)];
    const STEPS: usize = 200;
    for (elastic, law) in laws {
        for series in &all {
            for strain in [1.6f64.ln(), 0.65f64.ln()] {
                let axial = |t: f64| strain * (t / 0.2).min(1.0);
                let material = elastic.clone().with_viscoelasticity(series.clone());
                let reference = Reference { law, series: series.clone() };
                // the kink at 0.2 s is at the end of a step
                let exact = reference.run(axial, 2.0, 4 * STEPS);
                let size = exact.iter().fold(0.0f64, |most, x| most.max(x.abs()));
                let error = |refine: usize| {
                    let stress = uniaxial(&material, axial, 2.0, refine * STEPS);
                    let ends = stress.iter().skip(refine - 1).step_by(refine);
                    let exact = exact.iter().skip(3).step_by(4);
                    ends.zip(exact).fold(0.0f64, |most, (a, b)| most.max((a - b).abs())) / size
                };
                let [coarse, fine] = [1, 2].map(error);
                let order = (coarse / fine).log2();
                assert!(
                    fine < 2e-5 && (1.8..2.2).contains(&order),
                    "errors {coarse:e} and {fine:e}, order {order}, for {series:?} and strain {strain}"
                );
            }
        }
    }
}

/// K(t) = K₀ (κ_∞ + Σ κ_i e^(−t/t_i)) after a jump of the volume, and p = K₀ r (κ_∞ t + Σ κ_i t_i (1 − e^(−t/t_i))) at the
/// constant rate r of ln J. The algorithm is exact for both.
#[test]
fn the_pressure_relaxes_by_the_terms_of_the_bulk_modulus() {
    let series = both(PronyModuli::Instantaneous);
    let material = Material::hencky(YOUNG, POISSON).with_viscoelasticity(series);
    let point = material.at_point(None);
    // 1 − 0.25 − 0.15 remains
    let held = |t: f64| 0.6 + 0.25 * (-t / 0.3).exp() + 0.15 * (-t / 2.0).exp();
    let ramp =
        |t: f64| 0.6 * t - 0.25 * 0.3 * (-t / 0.3).exp_m1() - 0.15 * 2.0 * (-t / 2.0).exp_m1();
    let mut states = [vec![0.0; material.state_len()], vec![0.0; material.state_len()]];
    let mut time = 0.0;
    for step in 0..40 {
        let dt = if step == 0 { 1e-9 } else { 0.1 };
        time += dt;
        let [jumped, ramped] = &mut states;
        for (old, log_volume, exact) in
            [(jumped, 0.03, 0.03 * held(time)), (ramped, 0.01 * time, 0.01 * ramp(time))]
        {
            let h = Matrix3::identity() * (log_volume / 3.0f64).exp_m1();
            let at = Deformed::from_state(&point, &h, 1.0, dt, old).expect("det F > 0");
            let pressure = at.response.stress[0];
            assert!((pressure - BULK * exact).abs() < 1e-8 * BULK * 0.03, "{pressure} at {time} s");
            *old = at.state;
        }
    }
}

/// The moduli of the elastic law are the moduli at time zero, or the moduli after infinite time.
#[test]
fn the_stated_moduli_are_those_at_time_zero_or_after_infinite_time() {
    let sheared = Matrix3::new(0.0, 1e-6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    let swollen = Matrix3::identity() * 1e-6;
    for (moduli, shear, bulk) in [
        (PronyModuli::Instantaneous, [1.0, 0.5], [1.0, 0.6]),
        (PronyModuli::LongTerm, [1.0 / 0.5, 1.0], [1.0 / 0.6, 1.0]),
    ] {
        let material = Material::hencky(YOUNG, POISSON).with_viscoelasticity(both(moduli));
        let point = material.at_point(None);
        for (h, entry, modulus, exact) in
            [(sheared, (0, 1), SHEAR, shear), (swollen, (0, 0), 3.0 * BULK, bulk)]
        {
            let mut old = vec![0.0; material.state_len()];
            for (dt, exact) in [(1e-9, exact[0]), (1e3, exact[1])] {
                let at = Deformed::from_state(&point, &h, 1.0, dt, &old).expect("det F > 0");
                let ratio = at.piola()[entry] / (modulus * 1e-6);
                assert!((ratio / exact - 1.0).abs() < 1e-5, "{ratio}, not {exact}, for {moduli:?}");
                old = at.state;
            }
        }
    }
}

/// The numbers are 10^(−17.44 ΔT/(51.6 + ΔT)) for ΔT = 10 and −20 K, and e^(E/R (1/T − 1/T₀)) for E = 80 kJ/mol and T₀ =
/// 50 °C at 20 and 80 °C.
#[test]
fn relaxation_times_shift_with_the_temperature() {
    let wlf = TimeShift::Wlf { c1: 17.44, c2_kelvin: 51.6, reference_celsius: 50.0 };
    let arrhenius = TimeShift::Arrhenius { energy_kj_per_mol: 80.0, reference_celsius: 50.0 };
    for (shift, celsius, exact) in [
        (wlf, 60.0, 1.475_132_966_610_55e-3),
        (wlf, 30.0, 1.091_376_714_651_27e11),
        (wlf, 50.0, 1.0),
        (arrhenius, 20.0, 21.053_650_698_110_5),
        (arrhenius, 80.0, 0.079_708_607_296_936_9),
        (arrhenius, 50.0, 1.0),
    ] {
        let factor = shift.factor(celsius);
        assert!((factor / exact - 1.0).abs() < 1e-9, "{factor}, not {exact}, at {celsius} °C");
        // the stress at a time t of the shifted law is the stress at t/a_T of the law at the reference temperature
        let series = Viscoelasticity { shift: Some(shift), ..both(PronyModuli::Instantaneous) };
        let unshifted = Viscoelasticity { shift: None, ..series.clone() };
        let law = |series| Material::hencky(YOUNG, POISSON).with_viscoelasticity(series);
        let stress = |material: &Material, end_s: f64| {
            uniaxial(material, |t| 0.3 * t / end_s, end_s, 10).pop().expect("a step")
        };
        let shifted = law(series).at_temperature(celsius);
        let [a, b] = [stress(&shifted, 0.4 * exact), stress(&law(unshifted), 0.4)];
        assert!((a / b - 1.0).abs() < 1e-9, "{a} and {b} MPa at {celsius} °C");
    }
}
