//! Stage `mesh`: generates a tetrahedral mesh from the geometry or from labels.

use std::collections::BTreeSet;

use fem::{ImportedSurfaces, MATRIX, MeshReport, Meshed, Meshing, Quality, TetMesh, gmsh, vtu};

use super::build::{
    Scanned, direct_mesh, import_notes, imported_grains, imported_mesh, labelled_mesh,
    surfaces_mesh,
};
use super::images;
use super::images::mesh_file;
use super::segment::write_picture;
use super::segmented_grains::SegmentedGrains;
use crate::case::SpecimenGeometry;
use crate::pipeline::inputs::Inputs;
use crate::pipeline::task::Task;
use crate::progress::say;
use crate::report::{mesh_picture, mesh_quality};
use crate::results_folder::error::WorkflowError;
use crate::simulation::resolution::resolution_note;
use crate::simulation::setup::height_mm;
use crate::simulation::simulator::Simulator;

pub(crate) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let geometry = task.inputs.geometry()?;
    if geometry == SpecimenGeometry::Absent {
        // record the source of the runs, so that the stage is run again once the case has a specimen
        task.inputs.is_built_in();
        return Ok("the case has no specimen: nothing to mesh".to_owned());
    }
    let setup = task.inputs.setup();
    let (mesh, report, surfaces) = match &geometry {
        SpecimenGeometry::Surfaces { import, radius_mm, height_mm, meshing } => {
            let case = task.inputs.case_path();
            let imported = imported_grains(case, import, [*radius_mm, *height_mm], meshing)?;
            say("mesh", &imported.in_words());
            imported.warnings().iter().for_each(|warning| task.warn(warning));
            let [radius_mm, height_mm] = imported.size_mm();
            task.inputs.check_spacing(meshing.spacing_mm, radius_mm, height_mm)?;
            let Meshed { mesh, report } = surfaces_mesh(case, &imported, meshing)?;
            (mesh, Some(report), Some(imported))
        }
        _ => {
            let (mesh, report) = mesh_with(&task.inputs, images::FIRST, &|meshing| *meshing)?;
            (mesh, report, None)
        }
    };
    for warning in report.iter().flat_map(MeshReport::warnings) {
        task.warn(&warning);
    }
    if let SpecimenGeometry::Mesh { file, regions, surfaces } = &geometry {
        let notes = imported_mesh(file, regions, surfaces)?.notes;
        import_notes(file, &notes).iter().for_each(|note| task.warn(note));
    }
    task.product("mesh.msh", |path| gmsh::write(path, &mesh).map(drop))?;
    task.product("mesh.vtu", |path| vtu::write(path, &mesh, &[], &[]))?;
    write_picture(task, "mesh.png", &mesh_picture(&mesh))?;
    task.write("mesh_quality.svg", mesh_quality(&Quality::smallest_dihedrals_deg(&mesh)))?;

    let mut rows = quantities(&mesh);
    match &report {
        Some(report) => rows.extend(of_report(report)),
        None => rows.push(("grains".to_owned(), labelled_grains(&mesh))),
    }
    rows.extend(surfaces.iter().flat_map(of_surfaces));
    let (tets, nodes) = (mesh.tets.len(), mesh.nodes.len());
    let part = grains_in_words(&mesh, report.as_ref());
    resolution_note(&setup, &mesh).iter().for_each(|note| say("note", note));
    // build a simulator, so that materials or a test that do not suit the mesh are reported before any run
    let simulator = Simulator::new(&setup, mesh, Vec::new())?;
    for warning in simulator.problem().warnings() {
        task.warn(&warning.to_string());
    }
    rows.push(("unknowns".to_owned(), simulator.problem().unknowns() as f64));
    let rows = rows.into_iter().map(|(name, value)| [name, value.to_string()]);
    task.write_csv("mesh.csv", ["quantity", "value"], rows)?;
    drop(simulator);
    for image in images::FIRST + 1..=images::count(&task.inputs)? {
        task.check_interrupt()?;
        further(task, image)?;
    }
    Ok(format!("{tets} tetrahedra, {nodes} nodes, {part}"))
}

/// Meshes image number `image` (2 or more), which shows a further specimen.
fn further(task: &Task<'_>, image: usize) -> Result<(), WorkflowError> {
    let (mesh, report) = mesh_with(&task.inputs, image, &|meshing| *meshing)?;
    for warning in report.iter().flat_map(MeshReport::warnings) {
        task.warn(&format!("image {image}: {warning}"));
    }
    task.product(&mesh_file(image, "msh"), |path| gmsh::write(path, &mesh).map(drop))?;
    let mut rows = quantities(&mesh);
    rows.extend(report.iter().flat_map(of_report));
    let rows = rows.into_iter().map(|(name, value)| [name, value.to_string()]);
    task.write_csv(&mesh_file(image, "csv"), ["quantity", "value"], rows)?;
    let (tets, part) = (mesh.tets.len(), grains_in_words(&mesh, report.as_ref()));
    say("mesh", &format!("image {image}: {tets} tetrahedra, {part}"));
    let simulator = Simulator::new(&task.inputs.setup(), mesh, Vec::new())?;
    for warning in simulator.problem().warnings() {
        task.warn(&format!("Image {image}: {warning}"));
    }
    Ok(())
}

/// Generates the mesh of image number `image`. `changed` changes the case's mesher settings first. Returns the mesh and
/// the mesher's report (`None` for an imported mesh).
pub(crate) fn mesh_with(
    inputs: &Inputs<'_>,
    image: usize,
    changed: &dyn Fn(&Meshing) -> Meshing,
) -> Result<(TetMesh, Option<MeshReport>), WorkflowError> {
    let mut geometry = inputs.geometry()?;
    if let SpecimenGeometry::Cylinder { meshing, .. }
    | SpecimenGeometry::Block { meshing, .. }
    | SpecimenGeometry::Image { meshing, .. }
    | SpecimenGeometry::Surfaces { meshing, .. } = &mut geometry
    {
        *meshing = changed(meshing);
    }
    let Some((scanned, meshing)) = Scanned::of(&geometry) else {
        return direct_mesh(inputs.case_path(), &geometry);
    };
    let grains = SegmentedGrains::read(inputs, image, &scanned)?;
    let cylinder = &grains.cylinder;
    inputs.check_spacing(meshing.spacing_mm, cylinder.radius_mm, cylinder.height_mm())?;
    let SegmentedGrains { labels, phases, cylinder, .. } = &grains;
    let (case, measured) = (inputs.case_path(), grains.measured());
    let Meshed { mesh, report } =
        labelled_mesh(case, labels, measured, phases.clone(), cylinder, &meshing)?;
    Ok((mesh, Some(report)))
}

/// Describes the grain fraction of a mesh. If it differs from the grain fraction of the geometry, describes both.
fn grains_in_words(mesh: &TetMesh, report: Option<&MeshReport>) -> String {
    let part = 100.0 * grain_fraction(mesh);
    let asked = report.map(|report| 100.0 * report.asked_fraction);
    match asked.filter(|asked| (part - asked).abs() > 0.1) {
        Some(asked) => format!("{part:.1} % grains (those that were to be meshed: {asked:.1} %)"),
        None => format!("{part:.1} % grains"),
    }
}

/// Volume fraction of grains; a mixed tetrahedron contributes its volume times its grain fraction.
pub(crate) fn grain_fraction(mesh: &TetMesh) -> f64 {
    let volumes = mesh.volumes();
    let grains: f64 = grain_parts(mesh).iter().zip(&volumes).map(|(part, v)| part * v).sum();
    grains / volumes.iter().sum::<f64>()
}

/// Grain fraction of each tetrahedron, all grain phases together.
pub(crate) fn grain_parts(mesh: &TetMesh) -> Vec<f64> {
    // a mesh file of another program may have regions that are not grains
    let has_grains = mesh.mixture.is_some() || mesh.grain_of.is_some();
    let is_grain: Vec<bool> = mesh
        .regions
        .iter()
        .map(|region| region == "grain" || (has_grains && region != MATRIX))
        .collect();
    let part = |tet: usize| {
        let mixture = mesh.mixture.as_ref().map(|all| all[tet]).unwrap_or_default();
        match is_grain[usize::from(mesh.region_of[tet])] {
            true => 1.0,
            false => f64::from(mixture.fraction),
        }
    };
    (0..mesh.tets.len()).map(part).collect()
}

/// Rows of `mesh.csv` for any mesh: name and value.
fn quantities(mesh: &TetMesh) -> Vec<(String, f64)> {
    let quality = Quality::of(mesh);
    let mut rows = [
        ("nodes", mesh.nodes.len() as f64),
        ("tets", mesh.tets.len() as f64),
        ("height_mm", height_mm(mesh)),
        ("mean_edge_mm", quality.mean_edge_mm),
        ("volume_mm3", mesh.volume()),
        ("dihedral_min_deg", quality.min_dihedral_deg),
        ("dihedral_p01_deg", quality.p01_dihedral_deg),
        ("scaled_jacobian_min", quality.min_scaled_jacobian),
        ("grain_fraction", grain_fraction(mesh)),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec();
    // a mixed tetrahedron contributes to each of its two phases in proportion to the fraction of the phase
    for (name, volume) in mesh.regions.iter().zip(mesh.phase_volumes()) {
        rows.push((format!("volume_{name}_mm3"), volume));
    }
    rows
}

/// Rows of `mesh.csv` for a specimen from STL files: changes to the grains, and the position of the cylinder.
fn of_surfaces(imported: &ImportedSurfaces) -> Vec<(String, f64)> {
    let triangles: usize = imported.surfaces.iter().map(|surface| surface.triangles.len()).sum();
    let shrunk = imported.factors.iter().filter(|&&factor| factor < 1.0).count();
    let [x, y] = imported.cylinder.centre_mm;
    let mut rows = vec![
        ("stl_triangles", imported.triangles_read as f64),
        ("stl_volume_mm3", imported.volume_read_mm3),
        ("surface_triangles", triangles as f64),
        ("surface_volume_mm3", imported.volume_mm3()),
        ("surface_overlap_mm3", imported.overlap_mm3),
        ("shrunk_grains", shrunk as f64),
        ("centre_x_mm", x),
        ("centre_y_mm", y),
        ("bottom_mm", imported.cylinder.bottom_mm),
    ];
    rows.extend(imported.least_gap_mm.map(|gap| ("least_distance_mm", gap)));
    rows.into_iter().map(|(name, value)| (name.to_owned(), value)).collect()
}

/// Number of distinct grains in the grain labels of a mesh file.
fn labelled_grains(mesh: &TetMesh) -> f64 {
    let grains = mesh.grain_of.iter().flatten().copied().filter(|&grain| grain > 0);
    grains.collect::<BTreeSet<u32>>().len() as f64
}

/// Rows of `mesh.csv` that are known only for meshes that this program created.
fn of_report(report: &MeshReport) -> Vec<(String, f64)> {
    let counted = |mode| report.grains_in(mode) as f64;
    let mut rows = [
        ("grains", report.solid_grains().filter(|grain| grain.achieved_mm3 > 0.0).count() as f64),
        ("asked_grain_fraction", report.asked_fraction),
        ("grains_followed", counted(fem::GrainMode::Conforming)),
        ("grains_mixed", counted(fem::GrainMode::Fraction)),
        ("grains_lost", report.lost_grains() as f64),
        ("mixed_tets", report.mixed_tets as f64),
        ("multiphase_tets", report.multiphase_tets as f64),
        ("interface_rms_mm", report.interface_rms_mm),
        ("wall_error_mm", report.wall_error_mm),
        ("euler_characteristic", report.euler_characteristic as f64),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec();
    if report.phases.len() > 1 {
        for phase in &report.phases {
            let name = &phase.name;
            rows.push((format!("asked_volume_{name}_mm3"), phase.asked_mm3));
            if phase.is_void() {
                rows.push((format!("volume_{name}_mm3"), phase.achieved_mm3));
            }
        }
    }
    if report.void_tets > 0 {
        rows.push(("void_tets".to_owned(), report.void_tets as f64));
        rows.push(("loose_tets".to_owned(), report.loose_tets as f64));
    }
    rows
}
