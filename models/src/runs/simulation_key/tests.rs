//! The identity of runs contains every key and file that can change a run.

use std::collections::BTreeSet;
use std::path::Path;

use fem::CylinderLattice;
use serde_json::Value;

use super::*;
use crate::case::{Case, CaseFile, Microstructure, schema_of};
use crate::case_inputs::CaseInputs;
use crate::runs::keyed_levels::keyed_levels;
use crate::runs::microstructures::Microstructures;
use crate::runs::run_source::key_of_runs;
use crate::runs::run_sources::{KEYS_OF_RUNS, source_of};
use crate::specimen::virtual_bodies::VirtualBodies;

/// Keys and tables that cannot change a run, by the reason.
const WITHOUT_EFFECT: [(&str, &[&str]); 7] = [
    ("the test of each entry is a case of its own, with its own runs", &["tests"]),
    ("only the command `simulate` writes these files", &["output"]),
    ("names and units; the priors of [parameters] belong to the key `prior`", &["parameters"]),
    ("applied to the curves of finished runs", &["machine", "qoi"]),
    (
        "determines how many runs there are, and on which levels: each stored run has its inputs, each level and batch \
         its own identity",
        &["extend", "sequential", "fidelity"],
    ),
    (
        "decides which runs fail, but changes no finished run",
        &["simulator.time_limit_s", "simulator.retries"],
    ),
    (
        "used after the runs; virtual specimens and confirming runs have identities of their own",
        &["surrogate", "experiments", "calibration", "confirm", "validation", "further_tests"],
    ),
];

/// Keys of a case with the keys of its tables, such as `test` and `specimen.mesh`. A table whose keys are names is one key.
fn keys_of_cases() -> Vec<String> {
    let schema = schema_of::<Case>("case");
    let properties = |value: &Value| -> Option<Vec<String>> {
        let reference = value["$ref"].as_str().or_else(|| value["allOf"][0]["$ref"].as_str());
        let table = reference.and_then(|path| schema.pointer(path.trim_start_matches('#')));
        let keys = table.unwrap_or(value)["properties"].as_object()?;
        Some(keys.keys().cloned().collect())
    };
    let top = schema["properties"].as_object().expect("a case is a table");
    top.iter()
        .flat_map(|(name, value)| match properties(value) {
            Some(keys) => keys.iter().map(|key| format!("{name}.{key}")).collect(),
            None => vec![name.clone()],
        })
        .collect()
}

/// Identity of the runs of a case on its specimens.
fn identity(file: &CaseFile, dir: &Path) -> RunKey {
    let inputs = Inputs::new(file, dir, |_| None);
    let source = source_of(&inputs).unwrap();
    let specimens = source.specimens(&inputs, 2).unwrap();
    key_of_runs(&inputs, &*source, specimens.as_ref()).unwrap()
}

/// The default case with all runs on one specimen.
fn case_of_one() -> CaseFile {
    let mut file = CaseFile::default_case();
    file.case.design.microstructure = Microstructure::One;
    file
}

/// Each key of a case is in the identity of runs, or is stated to have no effect on runs. A new key fails this test until
/// its author has decided.
#[test]
fn every_key_of_a_case_is_in_the_identity_of_runs_or_cannot_change_them() {
    let dir = tempfile::tempdir().unwrap();
    let keys = keys_of_cases();
    for key in ["test.steps", "specimen.mesh", "design.seed", "simulator.command"] {
        assert!(keys.iter().any(|known| known == key), "{key}: {keys:?}");
    }
    let covers = |name: &str, key: &str| {
        key.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    let idle = || WITHOUT_EFFECT.iter().flat_map(|(_, names)| *names).copied();
    for file in [CaseFile::default_case(), case_of_one()] {
        let identity = identity(&file, dir.path());
        let mut names: BTreeSet<&str> = identity.names().collect();
        // the content of the mesh file identifies the specimen of runs on one specimen
        let has_mesh = names.remove("mesh.msh");
        assert_ne!(has_mesh, names.contains("specimen"));
        names.insert("specimen");
        // only programs of the user depend on these keys: see `command.rs`
        names.extend(KEYS_OF_RUNS);
        for key in &keys {
            let is_in_identity = names.iter().any(|name| covers(name, key));
            let is_idle = idle().any(|name| covers(name, key));
            assert!(
                is_in_identity != is_idle,
                "{key}: must be in the identity of runs (SIMULATION) or in WITHOUT_EFFECT, and not in both"
            );
        }
    }
    for name in idle() {
        assert!(keys.iter().any(|key| covers(name, key)), "{name} is no key of a case");
    }
}

/// The files that keys name count with their content: tables are read with the case, meshes and images have the files of
/// the stages before.
#[test]
fn the_content_of_the_mesh_identifies_runs_on_one_specimen() {
    let dir = tempfile::tempdir().unwrap();
    let with_mesh = |mesh: &str| {
        std::fs::write(dir.path().join("mesh.msh"), mesh).unwrap();
        identity(&case_of_one(), dir.path())
    };
    assert_eq!(with_mesh("a"), with_mesh("a"));
    assert_ne!(with_mesh("a"), with_mesh("b"));
}

/// The key of simulations does not depend on what the stage has read before, and changes with each of its parts.
#[test]
fn a_key_depends_on_its_parts_alone() {
    let dir = tempfile::tempdir().unwrap();
    let key = |text: &str, mesh: &str, reads_before: bool| {
        std::fs::write(dir.path().join("mesh.msh"), mesh).unwrap();
        let file = CaseFile::parse(text, Path::new("case.toml")).unwrap();
        let inputs = Inputs::new(&file, dir.path(), |_| None);
        if reads_before {
            inputs.calibration();
            inputs.reads_file("absent.csv");
        }
        key_of_simulations(&inputs, &["design"], &["mesh.msh"])
    };
    let plain = key(Case::TEMPLATE, "a mesh", false);
    assert_eq!(key(Case::TEMPLATE, "a mesh", true), plain);
    assert_ne!(key(Case::TEMPLATE, "another mesh", false), plain);
    for (old, new, is_same) in [
        ("poisson = 0.25", "poisson = 0.3", false),
        ("displacement_mm = 0.22", "displacement_mm = 0.2", false),
        ("chains = 4", "chains = 5", true),
    ] {
        let text = Case::TEMPLATE.replacen(old, new, 1);
        assert_ne!(text, Case::TEMPLATE, "{old}");
        assert_eq!(key(&text, "a mesh", false) == plain, is_same, "{old}");
    }
    assert_ne!(plain.with("level = 1 mm\n").folder_name(), plain.folder_name());
}

/// Simulated laboratories have runs on packings also if the runs of the case share one specimen. Another packing means
/// other runs, although the mesh of the case is the same.
#[test]
fn runs_on_packings_depend_on_the_specimen_also_with_one_microstructure() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("mesh.msh"), "a mesh").unwrap();
    let key = |fraction: f64| {
        let mut file = case_of_one();
        file.case.specimen.grains.as_mut().unwrap().fraction = fraction;
        let inputs = Inputs::new(&file, dir.path(), |_| None);
        let packings = Microstructures::with_seeds(&inputs, vec![1, 2]).unwrap();
        key_of_runs(&inputs, &*source_of(&inputs).unwrap(), packings.as_ref()).unwrap()
    };
    assert_eq!(key(0.2), key(0.2));
    assert_ne!(key(0.2), key(0.1));
}

/// Cheaper meshes are made from the segmented image. A key of the mesher, or an edited image, changes their runs, but not
/// the runs on the mesh of the case, whose file is unchanged.
#[test]
fn runs_on_cheaper_meshes_depend_on_everything_from_which_the_meshes_are_made() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("mesh.msh"), "a mesh").unwrap();
    let keys = |elements_across: f64, labels: &str| {
        std::fs::write(dir.path().join("labels.tif"), labels).unwrap();
        let mut file = case_of_one();
        file.case.specimen.elements_across = elements_across;
        let inputs = Inputs::new(&file, dir.path(), |_| None);
        let key = key_of_simulations(&inputs, &["prior", "design"], &["mesh.msh"]);
        let levels = keyed_levels(&inputs, &key, None).unwrap();
        levels.into_iter().map(|level| level.key).collect::<Vec<_>>()
    };
    let plain = keys(3.0, "labels");
    assert_eq!(plain.len(), 2);
    assert_eq!(keys(3.0, "labels"), plain);
    for other in [keys(4.0, "labels"), keys(3.0, "edited labels")] {
        assert_ne!(other[0], plain[0]);
        assert_eq!(other[1], plain[1]);
    }
}

/// Only the cheapest level has derivatives. Its records must not be confused with records without derivatives, if a level
/// is added or removed later.
#[test]
fn runs_without_derivatives_are_other_runs_than_runs_with_derivatives() {
    let dir = tempfile::tempdir().unwrap();
    let finest = |derivatives: bool, has_levels: bool| {
        let mut file = case_of_one();
        file.case.design.derivatives = derivatives;
        if !has_levels {
            file.case.fidelity.levels.clear();
        }
        let inputs = Inputs::new(&file, dir.path(), |_| None);
        let key = key_of_simulations(&inputs, &["design"], &["mesh.msh"]);
        keyed_levels(&inputs, &key, None).unwrap().pop().unwrap().key
    };
    assert_eq!(finest(false, true), finest(false, false));
    assert_ne!(finest(true, true), finest(true, false));
}

/// The supports of a beam are lines across its width. If the user edits the mesh, the mesh file does not follow the case,
/// but the supports do.
#[test]
fn conditions_of_a_kind_of_test_follow_the_size_of_the_block_on_an_edited_mesh() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("mesh.msh"), "an edited mesh").unwrap();
    let key = |width_mm: f64| {
        let text = format!(
            "[specimen]\nblock_mm = [60.0, {width_mm:?}, 10.0]\nspacing_mm = 1.0\n\
             notch = {{ depth_mm = 3.0, width_mm = 1.0 }}\n\
             [material.matrix]\nyoung_mpa = 275.0\npoisson = 0.25\n\
             [test]\nkind = {{ notched-beam = {{ span_mm = 48.0 }} }}\ndisplacement_mm = 0.2\n"
        );
        let file = CaseFile::parse(&text, Path::new("case.toml")).unwrap();
        let inputs = Inputs::new(&file, dir.path(), |_| None);
        key_of_simulations(&inputs, &[], &["mesh.msh"])
    };
    assert_ne!(key(10.0), key(12.0));
}

/// Virtual specimens that share the mesh of the case depend on the mesh file, which the user may edit.
#[test]
fn virtual_specimens_on_the_mesh_of_the_case_depend_on_its_file() {
    let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 };
    let bodies = VirtualBodies::Shared(Box::new(lattice.build().unwrap()));
    assert_eq!(bodies.files(), ["mesh.msh"]);
}
