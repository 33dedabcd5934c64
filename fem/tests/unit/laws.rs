//! Every law compared with independent formulas, at single points and at several points in SIMD lanes.

use faer::traits::pulp::{self, Simd, WithSimd};
use nalgebra::{Matrix3, SMatrix, SVector};
use num_dual::hessian;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::conformance::{Deformed, states};
use super::principal::Strains;
use super::*;

const YOUNG: f64 = 275.0;
const POISSON: f64 = 0.25;

/// The laws as in the published formulas.
#[derive(Clone, Copy, Debug)]
enum Printed {
    Hencky,
    NeoHookean,
}

impl Printed {
    fn written_out(self) -> Material {
        match self {
            Printed::Hencky => Material::hencky(YOUNG, POISSON),
            Printed::NeoHookean => Material::neo_hookean(YOUNG, POISSON),
        }
    }

    /// Returns ψ⁺ and ψ⁻, MPa, for real or dual numbers.
    fn energies<T: Scalar>(self, split: Split, e: [T; 3]) -> [T; 2] {
        let shear = YOUNG / (2.0 * (1.0 + POISSON));
        let bulk = YOUNG / (3.0 * (1.0 - 2.0 * POISSON));
        let lame = YOUNG * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
        let trace = e[0] + e[1] + e[2];
        let squares = |e: [T; 3]| e[0] * e[0] + e[1] * e[1] + e[2] * e[2];
        let deviatoric = (squares(e) - trace * trace / 3.0) * shear;
        let volumetric = trace * trace * (bulk / 2.0);
        let zero = trace.constant(0.0);
        let compressed = trace.less_than(zero);
        let split_energy = |whole: T, in_compression: T| {
            let spared = T::select(compressed, in_compression, zero);
            [whole - spared, spared]
        };
        match (self, split) {
            (Printed::Hencky, Split::None) => [deviatoric + volumetric, zero],
            (Printed::Hencky, Split::VolumetricDeviatoric) => {
                split_energy(deviatoric + volumetric, volumetric)
            }
            (Printed::Hencky, Split::Spectral) => [1.0, -1.0].map(|sign| {
                let trace = (trace * sign).max(zero);
                trace * trace * (lame / 2.0) + squares(e.map(|x| (x * sign).max(zero))) * shear
            }),
            (Printed::NeoHookean, _) => {
                let first = (e[0] * 2.0).exp() + (e[1] * 2.0).exp() + (e[2] * 2.0).exp();
                let whole =
                    (first - 3.0 - trace * 2.0) * (shear / 2.0) + trace * trace * (lame / 2.0);
                let of_volume = ((trace * (2.0 / 3.0)).exp() - 1.0 - trace * (2.0 / 3.0))
                    * (1.5 * shear)
                    + trace * trace * (lame / 2.0);
                let splits = split == Split::VolumetricDeviatoric;
                split_energy(whole, if splits { of_volume } else { zero })
            }
        }
    }
}

impl HyperelasticLaw for Printed {
    fn energy<T: Scalar>(&self, strain: &PrincipalStrain<T>) -> T {
        self.energies(Split::None, strain.log())[0]
    }
}

fn split_field(split: Split) -> PhaseField {
    PhaseField { split, ..PhaseField::new(1.0) }
}

fn damaged(material: Material, split: Split) -> PointMaterial {
    material.with_fracture(Fracture::new(1.0)).at_point(Some(&split_field(split)))
}

fn deform(material: &PointMaterial, state: &Matrix3<f64>, g: f64) -> Deformed {
    Deformed::new(material, state, g).expect("det F > 0")
}

/// Returns the deformation without rotation that has these logarithmic strains, for real or dual numbers.
fn stretched<T: Scalar>(log: [T; 3]) -> Principal<T> {
    let (zero, one) = (log[0].constant(0.0), log[0].constant(1.0));
    let axes = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    let strains = Strains::new(log, log.map(|e| (e * 2.0).exp_m1()));
    Principal { strains, basis: axes, push: axes, sound: one }
}

/// Returns both laws with each of their splits, with and without the hybrid model.
fn forms() -> Vec<(Printed, Split, bool)> {
    let splits = [Split::None, Split::VolumetricDeviatoric, Split::Spectral];
    let hencky = splits.map(|split| (Printed::Hencky, split));
    let neo_hookean = splits[..2].iter().map(|&split| (Printed::NeoHookean, split));
    let all = hencky.into_iter().chain(neo_hookean);
    all.flat_map(|(law, split)| [false, true].map(|hybrid| (law, split, hybrid))).collect()
}

#[test]
fn every_law_passes_the_conformance_test() {
    for (law, split, hybrid) in forms() {
        let material = law.written_out().with_fracture(Fracture::new(1.0));
        assert_material(&material, Some(&PhaseField { hybrid, ..split_field(split) }));
    }
    for law in examples() {
        for split in [Split::None, Split::VolumetricDeviatoric] {
            let material = law.clone().with_fracture(Fracture::new(1.0));
            assert_material(&material, Some(&split_field(split)));
        }
        assert_material(&law, None);
    }
}

/// Returns g ψ⁺ + ψ⁻ by the published formulas.
fn printed_energy<T: Scalar>((law, split, hybrid): (Printed, Split, bool), e: [T; 3], g: f64) -> T {
    let [plus, minus] = law.energies(split, e);
    plus * g + minus * if hybrid { g } else { 1.0 }
}

/// Energies, stress, tangent and shear terms of the built-in laws, compared with the published energy differentiated by
/// dual numbers.
#[test]
fn laws_are_the_derivatives_of_their_printed_energies() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
    let close = |x: f64, y: f64, tolerance: f64, strain: &[f64; 3]| {
        assert!((x - y).abs() < tolerance * YOUNG, "{x} and {y} at {strain:?}")
    };
    for form in forms() {
        let (law, split, hybrid) = form;
        let material = law.written_out().with_fracture(Fracture::new(1.0));
        let material = material.at_point(Some(&PhaseField { hybrid, ..split_field(split) }));
        for _ in 0..20 {
            let e: [f64; 3] = std::array::from_fn(|_| rng.random_range(-0.4..0.3));
            let computed = material.respond(&stretched(e), 0.3);
            let (energy, stress, tangent): (f64, SVector<f64, 3>, SMatrix<f64, 3, 3>) =
                hessian(|e| printed_energy(form, [e[0], e[1], e[2]], 0.3), &SVector::from(e));
            close(computed.energy, energy, 1e-12, &e);
            close(computed.driving, law.energies(split, e)[0], 1e-12, &e);
            for i in 0..3 {
                close(computed.stress[i], stress[i], 1e-12, &e);
                for j in 0..=i {
                    close(computed.normal[packed(i, j)], tangent[(i, j)], 1e-12, &e);
                }
                let (a, b) = ((i + 1) % 3, (i + 2) % 3);
                // the tolerance is large because the division in the reference formula loses digits
                let shear = 0.5 * (stress[a] - stress[b]) / (e[a] - e[b]).tanh();
                close(computed.shear[i], shear, 1e-11, &e);
            }
        }
    }
}

/// The derivatives that the kernel computes explicitly with real numbers equal the derivatives that dual numbers give.
#[test]
fn explicit_derivatives_equal_derivatives_by_dual_numbers() {
    let laws = [Material::hencky(YOUNG, POISSON).at_point(None).law()];
    fn respond<T: Scalar>(laws: &[RegionLaw], e: [T; 3], g: f64) -> Response<T> {
        let moduli = [150.0, 110.0].map(|x| e[0].constant(x));
        let (g, dt) = (e[0].constant(g), e[0].constant(1.0));
        let law = LaneLaw::new(laws, e[0].constant(0.0), moduli, None);
        law.respond::<true>(&stretched(e), g, dt, &[], &mut [])
    }
    let e = [0.1, -0.2, 0.05];
    let of_one = respond(&laws, e, 0.3);
    for k in 0..3 {
        let mut along = e.map(num_dual::Dual64::from);
        along[k] = along[k].derivative();
        let dual = respond(&laws, along, 0.3);
        assert!((dual.energy.eps - of_one.stress[k]).abs() < 1e-13 * YOUNG);
        for i in 0..3 {
            let computed = of_one.normal[packed(i.max(k), i.min(k))];
            assert!((dual.stress[i].eps - computed).abs() < 1e-13 * YOUNG);
        }
    }
}

fn assert_same(a: &Response<f64>, b: &Response<f64>, tolerance: f64, at: &[f64; 3]) {
    for (x, y) in a.components().into_iter().zip(b.components()) {
        assert!((x - y).abs() < tolerance * YOUNG, "{x} and {y} at {at:?}");
    }
}

#[test]
fn laws_given_by_their_energy_equal_built_in_laws_for_close_and_distant_strains() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(13);
    for printed in [Printed::Hencky, Printed::NeoHookean] {
        for split in [Split::None, Split::VolumetricDeviatoric] {
            let by_energy = damaged(Material::hyperelastic(printed).expect("a law"), split);
            let written_out = damaged(printed.written_out(), split);
            for gap in [0.0, 1e-12, 1e-7, 1e-3, 0.03, 0.0999, 0.1001, 0.4] {
                let middle = rng.random_range(-0.3..0.3);
                let e = [middle + gap, middle, rng.random_range(-0.3..0.3)];
                for g in [1.0, 0.3, 0.0] {
                    let [by_energy, written_out] =
                        [&by_energy, &written_out].map(|m| m.respond(&stretched(e), g));
                    assert_same(&by_energy, &written_out, 1e-12, &e);
                }
            }
        }
    }
}

/// Laws with a separate volumetric term: under pressure, damage does not degrade this term, and degrades all other terms.
#[test]
fn the_volumetric_term_of_a_law_is_not_degraded_under_pressure() {
    let [mooney, ogden, _] = examples();
    for (law, bulk) in [(mooney, 200.0), (ogden, 150.0)] {
        let material = damaged(law, Split::VolumetricDeviatoric);
        for stretches in [[0.8, 1.1, 0.9], [0.7, 0.7, 0.7], [1.2, 1.1, 0.9], [1.0; 3]] {
            let j: f64 = stretches.iter().product();
            let state = Matrix3::from_diagonal(&stretches.map(|s| s - 1.0).into());
            let stiff = deform(&material, &state, 0.0);
            let term = bulk / 4.0 * (j * j - 1.0 - 2.0 * j.ln());
            let undegraded = if j < 1.0 { term } else { 0.0 };
            assert!((stiff.response.energy - undegraded).abs() < 1e-12 * bulk, "at {stretches:?}");
            let pressure = if j < 1.0 { 0.5 * bulk * (j * j - 1.0) } else { 0.0 };
            for i in 0..3 {
                let exact = pressure / stretches[i];
                assert!((stiff.piola()[(i, i)] - exact).abs() < 1e-12 * bulk);
            }
        }
    }
}

/// Returns one material for each example law.
fn examples() -> [Material; 3] {
    let made = |law: Result<Material, _>| law.expect("a law");
    [
        made(Material::hyperelastic(MooneyRivlin {
            c10_mpa: 40.0,
            c01_mpa: 15.0,
            bulk_mpa: 200.0,
        })),
        made(Material::hyperelastic(Ogden {
            terms: [(63.0, 1.3), (0.12, 5.0), (-10.0, -2.0)].map(OgdenTerm::from).to_vec(),
            bulk_mpa: 150.0,
        })),
        made(Material::hyperelastic(SaintVenantKirchhoff { lame_mpa: 110.0, shear_mpa: 110.0 })),
    ]
}

#[test]
fn the_parts_of_every_split_add_up_and_are_continuous_at_equal_and_zero_strains() {
    let respond =
        |split, e, g| damaged(Printed::Hencky.written_out(), split).respond(&stretched(e), g);
    let all = [
        [0.1, -0.2, 0.05],
        [-0.1, -0.1, 0.3],
        [0.1, 0.1, 0.1],
        [-0.2, -0.2, -0.2],
        [1e-9, -1e-9, 0.0],
        [0.0; 3],
    ];
    for e in all {
        let mut whole = respond(Split::None, e, 1.0);
        for split in [Split::VolumetricDeviatoric, Split::Spectral] {
            let divided = respond(split, e, 1.0);
            (whole.driving, whole.stress_plus) = (divided.driving, divided.stress_plus);
            whole.driving_stress = divided.driving_stress;
            assert_same(&divided, &whole, 1e-13, &e);
        }
    }
    // for strains of opposite sign close to zero, the shear term is between its limits on both sides of zero
    let shear = YOUNG / (2.0 * (1.0 + POISSON));
    for tiny in [1e-3, 1e-9, 1e-15, 1e-300] {
        let e = [tiny, -0.5 * tiny, 0.0];
        let [all, minus] = [1.0, 0.0].map(|g| respond(Split::Spectral, e, g).shear[2]);
        let share = (all - minus) / shear;
        assert!((share - 2.0 / 3.0).abs() < 1e-6, "{share} of μ at {tiny}");
    }
}

#[test]
fn a_hybrid_material_degrades_the_whole_energy_and_is_driven_by_the_tensile_part() {
    let steel = Material::hencky(YOUNG, POISSON).with_fracture(Fracture::new(1.0));
    for (state, _) in states() {
        let deform_with = |field: PhaseField| deform(&steel.at_point(Some(&field)), &state, 0.3);
        let split = split_field(Split::Spectral);
        let hybrid = deform_with(PhaseField { hybrid: true, ..split });
        let whole = deform_with(split_field(Split::None));
        assert_eq!(hybrid.response.driving, deform_with(split).response.driving);
        let difference = (hybrid.piola() - whole.piola()).norm();
        assert!(difference <= 1e-13 * whole.piola().norm());
    }
}

/// Kirchhoff stress of Hencky's law, compared with log b by the series log b = 2 (Z + Z³/3 + Z⁵/5 + …) with
/// Z = (b − I)(b + I)⁻¹, which needs no eigenvalues.
#[test]
fn spectral_stress_equals_the_series_logarithm() {
    let material = Material::hencky(YOUNG, POISSON).at_point(None);
    let m = material.moduli;
    for (state, _) in states() {
        let f = Matrix3::identity() + state;
        let excess = state + state.transpose() + state * state.transpose();
        let z = excess
            * (excess + 2.0 * Matrix3::<f64>::identity())
                .try_inverse()
                .expect("b + I is positive definite");
        let (mut power, mut strain) = (z, Matrix3::zeros());
        for k in 0..400 {
            strain += power / f64::from(2 * k + 1);
            power *= z * z;
        }
        let trace = strain.trace();
        let series =
            2.0 * m.shear * strain + (m.bulk - 2.0 / 3.0 * m.shear) * trace * Matrix3::identity();
        let spectral = deform(&material, &state, 1.0).piola() * f.transpose();
        assert!(
            (spectral - series).norm() < 1e-13 * series.norm(),
            "{} at {state}",
            (spectral - series).norm()
        );
    }
}

/// Computes the responses of the materials at these displacement gradients in SIMD lanes. The output contains
/// [`Response::numbers`], and whether det F > 0.
struct Responses<'a> {
    materials: &'a [PointMaterial],
    states: &'a [Matrix3<f64>],
}

impl WithSimd for Responses<'_> {
    type Output = Vec<([f64; 18], bool)>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut responses = Vec::new();
        let laws: Vec<RegionLaw> = self.materials.iter().map(PointMaterial::law).collect();
        for (batch, states) in self.states.chunks(SimdF64::<S>::COUNT).enumerate() {
            let mut h = [[SimdF64::splat(simd, 0.0); 3]; 3];
            for i in 0..3 {
                for j in 0..3 {
                    let mut column = [0.0; POINTS];
                    for (x, state) in column.iter_mut().zip(states) {
                        *x = state[(i, j)];
                    }
                    h[i][j] = SimdF64::load(simd, &column);
                }
            }
            let first = batch * SimdF64::<S>::COUNT;
            let count = self.materials.len();
            let mut moduli = [[0.0; POINTS]; 2];
            let mut of_lane = [0.0; POINTS];
            for lane in 0..POINTS {
                let m = (first + lane) % count;
                let PointMaterial { moduli: lane_moduli, .. } = &self.materials[m];
                (moduli[0][lane], moduli[1][lane], of_lane[lane]) =
                    (lane_moduli.bulk, lane_moduli.shear, m as f64);
            }
            let moduli = moduli.each_ref().map(|x| SimdF64::load(simd, x));
            let law = LaneLaw::new(&laws, SimdF64::load(simd, &of_lane), moduli, None);
            let principal = Principal::new(&h);
            let [g, dt] = [0.3, 0.0].map(|x| SimdF64::splat(simd, x));
            let response = law.respond::<true>(&principal, g, dt, &[], &mut []);
            let lane = |x: SimdF64<S>, lane: usize| {
                let mut column = [0.0; POINTS];
                x.store(&mut column);
                column[lane]
            };
            for (k, _) in states.iter().enumerate() {
                let values = [
                    &[response.energy, response.driving][..],
                    &response.stress,
                    &response.stress_plus,
                    &response.normal,
                    &response.shear,
                    &[response.driving_slope],
                ];
                let mut all = [0.0; 18];
                all.iter_mut().zip(values.concat()).for_each(|(x, y)| *x = lane(y, k));
                responses.push((all, lane(principal.sound, k) == 1.0));
            }
        }
        responses
    }
}

/// Returns displacement gradients with close and with distant principal stretches.
fn gradients() -> Vec<Matrix3<f64>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(21);
    let mut all: Vec<Matrix3<f64>> = states().into_iter().map(|s| s.0).collect();
    let stretched = |d: [f64; 3]| Matrix3::from_diagonal(&d.into());
    all.extend([[0.0; 3], [0.0, 0.0, -0.3], [-0.2, 0.4, -0.2]].map(stretched));
    for k in 0..60 {
        let size = 0.3 * 10f64.powi(-(k % 12));
        let shear = Matrix3::from_fn(|_, _| size * rng.random_range(-1.0..1.0));
        all.push(shear);
        all.push(shear + Matrix3::identity() * rng.random_range(-0.3..0.3));
    }
    all
}

/// Points in SIMD lanes have the same law, or different built-in and user-defined laws.
#[test]
fn points_in_simd_lanes_equal_single_points() {
    let all = gradients();
    for (law, split, hybrid) in forms() {
        let field = PhaseField { hybrid, ..split_field(split) };
        let point = |m: Material| m.with_fracture(Fracture::new(1.0)).at_point(Some(&field));
        let one = vec![point(law.written_out())];
        let mut mixed = vec![point(Material::hencky(YOUNG, POISSON))];
        if split != Split::Spectral {
            mixed.push(point(Material::neo_hookean(90.0, 0.4)));
            mixed.extend(examples().map(point));
        }
        for materials in [one, mixed] {
            let responses = || Responses { materials: &materials, states: &all };
            let wide = crate::operator::dispatch(responses());
            for many in [wide, pulp::Scalar::new().vectorize(responses())] {
                assert_eq!(many.len(), all.len());
                for (k, ((values, sound), state)) in many.into_iter().zip(&all).enumerate() {
                    let material = &materials[k % materials.len()];
                    let alone = deform(material, state, 0.3);
                    assert!(sound);
                    // because of rounding errors, a strain of zero may be on either side of a kink
                    let log = alone.principal.strains.log;
                    let kink = log.into_iter().chain([log.iter().sum()]).any(|e| e.abs() < 1e-14);
                    let stiffness = material.moduli.bulk;
                    for (n, (x, y)) in
                        values.into_iter().zip(alone.response.components()).enumerate()
                    {
                        // the first eight numbers (energies and stresses) are proportional to the strains
                        let size = if n < 8 { state.norm() } else { 1.0 };
                        if n < 8 || split == Split::None || !kink {
                            let error = (x - y).abs();
                            assert!(
                                error <= 2e-12 * size * stiffness,
                                "{n}: {x} {y} {split:?} {state}"
                            );
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn an_inverted_point_is_detected_among_other_points() {
    let materials = [Material::hencky(YOUNG, POISSON).at_point(None)];
    for bad in [Matrix3::from_diagonal(&[-2.0, 0.0, 0.0].into()), Matrix3::from_element(f64::NAN)] {
        for inverted in 0..POINTS {
            let mut states = vec![Matrix3::zeros(); POINTS];
            states[inverted] = bad;
            let all = Responses { materials: &materials, states: &states };
            let sound = crate::operator::dispatch(all).into_iter().map(|point| point.1);
            assert!(sound.enumerate().all(|(k, sound)| sound == (k != inverted)));
        }
    }
}

/// The driving energy decreases with the strain, but damage is driven by the largest driving energy so far.
#[test]
fn a_history_keeps_the_largest_driving_energy() {
    let laws = [Material::hencky(YOUNG, POISSON).at_point(None).law()];
    let law = LaneLaw::new(&laws, 0.0, [150.0, 110.0], None);
    let history = DrivingHistory { law, active: true };
    let (mut old, mut largest) = ([0.0], 0.0f64);
    for strain in [0.02, 0.05, 0.01, 0.06] {
        let trial = stretched([strain, 0.0, 0.0]);
        let current = law.respond::<true>(&trial, 0.3, 1.0, &[], &mut []);
        let mut new = [0.0];
        let with_history = history.respond::<true>(&trial, 0.3, 1.0, &old, &mut new);
        largest = largest.max(current.driving);
        assert_eq!((with_history.driving, new[0]), (largest, largest));
        assert_eq!(with_history.stress, current.stress);
        old = new;
    }
    assert_eq!(PointLaw::<f64>::state_len(&history), 1);
    let without = DrivingHistory { law, active: false };
    assert_eq!(PointLaw::<f64>::state_len(&without), 0);
}
