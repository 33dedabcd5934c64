//! Number of solver iterations on different meshes.

use crate::support::{HEIGHT, RADIUS, loading, matrix};
use fem::{
    CylinderLattice, Effort, Grain, GrainList, GrainMode, LinearScheme, Material, Meshing, Order,
    PhaseField, SolverOptions, TetMesh, Wall,
};

/// Runs a specimen with five stiff spheres and quadratic elements. Returns the work of the solver.
fn effort(mode: GrainMode, spacing_mm: f64) -> Effort {
    let centres =
        [[0.9, 0.2, 1.0], [-1.0, 0.6, 1.3], [0.1, -1.1, 2.1], [1.1, 0.8, 3.1], [-0.9, -0.4, 3.3]];
    let spheres = centres.iter().map(|&centre| Grain::sphere(centre, 0.75)).collect();
    let grains = GrainList::new(spheres, RADIUS, HEIGHT);
    let meshing = Meshing { mode, curved: true, ..Meshing::new(spacing_mm) };
    let mesh = meshing.build(RADIUS, HEIGHT, &grains).expect("a mesh").mesh;
    effort_on(mesh, vec![matrix(), Material::hencky(22_000.0, 0.25)])
}

/// Returns the work of the solver in six load steps with multigrid.
fn effort_on(mesh: TetMesh, materials: Vec<Material>) -> Effort {
    let options = SolverOptions { linear: LinearScheme::Multigrid, ..SolverOptions::default() };
    let problem = loading(0.06, 0.06 / 0.22, 6)
        .builder(mesh)
        .and_then(|builder| {
            builder
                .order(Order::Quadratic)
                .materials(materials)
                .phase_field(PhaseField::new(0.06))
                .options(options)
                .build()
        })
        .expect("valid input");
    let outcome = problem.run(&mut ());
    assert_eq!(outcome.curve.len(), 6, "{:?}", outcome.end);
    outcome.effort
}

#[test]
fn conforming_meshes_need_few_more_iterations_than_a_lattice() {
    // compare sums over four meshes, because on a single mesh one Newton iteration changes the result by a tenth
    let [mut lattice, mut conforming] = [[0; 2]; 2];
    for spacing_mm in [0.9, 0.8, 0.7, 0.6] {
        for (mode, sum) in
            [(GrainMode::Whole, &mut lattice), (GrainMode::Conforming, &mut conforming)]
        {
            let Effort { iterations, linear, .. } = effort(mode, spacing_mm);
            *sum = [sum[0] + iterations, sum[1] + linear];
        }
    }
    let ratio = [0, 1].map(|k| f64::from(conforming[k]) / f64::from(lattice[k]));
    assert!(ratio[0] < 1.15 && ratio[1] < 1.5, "{conforming:?} against {lattice:?}");
}

/// The supports against rigid motions are at the nodes farthest along x and y. On a curved wall these nodes may be
/// midpoints of edges, which are not nodes of the linear level of multigrid.
#[test]
fn supports_at_midpoints_of_a_curved_wall_need_no_more_iterations() {
    let lattice = CylinderLattice { radius_mm: RADIUS, height_mm: HEIGHT, spacing_mm: 0.9 };
    let effort_turned = |edges: f64| {
        let mesh = lattice.build_with(Wall::Curved).expect("a lattice");
        let on_wall = |x: &&[f64; 3]| (x[0].hypot(x[1]) - RADIUS).abs() < 1e-9 && x[2] == 0.0;
        let mut angles: Vec<f64> =
            mesh.nodes.iter().filter(on_wall).map(|x| x[1].atan2(x[0])).collect();
        angles.sort_by(f64::total_cmp);
        let (sin, cos) = (edges * (angles[1] - angles[0]) - angles[0]).sin_cos();
        let turned = mesh.mapped(|[x, y, z]| [cos * x - sin * y, sin * x + cos * y, z]);
        effort_on(turned, vec![matrix()])
    };
    // turn the mesh so that a vertex is on the x axis, or the midpoint of an edge
    let [at_vertex, at_midpoint] = [0.0, 0.5].map(effort_turned);
    let ratio = f64::from(at_midpoint.linear) / f64::from(at_vertex.linear);
    assert!(ratio < 1.3, "{at_midpoint:?} against {at_vertex:?}");
}
