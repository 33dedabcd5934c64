//! Assertion for tests: a material has the properties that the solver relies on.

use faer::traits::pulp::{Simd, WithSimd};
use nalgebra::{Matrix3, Rotation3, SMatrix, SVector};

use super::inelastic::Inelasticity;
use super::number::{Lanes, Number, POINTS, SimdF64, dispatch};
use super::parameters::Material;
use super::phase_field::PhaseField;
use super::point::PointMaterial;
use super::principal::{Inverted, Principal};
use super::response::Response;
use super::split::Split;
use super::tangent::PointTangent;

/// Deformation and response of a material for a given displacement gradient and degradation g.
#[derive(Clone, Debug)]
pub(super) struct Deformed {
    pub(super) principal: Principal<f64>,
    pub(super) response: Response<f64>,
    pub(super) state: Vec<f64>,
}

impl Deformed {
    /// Deforms the material in one increment of one second from the state zero.
    pub(super) fn new(
        material: &PointMaterial,
        gradient: &Matrix3<f64>,
        g: f64,
    ) -> Result<Self, Inverted> {
        let rest = vec![0.0; material.law().state_len()];
        Self::from_state(material, gradient, g, 1.0, &rest)
    }

    /// Deforms the material in one increment of `dt` seconds from the state `old`.
    pub(super) fn from_state(
        material: &PointMaterial,
        gradient: &Matrix3<f64>,
        g: f64,
        dt: f64,
        old: &[f64],
    ) -> Result<Self, Inverted> {
        let (principal, response, state) = material.increment(&rows(gradient), g, dt, old);
        if principal.sound < 1.0 {
            return Err(Inverted);
        }
        Ok(Self { principal, response, state })
    }

    /// Returns the nominal stress P = ∂ψ/∂F.
    pub(super) fn piola(&self) -> Matrix3<f64> {
        let Response { stress, oblique, .. } = &self.response;
        let piola = self.principal.piola(stress, Some(&oblique.stress), 1.0);
        Matrix3::from_fn(|i, j| piola[i][j])
    }

    /// Returns A_(ij)(kl) = ∂P_ij/∂F_kl, from the tangent blocks for unit gradients.
    pub(super) fn moduli(&self) -> SMatrix<f64, 9, 9> {
        let Principal { basis, push, .. } = &self.principal;
        let tangent = PointTangent::new(&self.principal, &self.response, 1.0);
        let mut moduli = SMatrix::zeros();
        for q in 0..9 {
            // δF is the unit matrix with the entry (q / 3, q % 3); h = Qᵀ δF F⁻¹ Q
            let row = |i: usize| std::array::from_fn(|j| basis[q / 3][i] * push[j][q % 3]);
            let d = tangent.increment(&std::array::from_fn(row));
            for p in 0..9 {
                let mut sum = 0.0;
                for i in 0..3 {
                    for j in 0..3 {
                        sum += basis[p / 3][i] * d[i][j] * push[j][p % 3];
                    }
                }
                moduli[(p, q)] = sum;
            }
        }
        moduli
    }
}

fn rows(gradient: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| gradient[(i, j)]))
}

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
/// plastic law of this crate is also checked along random strain paths: tangent, objectivity, dissipation.
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
    if point.inelastic.is_some() {
        assert_history(&point, is_kinked);
    }
}

/// Start of an increment: degradation, duration in s, and state.
struct Increment<'a> {
    g: f64,
    dt: f64,
    old: &'a [f64],
}

/// Step of the displacement gradient in the finite differences that are compared with tangents.
const STEP: f64 = 1e-5;
/// With a split of the energy, tangents are compared with finite differences only where the elastic volume change |ln
/// J| exceeds this value.
const KINK: f64 = 1e-3;
/// Number of increments of a strain path.
const PATH: usize = 6;

/// Asserts the properties of a viscoelastic or plastic law along random strain paths: the tangent of each increment,
/// objectivity, symmetry of the tangent if [`PointMaterial::has_symmetric_tangent`] is true, and a dissipation that is
/// not negative.
fn assert_history(material: &PointMaterial, is_kinked: bool) {
    let stiffness = material.moduli.longitudinal();
    let states = states();
    for g in [1.0, 0.3] {
        for first in 0..states.len() {
            let mut old = vec![0.0; material.law().state_len()];
            let mut turned = old.clone();
            for step in 0..PATH {
                // the durations cover three decades
                let dt = 0.01 * 10f64.powf(0.5 * step as f64);
                let (state, direction) = &states[(first + 2 * step) % states.len()];
                let state = 0.5 * state;
                let at = Deformed::from_state(material, &state, g, dt, &old).expect("det F > 0");
                let is_smooth = !is_kinked || at.principal.strains.trace().abs() > KINK;
                if is_smooth && !crosses_yield(material, &state, direction, dt, g, &old) {
                    let start = Increment { g, dt, old: &old };
                    assert_consistent(material, &start, &state, direction);
                }
                assert!(
                    at.response.dissipation >= -1e-12 * stiffness,
                    "the dissipation is negative at {state}: the law produces the energy {:e} MPa",
                    -at.response.dissipation
                );
                if material.has_symmetric_tangent() {
                    let moduli = at.moduli();
                    let asymmetry = (moduli - moduli.transpose()).abs().max();
                    assert!(
                        asymmetry < 1e-10 * moduli.abs().max(),
                        "the tangent is not symmetric at {state}: asymmetry {asymmetry:e} MPa"
                    );
                }
                let step = step as f64;
                let turn = Rotation3::from_euler_angles(0.4 * step, -0.7 * step, step);
                let f = turn.into_inner() * (Matrix3::identity() + state) - Matrix3::identity();
                let rotated =
                    Deformed::from_state(material, &f, g, dt, &turned).expect("det F > 0");
                let error = (rotated.piola() - turn.into_inner() * at.piola()).norm();
                assert!(
                    error < 1e-9 * stiffness,
                    "the stress does not rotate with the state {state}: error {error:e} MPa"
                );
                (old, turned) = (at.state, rotated.state);
            }
        }
    }
}

/// Returns whether, of the two states of a central difference along a direction, one is elastic and the other
/// is plastic.
fn crosses_yield(
    material: &PointMaterial,
    state: &Matrix3<f64>,
    direction: &Matrix3<f64>,
    dt: f64,
    g: f64,
    old: &[f64],
) -> bool {
    if !matches!(material.inelastic, Some(Inelasticity::Plastic(_))) {
        return false;
    }
    let flows = |t: f64| {
        let at = Deformed::from_state(material, &(state + t * direction), g, dt, old);
        at.expect("det F > 0").state[6] > old[6]
    };
    flows(STEP) != flows(-STEP)
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

/// Asserts that the tangent equals central differences of the stress in an increment.
fn assert_consistent(
    material: &PointMaterial,
    start: &Increment,
    state: &Matrix3<f64>,
    direction: &Matrix3<f64>,
) {
    let step = STEP;
    let Increment { g, dt, old } = *start;
    let at = |t: f64| {
        Deformed::from_state(material, &(state + t * direction), g, dt, old).expect("det F > 0")
    };
    let difference = (at(step).piola() - at(-step).piola()) / (2.0 * step);
    let flat = SVector::<f64, 9>::from_fn(|p, _| direction[(p / 3, p % 3)]);
    let moduli = at(0.0).moduli();
    let exact = moduli * flat;
    let exact = Matrix3::from_fn(|i, j| exact[3 * i + j]);
    let error = (difference - exact).norm();
    assert!(
        error < 1e-7 * moduli.norm(),
        "the tangent differs from the difference quotient by {error:e} MPa at {state} with g = {g} after the state {old:?}, for \
         {:?}",
        material.law()
    );
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

/// Returns displacement gradients for the tests of a law, each with a direction for directional derivatives.
pub(super) fn states() -> [(Matrix3<f64>, Matrix3<f64>); 7] {
    // arbitrary numbers in (−1, 1)
    let scatter =
        |seed: f64| Matrix3::from_fn(|i, j| (seed + 5.3 * i as f64 + 2.9 * j as f64 + 0.7).sin());
    let spin = Rotation3::from_euler_angles(0.3, -0.5, 0.8).into_inner();
    let stretch = |a: f64, b: f64, c: f64| {
        spin * Matrix3::from_diagonal(&[a, b, c].into()) * spin.transpose()
    };
    let contraction = |m: Matrix3<f64>| m - Matrix3::identity() * (1.0 + m.trace() / 3.0);
    [
        (0.25 * contraction(scatter(1.0)), scatter(2.0)),
        (-0.25 * contraction(scatter(3.0)), scatter(4.0)),
        (stretch(-0.2, 0.1, -0.3), scatter(5.0)),
        (stretch(-0.2, -0.2, -0.1), scatter(6.0)),
        (stretch(0.3, 0.3, 0.3), scatter(7.0)),
        (stretch(-0.1, -0.1 + 1e-9, -0.1 - 1e-8), scatter(8.0)),
        (1e-9 * contraction(scatter(9.0)), contraction(scatter(10.0))),
    ]
}
