//! Laws with a Poisson's ratio close to ½, for which K is thousands of times Young's modulus.

use fem::{Material, MooneyRivlin, Ogden, OgdenTerm, PhaseField, Split, assert_material};

#[test]
fn nearly_incompressible_laws_pass_the_conformance_test() {
    for poisson in [0.49, 0.498, 0.4999, 0.49999, 0.499999] {
        let bulk_mpa = 1.0 / (3.0 * (1.0 - 2.0 * poisson));
        let shear = 1.0 / (2.0 * (1.0 + poisson));
        let mooney = MooneyRivlin { c10_mpa: 0.3 * shear, c01_mpa: 0.2 * shear, bulk_mpa };
        let terms = vec![OgdenTerm::from((2.0 * shear / 1.7, 1.7))];
        let ogden = Ogden { terms, bulk_mpa };
        let field = PhaseField { split: Split::VolumetricDeviatoric, ..PhaseField::new(0.06) };
        for material in [
            Material::hencky(1.0, poisson),
            Material::neo_hookean(1.0, poisson),
            Material::hyperelastic(mooney).expect("a law"),
            Material::hyperelastic(ogden).expect("a law"),
        ] {
            assert_material(&material, None);
            let breaks = material.with_fracture(fem::Fracture::new(0.1));
            assert_material(&breaks, Some(&field));
        }
    }
}
