//! Elements with curved edges: patch test, geometry, convergence.

use crate::support::block::{block, even};
use crate::support::manufactured::{errors_on, order};
use fem::{
    Axis, Conditions, CylinderLattice, DamageQuadrature, Fields, Fracture, Material, Order,
    PhaseField, Problem, Schedule, SolverOptions, TetMesh, Wall,
};

const FACES: [&str; 6] = ["left", "right", "front", "back", "bottom", "top"];

/// Mesh of a cube with plane faces and curved inner edges.
fn bent_cube(n: usize) -> TetMesh {
    let cells = even(0.0, 1.0, n);
    let mesh = block([&cells, &cells, &cells]).mapped(|x| {
        let bubble: f64 = x.iter().map(|x| (std::f64::consts::PI * x).sin()).product();
        [x[0] + 0.08 * bubble, x[1] - 0.06 * bubble, x[2] + 0.05 * bubble]
    });
    mesh.validate().expect("a valid mesh");
    mesh
}

/// Patch test: an affine displacement is in equilibrium for any edges, with four and with eleven quadrature points.
#[test]
fn affine_patch_of_curved_elements() {
    let affine = |x: [f64; 3], t: f64| {
        let h = [[-0.08, 0.05, 0.02], [0.1, 0.07, -0.03], [-0.04, 0.06, -0.12]];
        std::array::from_fn::<f64, 3, _>(|i| t * (0..3).map(|j| h[i][j] * x[j]).sum::<f64>())
    };
    let tough = Material::hencky(10.0, 0.3).with_fracture(Fracture::new(1e3));
    let eleven = PhaseField { quadrature: DamageQuadrature::Eleven, ..PhaseField::new(1.0) };
    let error = |n: usize, field: Option<PhaseField>| {
        let conditions =
            FACES.iter().fold(Conditions::new(), |c, face| c.prescribe(face, Axis::ALL, affine));
        let problem = Problem::builder(bent_cube(n))
            .order(Order::Quadratic)
            .materials([tough.clone()])
            .phase_field(field)
            .conditions(conditions)
            .schedule(Schedule::fixed(1.0, 2))
            .options(SolverOptions { tolerance: 1e-12, ..SolverOptions::default() })
            .build()
            .expect("valid");
        let outcome = problem.run(&mut ());
        assert_eq!(outcome.curve.len(), 2, "{:?}", outcome.end);
        let exact = problem.nodes().iter().map(|&x| affine(x, 1.0));
        let all = outcome.fields.displacement.iter().zip(exact);
        let largest = all.flat_map(|(u, exact)| (0..3).map(move |k| (u[k] - exact[k]).abs()));
        largest.fold(0.0, f64::max)
    };
    for field in [None, Some(eleven)] {
        let largest = error(3, field);
        assert!(largest < 1e-10, "{largest}");
    }
}

#[test]
fn curved_elements_converge_at_the_optimal_orders() {
    for damaged in [false, true] {
        let [coarse, fine] = [2, 4].map(|n| errors_on(bent_cube(n), Order::Quadratic, damaged));
        let pairs = [(coarse.displacement, fine.displacement), (coarse.damage, fine.damage)];
        for (coarse, fine) in &pairs[..if damaged { 2 } else { 1 }] {
            for (k, expected) in [3.0, 2.0].into_iter().enumerate() {
                let observed = order(coarse[k], fine[k], 2.0);
                assert!(observed > expected - 0.35, "order {observed} of {coarse:?}, {fine:?}");
            }
        }
    }
}

/// The volume of a cylinder with a curved wall converges with fourth order, both as the integral over the elements and as
/// computed by the mesh.
#[test]
fn the_volume_of_a_round_cylinder_converges_at_fourth_order() {
    let (radius, height) = (2.5, 4.4);
    let exact = std::f64::consts::PI * radius * radius * height;
    let error = |spacing_mm: f64| {
        let lattice = CylinderLattice { radius_mm: radius, height_mm: height, spacing_mm };
        let mesh = lattice.build_with(Wall::Curved).expect("a lattice");
        let stated = mesh.volume();
        let problem = Problem::builder(mesh)
            .order(Order::Quadratic)
            .materials([Material::hencky(1.0, 0.3)])
            .schedule(Schedule::fixed(1.0, 1))
            .conditions(Conditions::new().fix("bottom", Axis::ALL))
            .build()
            .expect("valid");
        let nodes = problem.nodes().len();
        let (displacement, damage) = (vec![[0.0; 3]; nodes], vec![0.0; nodes]);
        let fields = Fields { displacement, damage, ..Fields::default() };
        let integrated = problem.integrate(&fields, |_| 1.0).expect("the fields of the problem");
        assert!((integrated - stated).abs() < 1e-12 * exact, "{integrated} and {stated}");
        (integrated - exact).abs()
    };
    // meshes with 12 and 24 cells around the circumference
    let (coarse, fine) = (error(1.0), error(0.5));
    let observed = order(coarse, fine, 2.0);
    assert!(observed > 3.7 && fine < 1e-4 * exact, "order {observed} of {coarse}, {fine}");
}
