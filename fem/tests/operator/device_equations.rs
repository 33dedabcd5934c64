//! Residual and tangent computed on the host as a device, compared with the results of the processor.

use super::nvrtc::assert_compiles_for_a_card;
use super::*;
use crate::test_device::test_device;
use fem::device::{Array, ComputeDevice, source};
use fem::operator::equations_kernels;

#[track_caller]
fn assert_near(computed: &[f64], expected: &[f64], bound: f64, what: &str) {
    let largest = expected.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let error = computed.iter().zip(expected).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
    assert!(largest > 0.0 && error <= bound * largest, "{what}: {error} of {largest}");
}

/// Compares residual, energies, product, diagonal and tangent of the linear shape functions of device and processor.
fn compare<const N: usize, T: Element<N>>(
    device: &ComputeDevice,
    form: Form,
    rule: DamageRule,
    (law, field): (Law, PhaseField),
) {
    let what = format!("{N} nodes, {form:?}, {rule:?}, {:?} {:?}", field.split, field.model);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let mesh = form.shape(cube(3, &mut rng), &mut rng);
    let assembly = || Assembly::new(Space::new::<T>(&mesh, rule)).homogenised(form.rule());
    let here = T::operator(assembly());
    let there = T::operator(assembly().on_device(Some(device.clone())));
    let lost = || there.on_device().expect("a device was given").lost().map(|e| e.to_string());
    let nodes = here.domain().nodes().len();
    let materials = materials(law, field, true);
    let mut random = |size: f64| size * rng.random_range(-1.0..1.0);
    let fields = Fields {
        displacement: (0..nodes).map(|_| std::array::from_fn(|_| random(0.01))).collect(),
        damage: (0..nodes).map(|_| 0.5 + random(0.4)).collect(),
        ..Fields::default()
    };
    let before: Vec<f64> = fields.damage.iter().map(|phi| phi - 0.1).collect();
    // at about half of the points, the largest earlier driving energy exceeds the current driving energy
    let elastic_points =
        if state_len(&materials) == 1 { here.domain().elastic_points() } else { 0 };
    let state: Vec<f64> = (0..elastic_points).map(|_| 0.05 + random(0.05)).collect();
    let context = StepContext { state: &state, ..StepContext::new(&before, 0.1) };
    let increment = Increment { materials: &materials, fields: &fields, context };

    let [mut expected, mut computed] = [Residual::new(nodes), Residual::new(nodes)];
    here.residual(&increment, &mut expected).expect("no element is inverted");
    there.residual(&increment, &mut computed).expect("no element is inverted");
    assert_eq!(lost(), None, "{what}");
    assert_near(computed.nodal.as_flattened(), expected.nodal.as_flattened(), 1e-12, &what);
    assert_near(&computed.drive, &expected.drive, 1e-12, &what);
    let energies = |r: &Residual| [r.elastic, r.fracture, r.viscous];
    for (computed, expected) in energies(&computed).into_iter().zip(energies(&expected)) {
        assert_near(&[computed], &[expected], 1e-13, &what);
    }

    let product = |operator: &dyn Operator| {
        let layout = Arc::new(Layout::new(here.domain()));
        let mut product =
            device_product(layout, here.domain().tets(), device).expect("kernels compile");
        product.linearise(operator, &increment, Coupling::Full).expect("as before");
        product
    };
    let x: Vec<[f64; 4]> = (0..nodes).map(|_| std::array::from_fn(|_| random(1.0))).collect();
    let vertices = mesh.nodes.len();
    let pattern = Arc::new(Pattern::new(&mesh.tets, vertices));
    let results = |operator: &dyn Operator| {
        let mut product = product(operator);
        let from = Array::of(device, x.as_flattened()).expect("memory");
        let mut to = Array::zeros(device, 4 * nodes).expect("memory");
        let diagonal = product.diagonal().expect("it is read");
        let mut y = vec![0.0; 4 * nodes];
        product.on_device().expect("a device").apply(&from, &mut to).expect("it runs");
        to.read(&mut y).expect("it is read");
        let mut back = vec![[0.0; 4]; nodes];
        product.apply(&x, &mut back).expect("it is read");
        let mut linear = Tangent::new(Arc::clone(&pattern));
        linear.clear();
        product.add_linear(&mut linear).expect("it is read");
        (y, back, diagonal, linear.blocks)
    };
    let (y, back, diagonal, linear) = results(there.as_ref());
    let expected = results(here.as_ref());
    assert_near(&y, &expected.0, 1e-12, &what);
    assert_near(back.as_flattened(), &expected.0, 1e-12, &what);
    assert_near(diagonal.as_flattened(), expected.2.as_flattened(), 1e-12, &what);
    let flat = |blocks: &[_]| blocks.iter().flat_map(|b: &[[f64; 4]; 4]| *b).flatten().collect();
    let [linear, expected]: [Vec<f64>; 2] = [flat(&linear), flat(&expected.3)];
    assert_near(&linear, &expected, 1e-12, &what);

    // the device detects an inverted element
    let mut folded = fields.clone();
    folded.displacement[nodes / 2] = [3.0; 3];
    let increment = Increment { fields: &folded, ..increment };
    assert!(there.residual(&increment, &mut computed).is_err(), "{what}");
    assert_eq!(lost(), None, "{what}");
}

#[test]
fn a_device_computes_residual_and_tangent_of_every_kind_of_element() {
    let Some(device) = test_device() else { return };
    let at2 = PhaseField::new(0.3);
    let spectral = PhaseField { split: Split::Spectral, model: CrackDensity::At1, ..at2 };
    let volumetric = PhaseField { split: Split::VolumetricDeviatoric, ..at2 };
    let hencky = Material::hencky as Law;
    for form in Form::ALL {
        compare::<4, Linear>(&device, form, DamageRule::Vertex, (hencky, at2));
        compare::<10, Quadratic>(&device, form, DamageRule::Vertex, (hencky, spectral));
    }
    let form = Form::Plain;
    let neo_hookean = Material::neo_hookean as Law;
    compare::<4, Linear>(&device, form, DamageRule::Vertex, (neo_hookean, volumetric));
    compare::<4, Linear>(&device, form, DamageRule::Vertex, (hencky, volumetric));
    compare::<10, Quadratic>(&device, form, DamageRule::Consistent, (hencky, at2));
    let history = PhaseField { irreversibility: Irreversibility::History, ..at2 };
    compare::<10, Quadratic>(&device, Form::Plain, DamageRule::Vertex, (hencky, history));
    compare::<4, Linear>(&device, Form::ALL[4], DamageRule::Vertex, (hencky, history));
    // a built-in law and a user-defined law given by its energy in one mesh
    compare::<4, Linear>(&device, form, DamageRule::Vertex, (mixed, volumetric));
    compare::<10, Quadratic>(&device, form, DamageRule::Consistent, (mixed, at2));
}

#[test]
fn the_kernels_of_the_equations_compile_for_a_graphics_card() {
    let mesh = cube(2, &mut Xoshiro256PlusPlus::seed_from_u64(7));
    let space = Space::new::<Quadratic>(&mesh, DamageRule::Vertex);
    assert_compiles_for_a_card(&source(&equations_kernels(&space.rule)));
}
