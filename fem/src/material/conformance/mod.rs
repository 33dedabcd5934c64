//! Assertion for tests: a material has the properties that the solver relies on.

mod deformed;
mod history;
mod power;

use faer::traits::pulp::{Simd, WithSimd};
use nalgebra::{Matrix3, Rotation3, SVector};

pub(super) use deformed::{Deformed, states};
pub use power::{assert_energy_balance, assert_step_independence};

use super::inelastic::Inelasticity;
use super::number::{Lanes, Number, POINTS, SimdF64, dispatch};
use super::parameters::Material;
use super::phase_field::PhaseField;
use super::point::PointMaterial;
use super::split::Split;
use deformed::{Increment, KINK, assert_consistent};
use history::assert_history;

/// Asserts that a material has the properties that the solver relies on. For tests, also of user-defined laws.
///
/// The states are random, in tension and compression, with two and three equal stretches, at rest and close to rest,
/// and with and without damage. Checks: the stress is the derivative of the energy, and the tangent is the derivative
/// of the stress (the remainders of Taylor's formula decrease with the second and third power of the step); the
/// tangent is symmetric; energy and stress are objective and isotropic; energy and stress vanish at rest; a
/// deformation with det F ≤ 0 is rejected; several points in SIMD lanes have the same values as single points.
///
/// For a law with a state, these properties are checked in one increment from the state zero: energy and stress
/// at rest, rejection of det F ≤ 0, SIMD lanes, and the tangent against differences of the stress. A viscoelastic or
/// plastic law of this crate is also checked along random strain paths: tangent, objectivity, dissipation, energy
/// balance ([`assert_energy_balance`]) and, for viscoelastic laws, independence of the step
/// ([`assert_step_independence`]). Call the last two for your own law if it reports its dissipation.
///
/// # Panics
/// If a property is violated; the message contains the property and the state.
///
/// # Example
/// ```
/// use fem::{Material, MooneyRivlin, PhaseField, Split, assert_material};
///
/// let law = MooneyRivlin { c10_mpa: 40.0, c01_mpa: 15.0, bulk_mpa: 200.0 };
/// let rubber = Material::hyperelastic(law)?;
/// assert_material(&rubber, None);
/// let split = Split::VolumetricDeviatoric;
/// let field = PhaseField { split, ..PhaseField::new(0.06) };
/// assert_material(&rubber.with_fracture(fem::Fracture::new(0.1)), Some(&field));
/// # Ok::<(), fem::FemError>(())
/// ```
pub fn assert_material(material: &Material, phase_field: Option<&PhaseField>) {
    if let Err(error) = material.validate("tested", phase_field) {
        panic!("{error}");
    }
    let point = material.at_point(phase_field);
    let stiffness = point.moduli.longitudinal();
    let rest = Deformed::new(&point, &Matrix3::zeros(), 1.0).expect("zero strain has det F = 1");
    assert!(
        rest.response.energy.abs() < 1e-12 * stiffness,
        "the energy is {} MPa at zero strain, not zero",
        rest.response.energy
    );
    assert!(
        rest.piola().norm() < 1e-12 * stiffness,
        "the stress is {} MPa at zero strain, not zero",
        rest.piola()
    );
    for flat in [-1.0, -2.0, f64::NAN] {
        let gradient = Matrix3::from_diagonal(&[flat, 0.0, 0.1].into());
        let refused = Deformed::new(&point, &gradient, 1.0).is_err();
        assert!(refused, "the displacement gradient {gradient} has det F ≤ 0 and was not rejected");
    }
    let spectral = phase_field.is_some_and(|f| f.split == Split::Spectral);
    let stateful = point.law().state_len() > 0;
    let is_kinked = phase_field.is_some_and(|f| f.split != Split::None);
    let mut tried = Vec::new();
    for (state, direction) in states() {
        let strains = Deformed::new(&point, &state, 1.0).expect("det F > 0").principal.strains;
        // the steps of the Taylor test must not cross a kink
        let kinks = strains.log.into_iter().chain([strains.trace()]);
        if spectral && kinks.into_iter().any(|e| e.abs() < 0.03) {
            continue;
        }
        // differences must not cross the change from tension to compression of the volume
        if stateful && is_kinked && strains.trace().abs() < KINK {
            continue;
        }
        tried.push(state);
        for g in [1.0, 0.3] {
            if stateful {
                let rest = vec![0.0; point.law().state_len()];
                let start = Increment { g, dt: 1.0, old: &rest };
                assert_consistent(&point, &start, &state, &direction);
            } else {
                assert_derivatives(&point, &state, &direction, g);
                assert_objective(&point, &state, g);
            }
        }
    }
    assert!(
        tried.len() >= 4,
        "only {} states are far enough from the kinks of the split; at least 4 are needed",
        tried.len()
    );
    dispatch(InLanes { material: &point, states: &tried });
    match &point.inelastic {
        None => {}
        Some(law) => {
            assert_history(&point, is_kinked);
            // the stored energy of Prony terms is exact at small strain only
            let is_viscoelastic = matches!(law, Inelasticity::Viscoelastic(_));
            let strain = if is_viscoelastic { 1e-5 } else { 0.5 };
            assert_energy_balance(material, phase_field, strain);
            if is_viscoelastic {
                assert_step_independence(material);
            }
        }
    }
}

/// Asserts that stress and tangent are the derivatives of the energy, and that the tangent is symmetric.
fn assert_derivatives(
    material: &PointMaterial,
    state: &Matrix3<f64>,
    direction: &Matrix3<f64>,
    g: f64,
) {
    let at = |gradient: &Matrix3<f64>| Deformed::new(material, gradient, g).expect("det F > 0");
    let start = at(state);
    let moduli = start.moduli();
    let asymmetry = (moduli - moduli.transpose()).abs().max();
    assert!(asymmetry < 1e-14 * moduli.abs().max(), "the tangent is not symmetric at {state}");
    let flat = SVector::<f64, 9>::from_fn(|p, _| direction[(p / 3, p % 3)]);
    let (work, curvature) = (start.piola().dot(direction), flat.dot(&(moduli * flat)));
    let remainders = |t: f64| {
        let change = at(&(state + t * direction)).response.energy - start.response.energy;
        let first = change - t * work;
        [first.abs(), (first - 0.5 * t * t * curvature).abs()]
    };
    for (k, least) in [1.9, 2.9].into_iter().enumerate() {
        // at one step size a higher-order term may cancel the remainder by chance, but not at all three step sizes
        let slopes = [8e-3, 4e-3, 1e-3].map(|t| (remainders(t)[k] / remainders(t / 4.0)[k]).log2());
        let slope = slopes.into_iter().fold(0.0, f64::max) / 2.0;
        assert!(
            slope > least,
            "Taylor remainder {} decreases with slope {slope} at {state}",
            k + 1
        );
    }
}

/// Comparison of several points in SIMD lanes with single points.
struct InLanes<'a> {
    material: &'a PointMaterial,
    /// At most [`POINTS`] displacement gradients.
    states: &'a [Matrix3<f64>],
}

impl WithSimd for InLanes<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        for g in [1.0, 0.3] {
            for states in self.states.chunks(SimdF64::<S>::COUNT) {
                let mut h = [[SimdF64::splat(simd, 0.0); 3]; 3];
                for (i, row) in h.iter_mut().enumerate() {
                    for (j, number) in row.iter_mut().enumerate() {
                        let mut column = [0.0; POINTS];
                        column.iter_mut().zip(states).for_each(|(x, state)| *x = state[(i, j)]);
                        *number = SimdF64::load(simd, &column);
                    }
                }
                let number = h[0][0];
                let rest = vec![number.constant(0.0); self.material.law().state_len()];
                let (_, lanes, state) =
                    self.material.increment(&h, number.constant(g), number.constant(1.0), &rest);
                let values: Vec<_> = lanes.components().into_iter().chain(state).collect();
                let mut lane_values = vec![[0.0; POINTS]; values.len()];
                for (value, column) in values.iter().zip(&mut lane_values) {
                    value.store(column);
                }
                for (lane, state) in states.iter().enumerate() {
                    let single = Deformed::new(self.material, state, g).expect("det F > 0");
                    let single = [&single.response.components()[..], &single.state].concat();
                    let largest = single.iter().fold(0.0f64, |most, x| most.max(x.abs()));
                    let round_off = 1e-11 * (self.material.moduli.longitudinal() + largest);
                    for (k, (column, x)) in lane_values.iter().zip(single).enumerate() {
                        let y = column[lane];
                        assert!(
                            (x - y).abs() <= round_off,
                            "value {k} is {y} in SIMD lanes, but {x} when the point is computed alone, at {state}"
                        );
                    }
                }
            }
        }
    }
}

/// Asserts that energy and stress are objective and isotropic.
fn assert_objective(material: &PointMaterial, state: &Matrix3<f64>, g: f64) {
    let turn = Rotation3::from_euler_angles(0.7, -0.2, 1.9).into_inner();
    let f = Matrix3::identity() + state;
    let at = |f: Matrix3<f64>| {
        Deformed::new(material, &(f - Matrix3::identity()), g).expect("det F > 0")
    };
    let (before, space, body) = (at(f), at(turn * f), at(f * turn));
    // rounding errors come from the bulk modulus too, which is 1e4 times Young's modulus for ν = 0.49999
    let stiffness = material.moduli.longitudinal();
    let size = stiffness * state.norm();
    for (turned, stress) in [(space, turn * before.piola()), (body, before.piola() * turn)] {
        let energy = turned.response.energy - before.response.energy;
        assert!(
            energy.abs() <= 1e-12 * size,
            "a rotation of the state {state} changes the energy by {energy}"
        );
        let error = (turned.piola() - stress).norm();
        let round_off = 1e-14 * stiffness;
        assert!(
            error <= 1e-11 * size + round_off,
            "the stress does not rotate with the state {state}: error {error:e}"
        );
    }
}
