//! A user-defined law given by its energy: the neo-Hookean law, compared with the built-in law.

use crate::test_device::test_device;
use crate::{Run, assert_close};
use fem::{
    Fracture, HyperelasticLaw, Material, Order, PhaseField, PrincipalStrain, Scalar, Split,
    assert_material,
};

/// ψ = μ/2 (I₁ − 3 − 2 ln J) + λ/2 (ln J)².
#[derive(Debug)]
struct NeoHookean {
    shear_mpa: f64,
    lame_mpa: f64,
}

impl HyperelasticLaw for NeoHookean {
    #[inline(always)]
    fn energy<T: Scalar>(&self, strain: &PrincipalStrain<T>) -> T {
        let volume = strain.log_volume();
        (strain.power_sum(2.0) - volume * 2.0) * (0.5 * self.shear_mpa)
            + volume * volume * (0.5 * self.lame_mpa)
    }
}

/// Returns the user-defined law and the built-in law, with the same fracture parameters.
fn laws() -> [Material; 2] {
    let fracture =
        Fracture { toughness_n_per_mm: 0.0025, viscosity_mpa_s: 0.3, residual_stiffness: 0.01 };
    let user_defined = Material::hyperelastic(NeoHookean { shear_mpa: 110.0, lame_mpa: 110.0 });
    [user_defined.expect("a law"), Material::neo_hookean(275.0, 0.25)]
        .map(|m| m.with_fracture(fracture))
}

#[test]
fn the_law_passes_the_conformance_test() {
    let [user_defined, _] = laws();
    for split in [Split::None, Split::VolumetricDeviatoric] {
        assert_material(&user_defined, Some(&PhaseField { split, ..PhaseField::new(0.06) }));
    }
}

/// In the mesh, matrix and grains have different laws, so that elements with different laws are computed in the same
/// SIMD vector.
#[test]
fn the_law_gives_the_forces_of_the_built_in_law() {
    for order in [Order::Linear, Order::Quadratic] {
        let split = Split::VolumetricDeviatoric;
        let field = Some(PhaseField { split, ..PhaseField::new(0.06) });
        let run = Run { order, displacement_mm: 0.2, steps: 8, grains: true, field };
        let [user_defined, expected] =
            laws().map(|law| run.forces(&[law, Material::hencky(22_000.0, 0.25)], None));
        assert_close(&user_defined, &expected, 1e-8);
    }
}

#[test]
fn a_device_computes_the_law() {
    let Some(device) = test_device() else { return };
    let field = Some(PhaseField::new(0.06));
    let run = Run { order: Order::Quadratic, displacement_mm: 0.2, steps: 8, grains: true, field };
    let [user_defined, _] = laws();
    let materials = [user_defined, Material::hencky(22_000.0, 0.25)];
    let [here, there] = [None, Some(device)].map(|device| run.forces(&materials, device));
    assert_close(&there, &here, 1e-7);
}
