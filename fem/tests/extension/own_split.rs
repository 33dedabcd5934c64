//! A user-defined split: the star-convex split. For two values of its parameter it equals a built-in split.

use crate::test_device::test_device;
use crate::{Run, assert_close};
use fem::{
    ElasticPoint, ElasticResponse, EnergySplit, Fracture, Material, Order, PhaseField, Scalar,
    Split, assert_material,
};

/// ψ⁻ = (1 + γ) U(J) in compression, where U is the volumetric energy.
///
/// Reference: Vicentini, Zolesi, Carrara, Maurini & De Lorenzis, Int. J. Fract. 247 (2024) 291,
/// doi:10.1007/s10704-024-00782-4.
#[derive(Debug)]
struct StarConvex {
    gamma: f64,
}

impl EnergySplit for StarConvex {
    #[inline(always)]
    fn spared<T: Scalar>(&self, point: &ElasticPoint<T>) -> ElasticResponse<T> {
        let trace = point.strain.log_volume();
        let compressed = trace.less_than(trace.constant(0.0));
        let factor = trace.constant(1.0 + self.gamma);
        ElasticResponse::volumetric(point.volumetric).times(factor).only(compressed)
    }
}

fn matrix(law: fn(f64, f64) -> Material) -> Material {
    law(275.0, 0.25).with_fracture(Fracture {
        toughness_n_per_mm: 0.0025,
        viscosity_mpa_s: 0.3,
        residual_stiffness: 0.01,
    })
}

#[test]
fn every_law_with_the_split_passes_the_conformance_test() {
    for law in [Material::hencky, Material::neo_hookean] {
        for gamma in [0.0, 0.7] {
            let material = matrix(law).with_split(StarConvex { gamma });
            assert_material(&material, Some(&PhaseField::new(0.06)));
        }
    }
}

/// With γ = 0, the split equals the volumetric–deviatoric split; with γ = −1, the energy is not split.
#[test]
fn two_values_of_the_parameter_give_the_forces_of_built_in_splits() {
    let field = PhaseField::new(0.06);
    let run = |split| Run {
        order: Order::Linear,
        displacement_mm: 0.2,
        steps: 8,
        grains: true,
        field: Some(PhaseField { split, ..field }),
    };
    let grain = || Material::hencky(22_000.0, 0.25);
    for law in [Material::hencky, Material::neo_hookean] {
        let mut all = Vec::new();
        for (gamma, split) in [(0.0, Split::VolumetricDeviatoric), (-1.0, Split::None)] {
            let user_defined = matrix(law).with_split(StarConvex { gamma });
            let user_defined = run(Split::None).forces(&[user_defined, grain()], None);
            let expected = run(split).forces(&[matrix(law), grain()], None);
            assert_close(&user_defined, &expected, 1e-8);
            all.push(user_defined);
        }
        let last = all[0].len() - 1;
        assert!(all[0][last] > 1.01 * all[1][last], "the splits differ: {all:?}");
    }
}

#[test]
fn a_device_computes_the_split() {
    let Some(device) = test_device() else { return };
    let user_defined = matrix(Material::hencky).with_split(StarConvex { gamma: 0.7 });
    let field = Some(PhaseField::new(0.06));
    let run = Run { order: Order::Linear, displacement_mm: 0.2, steps: 8, grains: false, field };
    let [here, there] =
        [None, Some(device)].map(|device| run.forces(std::slice::from_ref(&user_defined), device));
    assert_close(&there, &here, 1e-7);
}

#[test]
fn unsupported_user_defined_splits_are_rejected() {
    let user_defined = matrix(Material::hencky).with_split(StarConvex { gamma: 0.0 });
    let hybrid = PhaseField { hybrid: true, ..PhaseField::new(0.06) };
    let error = user_defined.validate("matrix", Some(&hybrid)).expect_err("refused").to_string();
    assert!(error.contains("material.matrix") && error.contains("hybrid"), "{error}");
}
