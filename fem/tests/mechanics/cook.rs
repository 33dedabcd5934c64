//! Cook's membrane: a tapered panel that is clamped on its left side and sheared on its right side.

use fem::{Axis, Conditions, End, Material, MooneyRivlin, Order, Problem, Schedule, TetMesh};

/// Mesh of the panel with the corners (0, 0), (48, 44), (48, 60), (0, 44) mm and this thickness (mm), of n × n cells.
pub(super) fn panel(n: usize, thickness: f64) -> TetMesh {
    let mut mesh = TetMesh { regions: vec!["panel".into()], ..TetMesh::default() };
    for z in [0.0, thickness] {
        for j in 0..=n {
            for i in 0..=n {
                let (s, t) = (i as f64 / n as f64, j as f64 / n as f64);
                mesh.nodes.push([48.0 * s, 44.0 * s + t * (44.0 - 28.0 * s), z]);
            }
        }
    }
    let node = |i: usize, j: usize, k: usize| (i + (n + 1) * (j + (n + 1) * k)) as u32;
    for (i, j) in (0..n * n).map(|c| (c % n, c / n)) {
        let corner = |c: usize| node(i + (c & 1), j + (c >> 1 & 1), c >> 2);
        for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
            mesh.tets.push([corner(0), corner(a), corner(b), corner(7)]);
            mesh.region_of.push(0);
        }
        let mut face = |name: &str, triangles: [[usize; 3]; 2]| {
            let triangles = triangles.map(|t| t.map(corner));
            mesh.surfaces.entry(name.into()).or_default().extend(triangles);
        };
        face("front", [[0, 3, 1], [0, 2, 3]]);
        face("back", [[4, 5, 7], [4, 7, 6]]);
        if i == 0 {
            face("left", [[0, 6, 2], [0, 4, 6]]);
        }
        if i + 1 == n {
            face("right", [[1, 3, 7], [1, 7, 5]]);
        }
    }
    mesh
}

/// Test of the panel. The middle plane z = 0 is a plane of symmetry; the face at z = `half_mm` is free.
struct Membrane {
    material: Material,
    /// Half the thickness, mm.
    half_mm: f64,
    /// Components of the displacement that are fixed on the left side.
    clamped: Vec<Axis>,
    traction_mpa: f64,
    steps: u32,
    /// Height of the point on the right side whose deflection is compared, mm.
    height_mm: f64,
}

impl Membrane {
    /// Returns the deflection with n × n cells, mm.
    fn deflection(&self, n: usize, order: Order) -> f64 {
        let traction = self.traction_mpa;
        let conditions = Conditions::new()
            .fix("left", self.clamped.clone())
            .fix("front", [Axis::Z])
            .traction("right", move |_, time_s| [0.0, traction * time_s, 0.0]);
        let problem = Problem::builder(panel(n, self.half_mm))
            .order(order)
            .materials([self.material.clone()])
            .conditions(conditions)
            .schedule(Schedule::fixed(1.0, self.steps))
            .build()
            .expect("valid input");
        let outcome = problem.run(&mut ());
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        let target = [48.0, self.height_mm, 0.0];
        let near = |x: &[f64; 3]| x.iter().zip(target).all(|(a, b)| (a - b).abs() < 1e-9);
        let tip = problem.nodes().iter().position(near).expect("a node at the point");
        outcome.fields.displacement[tip][1]
    }
}

/// Plane stress with E = 1, ν = 1/3, unit load and unit thickness. The published deflection of the middle of the right
/// side is 23.96 (Cook, Malkus & Plesha 1989, section 6.13); meshes converge to it from below. The load in this test is
/// small, so that the problem is geometrically linear.
#[test]
fn the_linear_membrane_converges_to_its_published_deflection() {
    let load = 1e-6;
    let membrane = Membrane {
        material: Material::hencky(1.0, 1.0 / 3.0),
        half_mm: 0.05,
        clamped: vec![Axis::X, Axis::Y],
        traction_mpa: load / 16.0,
        steps: 1,
        height_mm: 52.0,
    };
    let deflections =
        |cells: [usize; 3], order| cells.map(|n| membrane.deflection(n, order) / load);
    let quadratic = deflections([4, 8, 16], Order::Quadratic);
    assert!(quadratic[0] < quadratic[1] && quadratic[1] < quadratic[2], "{quadratic:?}");
    assert!((quadratic[2] - 23.96).abs() < 0.04, "{quadratic:?}");
    let linear = deflections([8, 16, 32], Order::Linear);
    assert!(linear[0] < linear[1] && linear[1] < linear[2], "{linear:?}");
    assert!((linear[2] - 23.96).abs() < 0.04 * 23.96, "{linear:?}");
}

/// Finite strain with μ = 0.4225 MPa, ν = 0.3, a traction of 1/16 MPa, and a panel of 1 mm thickness with free faces. The
/// published deflection of the upper corner is 14.32 to 14.33 mm, computed with at least 16 × 16 quadratic hexahedra
/// (Pelteret & McBride, deal.II code gallery 2016, doi:10.5281/zenodo.1228964). The energy is the same: a Mooney–Rivlin
/// law with C₀₁ = 0.
#[test]
fn the_finite_strain_membrane_converges_to_its_published_deflection() {
    let (shear, nu) = (0.4225, 0.3);
    let bulk_mpa = 2.0 * shear * (1.0 + nu) / (3.0 * (1.0 - 2.0 * nu));
    let law = MooneyRivlin { c10_mpa: 0.5 * shear, c01_mpa: 0.0, bulk_mpa };
    let membrane = Membrane {
        material: Material::hyperelastic(law).expect("a law"),
        half_mm: 0.5,
        clamped: vec![Axis::X, Axis::Y, Axis::Z],
        traction_mpa: 1.0 / 16.0,
        steps: 4,
        height_mm: 60.0,
    };
    let quadratic = [4, 8, 16].map(|n| membrane.deflection(n, Order::Quadratic));
    assert!(quadratic[0] < quadratic[1] && quadratic[1] < quadratic[2], "{quadratic:?}");
    assert!((quadratic[2] - 14.33).abs() < 0.03, "{quadratic:?}");
    let linear = [4, 8, 16].map(|n| membrane.deflection(n, Order::Linear));
    assert!(linear[0] < linear[1] && linear[1] < linear[2], "{linear:?}");
    assert!((linear[2] - 14.33).abs() < 0.08 * 14.33, "{linear:?}");
}
