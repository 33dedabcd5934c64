//! The tangent product, recorded as a kernel and run on the host as a device, compared with the result of the processor.

use super::nvrtc::assert_compiles_for_a_card;
use super::*;
use crate::test_device::test_device;
use fem::device::{Array, ComputeDevice, source};
use fem::operator::product_kernels;

/// Compares products with the tangent at random fields, computed on the processor and on the device.
fn compare<const N: usize, T: Element<N>>(
    device: &ComputeDevice,
    form: Form,
    rule: DamageRule,
    stiff_damages: bool,
) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let mesh = form.shape(cube(3, &mut rng), &mut rng);
    let operator =
        T::operator(Assembly::new(Space::new::<T>(&mesh, rule)).homogenised(form.rule()));
    let nodes = operator.domain().nodes().len();
    let materials = materials(Material::hencky, PhaseField::new(0.3), stiff_damages);
    let mut random = |size: f64| size * rng.random_range(-1.0..1.0);
    let fields = Fields {
        displacement: (0..nodes).map(|_| std::array::from_fn(|_| random(0.01))).collect(),
        damage: (0..nodes).map(|_| 0.5 + random(0.4)).collect(),
        ..Fields::default()
    };
    let x: Vec<[f64; 4]> = (0..nodes).map(|_| std::array::from_fn(|_| random(1.0))).collect();
    let context = StepContext::new(&fields.damage, 0.1);
    let increment = Increment { materials: &materials, fields: &fields, context };
    let layout = Arc::new(Layout::new(operator.domain()));
    let tets = operator.domain().tets();
    let mut on_device = device_product(layout, tets, device).expect("the kernels compile");
    on_device
        .linearise(operator.as_ref(), &increment, Coupling::Full)
        .expect("no element is inverted");
    let mut expected = vec![[0.0; 4]; nodes];
    on_device.apply(&x, &mut expected).expect("the processor has the tangent");

    let from = Array::of(device, x.as_flattened()).expect("memory");
    let mut to = Array::zeros(device, 4 * nodes).expect("memory");
    let mut y = vec![0.0; 4 * nodes];
    let applied = on_device.on_device().expect("a device was given");
    applied.apply(&from, &mut to).expect("it runs");
    to.read(&mut y).expect("it is read");
    let largest = y.iter().fold(0.0f64, |m, y| m.max(y.abs()));
    let error =
        y.iter().zip(expected.as_flattened()).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()));
    assert!(largest > 1e-3 && error <= 1e-14 * largest, "{N} nodes, {form:?}, {rule:?}: {error}");
}

#[test]
fn a_device_applies_the_tangent_of_every_kind_of_element() {
    let Some(device) = test_device() else { return };
    for form in Form::ALL {
        compare::<4, Linear>(&device, form, DamageRule::Vertex, true);
        compare::<10, Quadratic>(&device, form, DamageRule::Consistent, true);
    }
    compare::<10, Quadratic>(&device, Form::Plain, DamageRule::Vertex, true);
    compare::<10, Quadratic>(&device, Form::Plain, DamageRule::Eleven, false);
}

#[test]
fn the_kernels_of_the_product_compile_for_a_graphics_card() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let assembly =
        Assembly::new(Space::new::<Quadratic>(&cube(2, &mut rng), DamageRule::Consistent));
    let layout = Layout::new(assembly.domain());
    assert_compiles_for_a_card(&source(&product_kernels(&layout)));
}
