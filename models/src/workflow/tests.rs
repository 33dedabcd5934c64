//! Tests of the conditions under which stages are run again, reject files, or fail because files are
//! missing.

use std::sync::atomic::AtomicBool;

use super::*;

const CASE: &str = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 1.4\n\
    [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\ndisplacement_mm = 0.2\n\
    [experiments]\ntable = \"specimens.csv\"\n";

fn stage(name: &str) -> &'static Stage {
    Stage::named(name).unwrap()
}

#[test]
fn a_result_that_was_deleted_is_made_again_and_one_that_was_changed_is_not_replaced() {
    let dir = tempfile::tempdir().unwrap();
    let (source, out) = (dir.path().join("case.toml"), dir.path().join("out"));
    let interrupt = AtomicBool::new(false);
    let case = CaseFile::parse(CASE, &source).unwrap();
    let open = |replace: &[PathBuf]| {
        let access = FolderAccess { reuse: false, replace: replace.to_vec() };
        Workflow::open_with(&case, &out, 1, &interrupt, &access).unwrap()
    };
    let workflow = open(&[]);
    workflow.run(stage("mesh")).unwrap();
    assert_eq!(workflow.due(stage("mesh")), None);
    for product in ["mesh.msh", "mesh.vtu", "mesh.png", "mesh_quality.svg", "mesh.csv"] {
        let path = out.join(product);
        let whole = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        assert!(workflow.due(stage("mesh")).unwrap().contains(product));
        workflow.run(stage("mesh")).unwrap();
        assert!(std::fs::read(&path).unwrap() == whole, "{product}");

        let half = &whole[..whole.len() / 2];
        std::fs::write(&path, half).unwrap();
        if product == "mesh.msh" {
            // later stages use an edited mesh without changing it
            assert_eq!(workflow.due(stage("mesh")), None);
            workflow.run(stage("mesh")).unwrap();
        } else {
            assert!(workflow.due(stage("mesh")).unwrap().contains(product));
            let error = workflow.run(stage("mesh")).unwrap_err();
            assert!(matches!(error, WorkflowError::UsersFile { .. }), "{error}");
        }
        assert!(std::fs::read(&path).unwrap() == half, "{product}");
        open(std::slice::from_ref(&path)).run(stage("mesh")).unwrap();
        assert!(std::fs::read(&path).unwrap() == whole, "{product}");
    }
}

/// Opens a results folder of an earlier version of the program, which did not record the files that
/// it wrote.
#[test]
fn a_folder_without_a_record_of_files_is_taken_over_by_its_stages() {
    let dir = tempfile::tempdir().unwrap();
    let (source, out) = (dir.path().join("case.toml"), dir.path().join("out"));
    let interrupt = AtomicBool::new(false);
    let case = CaseFile::parse(CASE, &source).unwrap();
    let open = || Workflow::open(&case, &out, 1, &interrupt);
    open().unwrap().run(stage("mesh")).unwrap();
    std::fs::remove_file(out.join("written.csv")).unwrap();
    std::fs::remove_file(out.join("mesh.vtu")).unwrap();
    open().unwrap().run(stage("mesh")).unwrap();
    assert!(out.join("mesh.vtu").is_file());

    std::fs::remove_file(out.join("written.csv")).unwrap();
    std::fs::write(out.join("mesh.csv"), "of a person").unwrap();
    let error = open().unwrap().run(stage("mesh")).unwrap_err();
    assert!(matches!(error, WorkflowError::UsersFile { .. }), "{error}");
    assert_eq!(std::fs::read_to_string(out.join("mesh.csv")).unwrap(), "of a person");
}

#[test]
fn every_product_belongs_to_one_stage() {
    for stage in STAGES.iter() {
        for product in stage.products {
            let name = product.replace('#', "1").replace('*', "a b");
            assert_eq!(Stage::that_writes(&name), Some(stage.name), "{product}");
        }
    }
    assert!(Stage::that_writes("case.toml").is_none());
}

#[test]
fn the_specimen_table_is_needed_from_the_experiments_on_and_heights_are_in_mm() {
    let dir = tempfile::tempdir().unwrap();
    let (source, out) = (dir.path().join("case.toml"), dir.path().join("out"));
    let interrupt = AtomicBool::new(false);
    let case = CaseFile::parse(CASE, &source).unwrap();
    let workflow = Workflow::open(&case, &out, 1, &interrupt).unwrap();
    workflow.run(stage("mesh")).unwrap();
    let missing = workflow.run(stage("experiments")).unwrap_err().to_string();
    assert!(missing.contains("experiments.table") && missing.contains("no such"), "{missing}");

    std::fs::create_dir(dir.path().join("curves")).unwrap();
    let table = "id,height_mm,radius_mm,group\nS-1,4400,2.5,50C\nS-2,4.4,2.5,50C\n";
    std::fs::write(dir.path().join("specimens.csv"), table).unwrap();
    let curve =
        "displacement_mm,force_N\n0,0\n0.03,48\n0.04,64\n0.05,80\n0.1,140\n0.12,147\n0.14,140\n";
    for (id, peak, elastic, last) in [("S-1", "147", "64", "140"), ("S-2", "149", "65", "138")] {
        let path = dir.path().join(format!("curves/{id}.csv"));
        let forces = curve
            .replace("147", peak)
            .replace("64", elastic)
            .replace("0.14,140", &format!("0.14,{last}"));
        std::fs::write(path, forces).unwrap();
    }
    let workflow = Workflow::open(&case, &out, 1, &interrupt).unwrap();
    let slip = workflow.run(stage("experiments")).unwrap_err().to_string();
    for part in ["specimens.csv", "S-1", "height_mm = 4400", "4.4000 mm", "in mm"] {
        assert!(slip.contains(part), "{part:?} is not in {slip:?}");
    }

    // measured curves are inputs too
    let right = table.replace("4400", "4.4");
    std::fs::write(dir.path().join("specimens.csv"), right).unwrap();
    let workflow = Workflow::open(&case, &out, 1, &interrupt).unwrap();
    workflow.run(stage("experiments")).unwrap();
    assert_eq!(workflow.due(stage("experiments")), None);
    std::fs::write(dir.path().join("curves/S-1.csv"), curve.replace("147", "148")).unwrap();
    let workflow = Workflow::open(&case, &out, 1, &interrupt).unwrap();
    let due = workflow.due(stage("experiments")).unwrap();
    assert!(due.contains("experiments/curves/S-1.csv"), "{due}");
}
