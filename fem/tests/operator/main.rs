//! Residual and tangent of a whole mesh, on the processor and on devices.
//!
//! These tests use hidden modules of `fem`. They are separate from the unit tests, because the unit tests would compile
//! the element kernels a second time.

mod device;
mod device_equations;
mod device_product;
mod element_kernel;
#[path = "../support/nvrtc.rs"]
mod nvrtc;
#[path = "../support/test_device.rs"]
mod test_device;

use std::sync::Arc;

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use self::element_kernel::Form;
use fem::TetMesh;
use fem::element::{DamageRule, Domain, ExtraTerms, Linear, Quadratic, Space, Tetrahedron};
use fem::material::{
    CrackDensity, Fracture, Irreversibility, Material, PhaseField, PointMaterial,
    SaintVenantKirchhoff, Split,
};
use fem::operator::*;
use fem::{Fields, Strength};

/// Function from Young's modulus (MPa) and Poisson's ratio to a material.
type Law = fn(f64, f64) -> Material;

/// Mesh of a unit cube with two regions: n³ cells of six tetrahedra; inner nodes are shifted at random.
fn cube(n: usize, rng: &mut impl Rng) -> TetMesh {
    let at = |i: usize, j: usize, k: usize| (i + (n + 1) * (j + (n + 1) * k)) as u32;
    let mut mesh = TetMesh { regions: vec!["soft".into(), "stiff".into()], ..TetMesh::default() };
    for k in 0..=n {
        for j in 0..=n {
            for i in 0..=n {
                let inner = [i, j, k].iter().all(|&x| x > 0 && x < n);
                let shift = if inner { 0.25 / n as f64 } else { 0.0 };
                mesh.nodes.push(
                    [i, j, k].map(|x| x as f64 / n as f64 + shift * rng.random_range(-1.0..1.0)),
                );
            }
        }
    }
    for (i, j, k) in (0..n * n * n).map(|c| (c % n, c / n % n, c / n / n)) {
        let corner = |c: usize| at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
        for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
            mesh.tets.push([corner(0), corner(a), corner(b), corner(7)]);
            mesh.region_of.push(u16::from((i + j + k) % 2 == 0));
        }
    }
    mesh.validate().expect("a valid mesh");
    mesh
}

/// Returns a built-in law for the soft region, and a user-defined law for the stiff region.
fn mixed(young: f64, poisson: f64) -> Material {
    if young < 1000.0 {
        return Material::neo_hookean(young, poisson);
    }
    let shear_mpa = young / (2.0 * (1.0 + poisson));
    let lame_mpa = 2.0 * shear_mpa * poisson / (1.0 - 2.0 * poisson);
    Material::hyperelastic(SaintVenantKirchhoff { lame_mpa, shear_mpa }).expect("a law")
}

fn materials(law: Law, field: PhaseField, stiff_damages: bool) -> Vec<PointMaterial> {
    let soft = law(275.0, 0.25).with_fracture(Fracture {
        toughness_n_per_mm: 2.0,
        viscosity_mpa_s: 0.3,
        residual_stiffness: 0.01,
    });
    let tough = soft.fracture.map(|f| Fracture { toughness_n_per_mm: 9.0, ..f });
    let stiff = Material { fracture: tough.filter(|_| stiff_damages), ..law(2000.0, 0.25) };
    [soft, stiff].iter().map(|m| m.at_point(Some(&field))).collect()
}

/// Elements with an operator that is compiled in `fem`. If a test called `Assembly` directly, the test would compile all
/// element kernels again.
trait Element<const N: usize>: Tetrahedron<N> + 'static {
    fn operator(assembly: Assembly<N>) -> Arc<dyn Operator>;
}

impl Element<4> for Linear {
    fn operator(assembly: Assembly<4>) -> Arc<dyn Operator> {
        linear(assembly)
    }
}

impl Element<10> for Quadratic {
    fn operator(assembly: Assembly<10>) -> Arc<dyn Operator> {
        quadratic(assembly)
    }
}

/// Returns displacement and damage of each node.
fn nodal(fields: &Fields) -> Vec<[f64; 4]> {
    let pairs = fields.displacement.iter().zip(&fields.damage);
    pairs.map(|(u, phi)| [u[0], u[1], u[2], *phi]).collect()
}

/// Returns the fields plus `factor` times `direction`.
fn moved(fields: &Fields, factor: f64, direction: &Fields) -> Fields {
    let mut at = fields.clone();
    for (u, d) in at.displacement.iter_mut().zip(&direction.displacement) {
        (0..3).for_each(|k| u[k] += factor * d[k]);
    }
    at.damage.iter_mut().zip(&direction.damage).for_each(|(phi, d)| *phi += factor * d);
    at
}

/// Taylor test: residual and tangent are the first and second derivatives of the potential.
fn assert_taylor<const N: usize, T: Element<N>>(
    form: Form,
    rule: DamageRule,
    law: Law,
    field: PhaseField,
    stiff_damages: bool,
) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mesh = form.shape(cube(2, &mut rng), &mut rng);
    let space = Space::new::<T>(&mesh, rule);
    let nodes = space.nodes.len();
    let materials = materials(law, field, stiff_damages);
    let pattern = Arc::new(Pattern::new(&space.tets, nodes));
    let operator = T::operator(Assembly::new(space).homogenised(form.rule()));

    // compressed fields, far from the kink of the split at tr ε = 0
    let mut random_fields = |size: f64, damage: std::ops::Range<f64>| Fields {
        displacement: operator
            .domain()
            .nodes()
            .iter()
            .map(|x| {
                std::array::from_fn(|k| {
                    -0.1 * size * x[k] + 0.03 * size * rng.random_range(-1.0..1.0)
                })
            })
            .collect(),
        damage: (0..nodes).map(|_| rng.random_range(damage.clone())).collect(),
        ..Fields::default()
    };
    let fields = random_fields(1.0, 0.2..0.8);
    let direction = random_fields(1.0, -1.0..1.0);
    let before: Vec<f64> = fields.damage.iter().map(|phi| 0.9 * phi).collect();
    let context = StepContext::new(&before, 0.1);
    let moved = |t: f64| moved(&fields, t, &direction);
    let evaluate = |at: &Fields| {
        let mut residual = Residual::new(nodes);
        let increment = Increment { materials: &materials, fields: at, context };
        operator.residual(&increment, &mut residual).expect("no element is inverted");
        residual
    };
    let mut tangent = Tangent::new(pattern);
    let increment = Increment { materials: &materials, fields: &fields, context };
    operator.tangent(&increment, Coupling::Full, &mut tangent).expect("no element is inverted");

    assert_matrix_free(operator.as_ref(), &increment, &tangent);
    let d = nodal(&direction);
    let start = evaluate(&fields);
    let slope: f64 = start.nodal.iter().flatten().zip(d.as_flattened()).map(|(r, d)| r * d).sum();
    let mut product = vec![[0.0; 4]; nodes];
    tangent.multiply(&d, &mut product);
    let curvature: f64 =
        product.as_flattened().iter().zip(d.as_flattened()).map(|(p, d)| p * d).sum();
    let remainders = |t: f64| {
        let first = evaluate(&moved(t)).potential() - start.potential() - t * slope;
        [first.abs(), (first - 0.5 * t * t * curvature).abs()]
    };
    let (coarse, fine) = (remainders(4e-3), remainders(1e-3));
    for (k, least) in [1.9, 2.9].into_iter().enumerate() {
        let order = (coarse[k] / fine[k]).log2() / 2.0;
        assert!(order > least, "{rule:?} {field:?}: remainder {} falls with slope {order}", k + 1);
    }
}

/// Compares the matrix-free product and diagonal with the assembled matrix, for several numbers of threads.
fn assert_matrix_free(operator: &dyn Operator, increment: &Increment, tangent: &Tangent) {
    let nodes = operator.domain().nodes();
    let layout = Arc::new(Layout::new(operator.domain()));
    let x: Vec<[f64; 4]> = nodes
        .iter()
        .enumerate()
        .map(|(n, p)| [(3.0 * p[0]).sin(), p[1] * p[2], 0.3 - p[2], (n as f64).cos()])
        .collect();
    let mut expected = vec![[0.0; 4]; nodes.len()];
    tangent.multiply(&x, &mut expected);
    let largest = |v: &[[f64; 4]]| v.as_flattened().iter().fold(0.0f64, |m, x| m.max(x.abs()));
    let difference = |a: &[[f64; 4]], b: &[[f64; 4]]| {
        a.as_flattened().iter().zip(b.as_flattened()).fold(0.0f64, |m, (a, b)| m.max((a - b).abs()))
    };
    let by_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let mut free = product(Arc::clone(&layout), 1);
            free.linearise(operator, increment, Coupling::Full).expect("no element is inverted");
            let mut y = vec![[0.0; 4]; nodes.len()];
            free.apply(&x, &mut y).expect("no device");
            (y, free.diagonal().expect("no device"))
        })
    };
    let (y, diagonal) = by_threads(1);
    let error = difference(&y, &expected) / largest(&expected);
    assert!(error < 1e-13, "{} nodes: {error}", nodes.len());
    let assembled = tangent.diagonal();
    assert!(difference(&diagonal, &assembled) < 1e-13 * largest(&assembled));
    assert_eq!((y, diagonal), by_threads(2), "threads change the result");
    let mut single = product(layout, SINGLE_FROM);
    single.linearise(operator, increment, Coupling::Full).expect("no element is inverted");
    let mut y = vec![[0.0; 4]; nodes.len()];
    single.apply(&x, &mut y).expect("no device");
    assert!(difference(&y, &expected) < 3e-6 * largest(&expected));
}

#[test]
fn residual_and_tangent_are_derivatives_of_the_energy() {
    let at2 = PhaseField::new(0.3);
    let forms = [
        (Material::hencky as Law, at2),
        (Material::hencky as Law, PhaseField { split: Split::VolumetricDeviatoric, ..at2 }),
        (
            Material::hencky as Law,
            PhaseField { split: Split::Spectral, model: CrackDensity::At1, ..at2 },
        ),
        (Material::neo_hookean as Law, at2),
        (mixed, PhaseField { split: Split::VolumetricDeviatoric, ..at2 }),
    ];
    for (k, (law, field)) in forms.into_iter().enumerate() {
        // mixtures are implemented for Hencky's law only
        for form in [Form::Plain, Form::ALL[if k < 3 { 2 + k } else { 1 }]] {
            for stiff_damages in [true, false] {
                for rule in [DamageRule::Vertex, DamageRule::Consistent, DamageRule::Eleven] {
                    assert_taylor::<4, Linear>(form, rule, law, field, stiff_damages);
                    assert_taylor::<10, Quadratic>(form, rule, law, field, stiff_damages);
                }
            }
        }
    }
}

/// Checks that the number of threads does not change residual, energies, tangent and state of a mesh that is large enough
/// for several threads.
fn assert_threads_change_nothing<const N: usize, T: Element<N>>(n: usize) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let mesh = cube(n, &mut rng);
    let space = Space::new::<T>(&mesh, DamageRule::Vertex);
    let (nodes, elastic_points) = (space.nodes.len(), space.elastic_points());
    let pattern = Arc::new(Pattern::new(&space.tets, nodes));
    let operator = T::operator(Assembly::new(space));
    let field = PhaseField { irreversibility: Irreversibility::History, ..PhaseField::new(0.3) };
    let materials = materials(Material::hencky as Law, field, true);
    let size = 0.003 / n as f64;
    let mut random = || rng.random_range(-1.0..1.0);
    let fields = Fields {
        displacement: (0..nodes).map(|_| std::array::from_fn(|_| size * random())).collect(),
        damage: (0..nodes).map(|_| 0.5 + 0.4 * random()).collect(),
        ..Fields::default()
    };
    let context = StepContext::new(&fields.damage, 0.1);
    let increment = Increment { materials: &materials, fields: &fields, context };
    let evaluate = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| {
            let mut residual = Residual::new(nodes);
            let mut tangent = Tangent::new(Arc::clone(&pattern));
            let mut state = vec![0.0; elastic_points];
            operator.residual(&increment, &mut residual).expect("no element is inverted");
            operator.tangent(&increment, Coupling::Full, &mut tangent).expect("as before");
            operator.state(&increment, &mut state).expect("as before");
            assert!(tangent.symmetric && residual.elastic > 0.0);
            let energies = [residual.elastic, residual.fracture, residual.viscous];
            (residual.nodal, residual.drive, energies, tangent.blocks, state)
        })
    };
    let (alone, together) = (evaluate(1), evaluate(3));
    assert!(alone == together, "threads change the assembly of {N}-node elements");
    // an inverted element is detected by every thread
    let mut folded = fields.clone();
    folded.displacement[nodes / 2] = [3.0; 3];
    let increment = Increment { fields: &folded, ..increment };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().expect("threads");
    let mut residual = Residual::new(nodes);
    assert!(pool.install(|| operator.residual(&increment, &mut residual)).is_err());
}

#[test]
fn threads_change_no_bit_of_the_assembly() {
    assert_threads_change_nothing::<4, Linear>(17);
    assert_threads_change_nothing::<10, Quadratic>(12);
}

/// The tangent of a material with a strength is not symmetric, and no energy exists: the tangent is compared with
/// differences of the residual.
fn assert_tangent_of_strength<const N: usize, T: Element<N>>(rule: DamageRule) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
    let mesh = cube(2, &mut rng);
    let mut space = Space::new::<T>(&mesh, rule);
    space.rule.extra = ExtraTerms { stored: true, unsymmetric: true };
    let nodes = space.nodes.len();
    let pattern = Arc::new(Pattern::new(&space.tets, nodes));
    let operator = T::operator(Assembly::new(space));
    let field = PhaseField { model: CrackDensity::At1, ..PhaseField::new(0.3) };
    let strong = Material::hencky(275.0, 0.25)
        .with_fracture(Fracture { residual_stiffness: 1e-4, ..Fracture::new(2.0) })
        .with_strength(Strength::new(20.0, 60.0));
    let materials = [strong, Material::hencky(2000.0, 0.25)].map(|m| m.at_point(Some(&field)));
    let mut random_fields = |stretch: f64, damage: std::ops::Range<f64>| Fields {
        displacement: operator
            .domain()
            .nodes()
            .iter()
            .map(|x| std::array::from_fn(|k| stretch * x[k] + 0.03 * rng.random_range(-1.0..1.0)))
            .collect(),
        damage: (0..nodes).map(|_| rng.random_range(damage.clone())).collect(),
        ..Fields::default()
    };
    for stretch in [0.1, -0.1, 0.0] {
        let fields = random_fields(stretch, 0.2..0.8);
        let direction = random_fields(0.3, -1.0..1.0);
        let before = vec![0.0; nodes];
        let context = StepContext::new(&before, 0.1);
        let residual = |t: f64| {
            let at = moved(&fields, t, &direction);
            let mut residual = Residual::new(nodes);
            let increment = Increment { materials: &materials, fields: &at, context };
            operator.residual(&increment, &mut residual).expect("no element is inverted");
            residual.nodal
        };
        let mut tangent = Tangent::new(Arc::clone(&pattern));
        let increment = Increment { materials: &materials, fields: &fields, context };
        operator.tangent(&increment, Coupling::Full, &mut tangent).expect("no element is inverted");
        assert_matrix_free(operator.as_ref(), &increment, &tangent);
        let d = nodal(&direction);
        let mut product = vec![[0.0; 4]; nodes];
        tangent.multiply(&d, &mut product);
        let step = 1e-6;
        let (after, prior) = (residual(step), residual(-step));
        for equation in [0..3, 3..4] {
            let (mut error, mut size) = (0.0f64, 0.0f64);
            for n in 0..nodes {
                for k in equation.clone() {
                    let difference = (after[n][k] - prior[n][k]) / (2.0 * step);
                    error = error.max((product[n][k] - difference).abs());
                    size = size.max(difference.abs());
                }
            }
            assert!(error < 1e-6 * size, "{rule:?} {stretch} {equation:?}: {error} of {size}");
        }
    }
}

#[test]
fn the_tangent_of_a_strength_is_the_derivative_of_the_residual() {
    assert_tangent_of_strength::<4, Linear>(DamageRule::Vertex);
    assert_tangent_of_strength::<4, Linear>(DamageRule::Consistent);
    assert_tangent_of_strength::<10, Quadratic>(DamageRule::Vertex);
}
