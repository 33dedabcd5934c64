//! Number of solver iterations on different meshes.

use crate::support::{HEIGHT, RADIUS, loading, matrix};
use fem::{
    Effort, Grain, GrainList, GrainMode, LinearScheme, Material, Meshing, Order, PhaseField,
    SolverOptions,
};

/// Runs a specimen with five stiff spheres and quadratic elements. Returns the work of the solver.
fn effort(mode: GrainMode, spacing_mm: f64) -> Effort {
    let centres =
        [[0.9, 0.2, 1.0], [-1.0, 0.6, 1.3], [0.1, -1.1, 2.1], [1.1, 0.8, 3.1], [-0.9, -0.4, 3.3]];
    let spheres = centres.iter().map(|&centre| Grain::sphere(centre, 0.75)).collect();
    let grains = GrainList::new(spheres, RADIUS, HEIGHT);
    let meshing = Meshing { mode, curved: true, ..Meshing::new(spacing_mm) };
    let mesh = meshing.build(RADIUS, HEIGHT, &grains).expect("a mesh").mesh;
    let options = SolverOptions { linear: LinearScheme::Multigrid, ..SolverOptions::default() };
    let problem = loading(0.06, 0.06 / 0.22, 6)
        .builder(mesh)
        .and_then(|builder| {
            builder
                .order(Order::Quadratic)
                .materials([matrix(), Material::hencky(22_000.0, 0.25)])
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
    // the sum over four meshes is compared: on a single mesh, one Newton iteration changes the result by a tenth
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
