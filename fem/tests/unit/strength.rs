//! Materials with a strength at a point, against the equations that define their constants.

use super::*;

/// Graphite of Larsen, Dolbow & Lopez-Pamies (2024): E 9800 MPa, ν 0.13, Gc 0.091 N/mm, strengths 27 and 77 MPa.
const YOUNG: f64 = 9800.0;
const POISSON: f64 = 0.13;
const TENSILE: f64 = 27.0;
const COMPRESSIVE: f64 = 77.0;

fn graphite() -> Material {
    let fracture = Fracture { residual_stiffness: 1e-4, ..Fracture::new(0.091) };
    Material::hencky(YOUNG, POISSON)
        .with_fracture(fracture)
        .with_strength(Strength::new(TENSILE, COMPRESSIVE))
}

fn field(length_mm: f64) -> PhaseField {
    PhaseField { model: CrackDensity::At1, ..PhaseField::new(length_mm) }
}

/// Left side of the damage equation of an undamaged point without gradients, relative to the local crack density, for
/// given principal stresses.
fn imbalance(length_mm: f64, spacing_mm: f64, stress: [f64; 3]) -> f64 {
    let point = graphite().at_point_of(Some(&field(length_mm)), spacing_mm);
    let response = point.respond(&principal(strains(stress)), 1.0);
    let local = point.damage.as_ref().expect("graphite breaks").local;
    // g′(0) is −2
    (local - 2.0 * response.driving) / local
}

/// Returns the logarithmic strains of Hencky's law for principal stresses.
fn strains(stress: [f64; 3]) -> [f64; 3] {
    let trace: f64 = stress.iter().sum();
    stress.map(|s| ((1.0 + POISSON) * s - POISSON * trace) / YOUNG)
}

fn principal(strains: [f64; 3]) -> Principal<f64> {
    let mut h = [[0.0; 3]; 3];
    (0..3).for_each(|i| h[i][i] = strains[i].exp_m1());
    Principal::new(&h)
}

#[test]
fn an_undamaged_point_starts_to_break_at_both_tensile_strengths() {
    let strength = graphite().strength.expect("graphite has a strength");
    let hydrostatic = strength.hydrostatic_mpa();
    for (length_mm, spacing_mm) in [(0.8, 0.0), (0.2, 0.0), (0.2, 0.05), (0.05, 0.01)] {
        let uniaxial = imbalance(length_mm, spacing_mm, [TENSILE, 0.0, 0.0]);
        assert!(uniaxial.abs() < 1e-10, "uniaxial, length {length_mm}: {uniaxial:e}");
        let uniform = imbalance(length_mm, spacing_mm, [hydrostatic; 3]);
        assert!(uniform.abs() < 1e-10, "hydrostatic, length {length_mm}: {uniform:e}");
        assert!(imbalance(length_mm, spacing_mm, [0.99 * TENSILE, 0.0, 0.0]) > 0.0);
    }
}

/// In uniaxial compression the strength is reached too early, unless the length is small.
#[test]
fn compressive_strength_approaches_its_value_as_the_length_becomes_small() {
    let strength = graphite().strength.expect("graphite has a strength");
    let mut before = 0.0;
    for length_mm in [0.8, 0.4, 0.2, 0.1, 0.01, 0.001] {
        let context = graphite().strength_context(&field(length_mm), 0.0);
        let realised = strength.realised_compressive_mpa(&context);
        let at_strength = imbalance(length_mm, 0.0, [0.0, 0.0, -realised]);
        assert!(at_strength.abs() < 1e-10, "length {length_mm}: {at_strength:e}");
        assert!(before < realised && realised < COMPRESSIVE, "length {length_mm}: {realised}");
        before = realised;
    }
    assert!((before - COMPRESSIVE).abs() < 0.01 * COMPRESSIVE, "{before}");
    // the remainder of the equation at the compressive strength, in closed form
    let moduli = graphite().at_point(None).moduli;
    let hydrostatic = strength.hydrostatic_mpa();
    let local = graphite().at_point(Some(&field(0.2))).damage.expect("graphite breaks").local;
    let slope = TENSILE / (2.0 * YOUNG) - hydrostatic / (3.0 * moduli.bulk);
    let remainder = 2.0 * COMPRESSIVE * slope / local;
    let computed = imbalance(0.2, 0.0, [0.0, 0.0, -COMPRESSIVE]);
    assert!((computed - remainder).abs() < 1e-9, "{computed} and {remainder}");
    assert!((remainder + 0.49).abs() < 0.01, "{remainder}");
}

/// The derivatives of the driving energy equal central differences.
#[test]
fn derivatives_of_the_driving_energy() {
    let point = graphite().at_point_of(Some(&field(0.2)), 0.04);
    let at = |strains: [f64; 3], g: f64| point.respond(&principal(strains), g);
    let states = [
        [0.002, 0.001, -0.0005],
        [0.003, -0.001, -0.0012],
        [-0.004, 0.001, 0.0005],
        [-0.003, -0.002, -0.001],
        [0.002, -0.0018, 0.0001],
        [0.002, -0.0021, -0.0003],
    ];
    for strains in states {
        for g in [1.0, 0.4, 1e-3] {
            let response = at(strains, g);
            let scale = response.driving.abs() / 1e-3;
            for i in 0..3 {
                let side = |step: f64| {
                    let mut moved = strains;
                    moved[i] += step;
                    at(moved, g).driving
                };
                let difference = (side(1e-7) - side(-1e-7)) / 2e-7;
                let error = (response.driving_stress[i] - difference).abs();
                assert!(error < 1e-5 * scale, "strain {i} at {strains:?}, g = {g}: {error:e}");
            }
            let step = 1e-5 * g;
            let rise = at(strains, g + step).driving - at(strains, g - step).driving;
            let difference = rise / (2.0 * step);
            let error = (response.driving_slope - difference).abs();
            assert!(error < 1e-6 * difference.abs(), "g = {g} at {strains:?}: {error:e}");
        }
    }
}

#[test]
fn a_material_with_a_strength_conforms() {
    assert_material(&graphite(), Some(&field(0.2)));
}

#[test]
fn unsupported_strengths_are_refused() {
    let message = |material: Material, field: PhaseField| {
        material.validate("matrix", Some(&field)).expect_err("refused").to_string()
    };
    let weak = Strength::new(27.0, 20.0);
    let folded = Strength { node_spacing_mm: Some(-0.1), ..Strength::new(27.0, 77.0) };
    let cases = [
        (graphite().with_strength(weak), field(0.2), "material.matrix.strength: compressive_mpa"),
        (graphite().with_strength(folded), field(0.2), "material.matrix.strength: node_spacing_mm"),
        (Material { fracture: None, ..graphite() }, field(0.2), "toughness"),
        (graphite(), PhaseField::new(0.2), "AT1"),
        (graphite(), PhaseField { split: Split::Spectral, ..field(0.2) }, "AT1"),
        (graphite(), field(0.7), "3 E Gc/(8 tensile_mpa²)"),
        (graphite().with_fracture(Fracture::new(0.091)), field(0.2), "residual_stiffness"),
        (graphite().with_plasticity(Plasticity::new(20.0)), field(0.2), "elastic laws"),
    ];
    for (material, field, words) in cases {
        let text = message(material, field);
        assert!(text.contains(words), "'{words}' is missing in: {text}");
    }
}
