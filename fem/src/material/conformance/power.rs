//! Assertions for tests: balance of energy along strain paths, and independence of the step.

use nalgebra::Matrix3;

use super::deformed::{Deformed, states};
use crate::material::parameters::Material;
use crate::material::phase_field::PhaseField;
use crate::material::point::PointMaterial;
use crate::material::split::Split;

/// Number of straight segments of a strain path.
const SEGMENTS: usize = 6;
/// Numbers of increments of each segment: the defect of the energy balance must decrease from the first to the second.
const REFINEMENTS: [usize; 2] = [64, 256];
/// Largest remaining fraction of the defect when the step is divided by four. An algorithm of first order leaves 0.25.
const REDUCTION: f64 = 0.4;
/// Largest defect with the small step, as a fraction of the work.
const LARGEST_DEFECT: f64 = 0.05;
/// A defect below this fraction of the work counts as zero.
const ROUNDED_DEFECT: f64 = 1e-4;

/// Asserts the balance of energy along random strain paths: the work of the stress equals the change of the stored energy
/// plus the energy that the law dissipates. For tests, also of user-defined laws that set
/// [`Response::dissipation`](crate::Response::dissipation).
///
/// `strain` scales the displacement gradients of the paths; with 1, the principal strains are at most about 0.4. An error
/// of the algorithm must decrease with the step: the defect with a quarter of the step is at most 0.4 of the defect
/// before, and at most 5 % of the work.
///
/// # Panics
/// If the balance is violated; the message contains the defects and the work.
///
/// # Example
/// ```
/// use fem::{Material, Plasticity, assert_energy_balance};
///
/// let metal = Material::hencky(275.0, 0.25).with_plasticity(Plasticity::new(4.0));
/// assert_energy_balance(&metal, None, 0.5);
/// ```
pub fn assert_energy_balance(material: &Material, phase_field: Option<&PhaseField>, strain: f64) {
    if let Err(error) = material.validate("tested", phase_field) {
        panic!("{error}");
    }
    let point = material.at_point(phase_field);
    let is_split = phase_field.is_some_and(|field| field.split != Split::None);
    for g in [1.0, 0.3] {
        // at a change from tension to compression, a split moves energy between the degraded and the intact part
        if is_split && g < 1.0 {
            continue;
        }
        for first in 0..3 {
            let [coarse, fine] = REFINEMENTS.map(|steps| defect(&point, first, g, strain, steps));
            let [before, after] = [coarse, fine].map(|[defect, _]| defect);
            let work = fine[1];
            let is_balanced = after < ROUNDED_DEFECT * work
                || after < REDUCTION * before && after < LARGEST_DEFECT * work;
            assert!(
                is_balanced,
                "the work of the stress differs from stored and dissipated energy by {before:e} MPa, and by {after:e} MPa \
                 with a quarter of the step; the work is {work:e} MPa, with g = {g}, for {:?}",
                point.law()
            );
        }
    }
}

/// Returns the sums over the segments of a path of |work − stored energy − dissipated energy| and of |work|, MPa.
fn defect(material: &PointMaterial, first: usize, g: f64, strain: f64, steps: usize) -> [f64; 2] {
    let states = states();
    let mut old = vec![0.0; material.law().state_len()];
    let mut start = Matrix3::zeros();
    let at_rest = Deformed::from_state(material, &start, g, 1.0, &old).expect("det F = 1");
    let (mut stress, mut stored) = (at_rest.piola(), at_rest.response.energy);
    let mut sums = [0.0; 2];
    for segment in 0..SEGMENTS {
        let end = strain * states[(first + 2 * segment) % states.len()].0;
        // the durations cover three decades
        let dt = 0.01 * 10f64.powf(0.5 * segment as f64) / steps as f64;
        let change = (end - start) / steps as f64;
        let (mut work, mut lost) = (0.0, 0.0);
        let stored_before = stored;
        for step in 1..=steps {
            let gradient = start + change * step as f64;
            let at = Deformed::from_state(material, &gradient, g, dt, &old).expect("det F > 0");
            let next = at.piola();
            work += 0.5 * (stress + next).dot(&change);
            lost += at.response.dissipation;
            (stress, stored, old) = (next, at.response.energy, at.state);
        }
        sums[0] += (work - (stored - stored_before) - lost).abs();
        sums[1] += work.abs();
        start = end;
    }
    sums
}

/// Size of the displacement gradients at which a law is linear.
const SMALL: f64 = 1e-7;
/// Largest difference of the stresses, as a fraction of the stress of the longitudinal modulus at the strain [`SMALL`].
const LARGEST_DIFFERENCE: f64 = 1e-5;

/// Asserts that the stress of a law that is linear at small strain does not depend on the step: at a constant rate of
/// strain, the algorithm is exact, so that one increment gives the stress of 16 increments. For tests, also of
/// user-defined laws.
///
/// Several segments of constant rate follow each other, so that each segment starts from a state that is not zero.
///
/// # Panics
/// If the stresses differ; the message contains both.
///
/// # Example
/// ```
/// use fem::{Material, PronyTerm, Viscoelasticity, assert_step_independence};
///
/// let series = Viscoelasticity::shear([PronyTerm { fraction: 0.3, time_s: 0.1 }]);
/// assert_step_independence(&Material::hencky(275.0, 0.25).with_viscoelasticity(series));
/// ```
pub fn assert_step_independence(material: &Material) {
    if let Err(error) = material.validate("tested", None) {
        panic!("{error}");
    }
    let point = material.at_point(None);
    let states = states();
    for first in 0..states.len() {
        let mut old = [1, 16].map(|steps| (steps, vec![0.0; point.law().state_len()]));
        let mut start = Matrix3::zeros();
        for segment in 0..SEGMENTS {
            // directions do not become small, unlike the states that are close to rest
            let end = SMALL * states[(first + 2 * segment) % states.len()].1;
            let dt = 0.01 * 10f64.powf(0.5 * segment as f64);
            let stresses = old.each_mut().map(|(steps, old)| {
                let mut stress = Matrix3::zeros();
                for step in 1..=*steps {
                    let fraction = f64::from(step) / f64::from(*steps);
                    let gradient = start + (end - start) * fraction;
                    let dt = dt / f64::from(*steps);
                    let at = Deformed::from_state(&point, &gradient, 1.0, dt, old);
                    let at = at.expect("det F > 0");
                    stress = at.piola();
                    *old = at.state;
                }
                stress
            });
            let difference = (stresses[0] - stresses[1]).norm();
            assert!(
                difference < LARGEST_DIFFERENCE * SMALL * point.moduli.longitudinal(),
                "at a constant rate of strain, the stress is {} MPa in one increment of {dt} s, but {} MPa in 16 increments",
                stresses[0],
                stresses[1]
            );
            start = end;
        }
    }
}
