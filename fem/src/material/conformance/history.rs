//! Assertion for tests: a viscoelastic or plastic law has the required properties along strain paths.

use nalgebra::{Matrix3, Rotation3};

use super::deformed::{Deformed, Increment, KINK, STEP, assert_consistent, states};
use crate::material::inelastic::Inelasticity;
use crate::material::point::PointMaterial;

/// Number of increments of a strain path.
const PATH: usize = 6;

/// Asserts the properties of a viscoelastic or plastic law along random strain paths: the tangent of each increment,
/// objectivity, symmetry of the tangent if [`PointMaterial::has_symmetric_tangent`] is true, and a dissipation that is
/// not negative.
pub(super) fn assert_history(material: &PointMaterial, is_kinked: bool) {
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
