//! A law given by its energy: the neo-Hookean solid, against the law of the crate.

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

/// The law of the user and of the crate, with the same fracture.
fn laws() -> [Material; 2] {
    let fracture =
        Fracture { toughness_n_per_mm: 0.0025, viscosity_mpa_s: 0.3, residual_stiffness: 0.01 };
    let own = Material::hyperelastic(NeoHookean { shear_mpa: 110.0, lame_mpa: 110.0 });
    [own.expect("a law"), Material::neo_hookean(275.0, 0.25)].map(|m| m.with_fracture(fracture))
}

#[test]
fn a_law_given_by_its_energy_is_a_law() {
    let [own, _] = laws();
    for split in [Split::None, Split::VolumetricDeviatoric] {
        assert_material(&own, Some(&PhaseField { split, ..PhaseField::new(0.06) }));
    }
}

/// Elements of the matrix and of grains with another law share SIMD lanes.
#[test]
fn it_gives_the_forces_of_the_law_of_the_crate() {
    for order in [Order::Linear, Order::Quadratic] {
        let split = Split::VolumetricDeviatoric;
        let field = Some(PhaseField { split, ..PhaseField::new(0.06) });
        let run = Run { order, displacement_mm: 0.2, steps: 8, grains: true, field };
        let [own, expected] =
            laws().map(|law| run.forces(&[law, Material::hencky(22_000.0, 0.25)], None));
        assert_close(&own, &expected, 1e-8);
    }
}

#[test]
fn a_device_computes_it() {
    let Some(device) = test_device() else { return };
    let field = Some(PhaseField::new(0.06));
    let run = Run { order: Order::Quadratic, displacement_mm: 0.2, steps: 8, grains: true, field };
    let [own, _] = laws();
    let materials = [own, Material::hencky(22_000.0, 0.25)];
    let [here, there] = [None, Some(device)].map(|device| run.forces(&materials, device));
    assert_close(&there, &here, 1e-7);
}
