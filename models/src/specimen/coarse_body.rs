//! Setup of the test of a case on a coarse body, which finds mistakes without the mesh of the case.

use fem::{CylinderLattice, GrainMode, Meshing, Mixture, ProblemWarning, TetMesh};

use super::block::block_mesh;
use super::build::packed;
use crate::case::{CaseFile, ConditionsCase, SpecimenGeometry};
use crate::results_folder::error::WorkflowError;
use crate::simulation::resolution::note_at_edge;
use crate::simulation::setup::Setup;
use crate::simulation::simulator::Simulator;

/// Spacing of the coarse body, relative to the smaller of radius and height.
const SPACING: f64 = 0.5;
/// Part of the radius and of half of the height that the grains of the coarse body fill.
const GRAINS: f64 = 0.7;
/// Grain fraction of the mixed tetrahedra of the coarse body.
const FRACTION: f32 = 0.3;

/// Notes and warnings about a case.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct CoarseCheck {
    pub(crate) notes: Vec<String>,
    pub(crate) warnings: Vec<String>,
}

/// Sets up the test of the case on a coarse cylinder with the size and the regions of the specimen, as a run sets up the
/// test on the mesh. Returns the notes and warnings that depend on no part of the mesh but its spacing. Does nothing for a
/// mesh file, and if the size of the specimen is not known.
///
/// # Errors
/// The error with which a run would end before its first load step.
pub(crate) fn check_on_coarse_body(
    file: &CaseFile,
    geometry: &SpecimenGeometry,
) -> Result<CoarseCheck, WorkflowError> {
    let (size_mm, meshing) = match geometry {
        SpecimenGeometry::Block { size_mm, notch, planes_mm, meshing } => {
            let spacing_mm = SPACING * size_mm.iter().copied().fold(f64::INFINITY, f64::min);
            // the sizes of the case have been checked: a block that cannot be meshed has been reported
            return match block_mesh(*size_mm, *notch, planes_mm, spacing_mm) {
                Ok(mesh) => set_up(file, mesh, meshing.spacing_mm / spacing_mm),
                Err(_) => Ok(CoarseCheck::default()),
            };
        }
        SpecimenGeometry::Cylinder { radius_mm, height_mm, meshing, .. } => {
            ([Some(*radius_mm), Some(*height_mm)], meshing)
        }
        SpecimenGeometry::Image { radius_mm, height_mm, meshing, .. }
        | SpecimenGeometry::Surfaces { radius_mm, height_mm, meshing, .. } => {
            ([*radius_mm, *height_mm], meshing)
        }
        SpecimenGeometry::Mesh { .. } | SpecimenGeometry::Absent => {
            return Ok(CoarseCheck::default());
        }
    };
    let [Some(radius_mm), Some(height_mm)] = size_mm else {
        return Ok(CoarseCheck::default());
    };
    let regions = file.regions(geometry);
    let coarse =
        |is_mixed| set_up_cylinder(file, [radius_mm, height_mm], &regions, meshing, is_mixed);
    let has_grains = regions.len() > 1;
    match meshing.mode {
        GrainMode::Fraction => coarse(has_grains),
        GrainMode::Auto if has_grains => match coarse(true) {
            Ok(checked) => Ok(checked),
            // the sizes of the grains decide whether the mesh has mixtures
            Err(refused) if has_mixtures(file, geometry)? => Err(refused),
            Err(_) => coarse(false),
        },
        _ => coarse(false),
    }
}

/// Sets up the test on a coarse cylinder \[radius, height\] in mm, whose matrix consists of mixtures if `is_mixed` is true.
fn set_up_cylinder(
    file: &CaseFile,
    [radius_mm, height_mm]: [f64; 2],
    regions: &[String],
    meshing: &Meshing,
    is_mixed: bool,
) -> Result<CoarseCheck, WorkflowError> {
    let spacing_mm = SPACING * radius_mm.min(height_mm);
    // the size and the spacing of the case have been checked: a cylinder that cannot be meshed has been reported
    let Ok(mesh) = (CylinderLattice { radius_mm, height_mm, spacing_mm }).build() else {
        return Ok(CoarseCheck::default());
    };
    let mut mesh = with_grains(mesh, regions, [radius_mm, height_mm]);
    if is_mixed {
        mix(&mut mesh);
    }
    set_up(file, mesh, meshing.spacing_mm / spacing_mm)
}

/// Sets up the test on a coarse mesh. `refinement` is the ratio of the spacing of the case to the spacing of this mesh.
fn set_up(
    file: &CaseFile,
    mut mesh: TetMesh,
    refinement: f64,
) -> Result<CoarseCheck, WorkflowError> {
    if let Some(kind) = file.case.test.kind
        && kind.kind().add_surfaces(&mut mesh).is_err()
    {
        // elements of this mesh may be larger than a surface of the test
        return Ok(CoarseCheck::default());
    }
    // a strength depends on the distance of the nodes in the mesh of the case
    let mut material = file.case.material.clone();
    let mean_edge_mm = mesh.mean_edge() * refinement;
    let apart_mm = mean_edge_mm / f64::from(u8::from(file.case.specimen.order));
    let strengths = material.values_mut().filter_map(|material| material.strength.as_mut());
    strengths.for_each(|strength| {
        strength.node_spacing_mm.get_or_insert(apart_mm);
    });
    // the gauge points have been compared with the size of the specimen
    let conditions = file.case.conditions.clone();
    let conditions = conditions.map(|all| ConditionsCase { extensometer: None, ..all });
    let setup = Setup { material: &material, conditions: conditions.as_ref(), ..Setup::from(file) };
    let notes = note_at_edge(&setup, &mesh, mean_edge_mm).into_iter().collect();
    let parameters = file.case.whole_prior();
    let parameters = parameters.iter().flat_map(|prior| prior.parameters()).cloned();
    let simulator = Simulator::new(&setup, mesh, parameters.collect())?;
    let warnings = simulator.problem().warnings();
    let of_strength =
        |warning: &&ProblemWarning| matches!(warning, ProblemWarning::CompressiveStrength { .. });
    let warnings = warnings.iter().filter(of_strength).map(ToString::to_string).collect();
    Ok(CoarseCheck { notes, warnings })
}

/// Whether a mesh of the packing of the case has mixtures; false for grains that are known only from their images or
/// surfaces.
fn has_mixtures(file: &CaseFile, geometry: &SpecimenGeometry) -> Result<bool, WorkflowError> {
    match geometry {
        SpecimenGeometry::Cylinder {
            grains: Some(packing), radius_mm, height_mm, meshing, ..
        } => {
            let grains = packed(&file.path, Some(packing), *radius_mm, *height_mm)?;
            Ok(meshing.mixes(&grains))
        }
        _ => Ok(false),
    }
}

/// Returns the mesh with these regions. All regions after the first region are sectors of an inner body.
fn with_grains(mesh: TetMesh, regions: &[String], [radius_mm, height_mm]: [f64; 2]) -> TetMesh {
    let names: Vec<&str> = regions.iter().map(String::as_str).collect();
    let others = names.len().saturating_sub(1);
    mesh.with_regions(&names, |[x, y, z]| {
        let is_inner = x.hypot(y) < GRAINS * radius_mm
            && (2.0 * z / height_mm - 1.0).abs() < GRAINS
            && others > 0;
        let turn = y.atan2(x) / std::f64::consts::TAU + 0.5;
        let sector = ((turn * others as f64) as usize).min(others.saturating_sub(1));
        if is_inner { 1 + sector as u16 } else { 0 }
    })
}

/// Makes mixtures of all tetrahedra of the matrix.
fn mix(mesh: &mut TetMesh) {
    let mixture = |region: &u16| match region {
        0 => Mixture { fraction: FRACTION, normal: [0.0, 0.0, 1.0], region: 1 },
        _ => Mixture::default(),
    };
    mesh.mixture = Some(mesh.region_of.iter().map(mixture).collect());
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    const CASE: &str = r#"
[specimen]
radius_mm = 2.5
height_mm = 4.4
spacing_mm = 1.2
grains = { fraction = 0.2, seed = 1 }
grain_mode = "auto"
[material.matrix]
young_mpa = 275.0
poisson = 0.25
toughness_n_per_mm = 0.0025
viscosity_mpa_s = 0.3
[material.grain]
young_mpa = 22000.0
poisson = 0.25
[phase_field]
model = "at1"
length_mm = 0.04
[test]
displacement_mm = 0.22
steps = 30
"#;

    /// Checks the case with `changes` to its text.
    fn checked(changes: &[(&str, &str)]) -> Result<CoarseCheck, String> {
        let mut text = CASE.to_owned();
        for (from, to) in changes {
            assert!(text.contains(from), "the case has no {from:?}");
            text = text.replacen(from, to, 1);
        }
        let file = CaseFile::parse(&text, Path::new("case.toml")).map_err(|e| e.to_string())?;
        let geometry = file.geometry().map_err(|e| e.to_string())?;
        check_on_coarse_body(&file, &geometry).map_err(|error| error.to_string())
    }

    #[test]
    fn a_case_that_runs_is_accepted_in_all_modes() {
        for mode in ["auto", "fraction", "conforming", "whole"] {
            let mode = format!("grain_mode = \"{mode}\"");
            let CoarseCheck { notes, warnings } =
                checked(&[("grain_mode = \"auto\"", &mode)]).expect("valid");
            assert!(warnings.is_empty() && notes.len() == 1, "{mode}: {notes:?} {warnings:?}");
            assert!(notes[0].contains("effective toughness"), "{notes:?}");
        }
        assert!(checked(&[("grains = { fraction = 0.2, seed = 1 }", "")]).is_ok());
    }

    #[test]
    fn an_interface_wider_than_the_body_is_refused() {
        let table = |width: &str| {
            format!(
                "[interface.matrix-grain]\ntoughness_n_per_mm = 0.001\nwidth_mm = {width}\n[test]"
            )
        };
        assert!(checked(&[("[test]", &table("0.4"))]).is_ok());
        let refused = checked(&[("[test]", &table("40.0"))]).unwrap_err();
        assert!(refused.contains("width_mm") && refused.contains("case.toml"), "{refused}");
    }

    /// Strength and plasticity of a mixture are not defined. Grains that the mesh follows are no mixtures.
    #[test]
    fn materials_that_mixtures_cannot_have_are_refused_where_the_mesh_has_mixtures() {
        let strength = "strength = { tensile_mpa = 2.0, compressive_mpa = 20.0 }\n[material.grain]";
        let strength = ("[material.grain]", strength);
        let reason = fem::Unsupported::MixtureStrength.to_string();
        let refused = checked(&[strength]).unwrap_err();
        assert!(refused.contains(&reason), "{refused}");
        for changed in [
            ("grain_mode = \"auto\"", "grain_mode = \"conforming\""),
            // large grains, which the mesh follows
            ("spacing_mm = 1.2", "spacing_mm = 0.12"),
        ] {
            let CoarseCheck { warnings, .. } = checked(&[strength, changed]).expect("no mixtures");
            let is_named = |warning: &String| warning.contains("uniaxial compression");
            assert!(warnings.iter().any(is_named), "{warnings:?}");
        }
    }
}
