//! Invalid input is rejected before the first step; the message names the entity and the remedy.

use crate::support::{grain, loading, matrix, phase_field, prism, with_options};
use fem::{
    CompressionTest, Fracture, Material, Order, PhaseField, Schedule, SolverOptions, Split, TetMesh,
};

/// Valid input of a test. Each check makes one part of this input invalid.
struct Input {
    mesh: TetMesh,
    materials: Vec<Material>,
    field: PhaseField,
    loading: CompressionTest,
    options: SolverOptions,
}

fn refusal(spoil: impl FnOnce(&mut Input)) -> String {
    let mut input = Input {
        mesh: prism(2, true),
        materials: vec![matrix(), grain()],
        field: phase_field(Split::None),
        loading: loading(0.2, 1.0, 10),
        options: SolverOptions::default(),
    };
    spoil(&mut input);
    let Input { mesh, materials, field, loading, options } = input;
    with_options(mesh, Order::Linear, materials, Some(field), loading, options)
        .expect_err("refused")
        .to_string()
}

#[test]
fn invalid_input_is_rejected_with_the_entity_and_the_remedy() {
    let check = |message: String, fragments: &[&str]| {
        for fragment in fragments {
            assert!(message.contains(fragment), "'{fragment}' is not in: {message}");
        }
    };
    check(refusal(|i| i.mesh.tets[5].swap(0, 1)), &["tetrahedron 5", "swap"]);
    check(
        refusal(|i| drop(i.mesh.surfaces.remove("top"))),
        &["'top'", "its surfaces are 'bottom'"],
    );
    let upside_down = |i: &mut Input| {
        let (top, bottom) = (i.mesh.surfaces["top"].clone(), i.mesh.surfaces["bottom"].clone());
        i.mesh.surfaces = [("top".into(), bottom), ("bottom".into(), top)].into();
    };
    check(refusal(upside_down), &["'top' is not above surface 'bottom'"]);
    let overlapping = |i: &mut Input| {
        let bottom = &i.mesh.surfaces["bottom"];
        let foot: Vec<u32> = bottom.iter().flatten().copied().collect();
        let mut side = i.mesh.boundary_faces();
        side.retain(|face| {
            let on_foot = face.iter().filter(|&n| foot.contains(n)).count();
            (1..3).contains(&on_foot)
        });
        i.mesh.surfaces.insert("top".into(), side);
    };
    check(refusal(overlapping), &["'bottom' and 'top' have common nodes", "surface names"]);
    check(refusal(|i| i.materials.truncate(1)), &["1 materials for 2 regions", "matrix, grain"]);
    check(
        refusal(|i| i.materials[0] = Material::hencky(-275.0, 0.25)),
        &["material.matrix", "young_mpa = -275", "positive"],
    );
    check(
        refusal(|i| i.materials[1] = Material::hencky(275.0, 0.5)),
        &["material.grain", "poisson = 0.5", "0.49"],
    );
    let refused_fracture = |region: usize, fracture: Fracture| {
        refusal(move |i| i.materials[region].fracture = Some(fracture))
    };
    check(refused_fracture(1, Fracture::new(0.0)), &["toughness_n_per_mm = 0", "leave it out"]);
    check(
        refused_fracture(0, Fracture { viscosity_mpa_s: f64::NAN, ..Fracture::new(1.0) }),
        &["viscosity_mpa_s = NaN"],
    );
    check(
        refused_fracture(0, Fracture { residual_stiffness: 1.0, ..Fracture::new(1.0) }),
        &["residual_stiffness = 1", "[0, 1)"],
    );
    let unsplittable = |i: &mut Input| {
        i.materials[0].elasticity = Material::neo_hookean(275.0, 0.25).elasticity;
        i.field.split = Split::Spectral;
    };
    check(refusal(unsplittable), &["material.matrix", "no spectral split", "hencky"]);
    check(refusal(|i| i.field.length_mm = 0.0), &["phase_field", "length_mm = 0"]);
    check(
        refusal(|i| i.loading.displacement_mm = -0.2),
        &["test: displacement_mm = -0.2", "positive"],
    );
    check(refusal(|i| i.loading.displacement_mm = 5.0), &["displacement_mm = 5", "height"]);
    check(refusal(|i| i.loading.schedule.duration_s = 0.0), &["duration_s = 0"]);
    check(refusal(|i| i.loading.schedule = Schedule::fixed(1.0, 0)), &["steps = 0", "adaptive"]);
    check(
        refusal(|i| i.loading.schedule.stop_below_peak = Some(1.0)),
        &["stop_below_peak = 1", "0.1 for 10 %"],
    );
    check(refusal(|i| i.options.tolerance = 0.0), &["solver: tolerance = 0"]);
    check(refusal(|i| i.options.linear_tolerance = 0.5), &["solver: linear_tolerance = 0.5"]);
    check(refusal(|i| i.options.iterations = 0), &["solver: iterations = 0"]);
}
