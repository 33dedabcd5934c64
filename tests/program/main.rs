//! The `breccia` program as a new user runs it: help, first case, mistakes, one simulation.

mod accepted;
mod check;
mod conditions;
mod devices;
mod divergence;
mod documents;
mod edited_files;
mod foreign_files;
mod images;
mod mesh_files;
mod named_inputs;
mod pipes;
mod schema;
mod surfaces;

use std::path::Path;
use std::process::{Command, Output};

/// A fast case: two regions, a few dozen tetrahedra, an elastic test of one step.
const SMALL: &str = r#"
[specimen]
order = 1
radius_mm = 2.5
height_mm = 4.4
spacing_mm = 1.5
[material.matrix]
young_mpa = 275.0
poisson = 0.25
toughness_n_per_mm = 0.0025
viscosity_mpa_s = 0.3
[phase_field]
length_mm = 0.06
[test]
displacement_mm = 0.2
steps = 4
[prior]
matrix.young_mpa = [250.0, 300.0]
matrix.toughness_n_per_mm = [0.00001, 0.005]
matrix.viscosity_mpa_s = [0.05, 0.55]
[experiments]
virtual = { seed = 3, truth = { matrix.young_mpa = 275.0, matrix.toughness_n_per_mm = 0.0025, matrix.viscosity_mpa_s = 0.3 } }
"#;

fn breccia(folder: &Path, arguments: &[&str]) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_breccia"))
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("cargo has built the program");
    accepted::check_cases(folder, arguments, output.status.success());
    output
}

/// Exit code, stdout and stderr.
fn said(output: &Output) -> (Option<i32>, String, String) {
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn help_teaches_with_an_example_for_every_command() {
    let dir = tempfile::tempdir().unwrap();
    let (code, help, _) = said(&breccia(dir.path(), &["--help"]));
    assert_eq!(code, Some(0));
    let commands = [
        "run",
        "init",
        "check",
        "schema",
        "segment",
        "mesh",
        "simulate",
        "surfaces",
        "experiments",
        "ensemble",
        "surrogate",
        "calibrate",
        "confirm",
        "validate",
        "verdict",
        "next-test",
        "report",
        "study",
        "status",
    ];
    for command in commands {
        assert!(help.contains(&format!("\n  {command} ")), "{command} is not in {help}");
        let (code, own, _) = said(&breccia(dir.path(), &[command, "--help"]));
        assert_eq!(code, Some(0));
        assert!(own.contains(&format!("Example:\n  breccia {command}")), "{own}");
    }
    assert!(help.contains("Examples:") && help.contains("--threads"), "{help}");
}

/// The stage `next-test` was called `design`, like the table of the ensemble.
#[test]
fn the_former_name_of_a_stage_runs_it_and_says_its_present_name() {
    let dir = tempfile::tempdir().unwrap();
    let [(code, _, former), (_, _, present)] =
        ["design", "next-test"].map(|name| said(&breccia(dir.path(), &[name, "none.toml"])));
    let note = "      note the stage design is called next-test now\n";
    assert_eq!(code, Some(1));
    assert_eq!(former, format!("{note}{present}"));
    assert!(present.contains("none.toml"), "{present}");
    let (_, help, _) = said(&breccia(dir.path(), &["--help"]));
    assert!(!help.contains("\n  design "), "{help}");
}

#[test]
fn init_writes_a_case_that_is_valid_and_never_replaces_a_file() {
    let dir = tempfile::tempdir().unwrap();
    let (code, out, _) = said(&breccia(dir.path(), &["init", "my.toml"]));
    assert!(code == Some(0) && out.contains("breccia run my.toml"), "{out}");
    let text = std::fs::read_to_string(dir.path().join("my.toml")).unwrap();
    assert_eq!(text, models::Case::TEMPLATE);
    let (code, _, err) = said(&breccia(dir.path(), &["init", "my.toml"]));
    assert!(code == Some(1) && err.contains("my.toml"), "{err}");
    assert_eq!(std::fs::read_to_string(dir.path().join("my.toml")).unwrap(), text);
}

#[test]
fn init_writes_a_case_for_own_specimens_and_never_replaces_a_file() {
    let dir = tempfile::tempdir().unwrap();
    let (code, out, err) = said(&breccia(dir.path(), &["init", "--own-data", "tests/mine"]));
    assert!(code == Some(0) && out.contains("breccia run tests/mine/case.toml"), "{out} {err}");
    for (name, text) in models::Case::OWN_DATA {
        let written = std::fs::read_to_string(dir.path().join("tests/mine").join(name)).unwrap();
        assert_eq!(written, text);
        let says = text.to_lowercase();
        assert!(says.contains("example") && says.contains("simulation"), "{name} says what it is");
    }
    std::fs::remove_file(dir.path().join("tests/mine/case.toml")).unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["init", "--own-data", "tests/mine"]));
    assert!(code == Some(1) && err.contains("specimens.csv"), "{err}");
    assert!(!dir.path().join("tests/mine/case.toml").exists(), "all or nothing");
}

#[test]
fn mistakes_name_file_key_value_and_help_and_fail() {
    let dir = tempfile::tempdir().unwrap();
    let cylinder = fem::CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 };
    fem::gmsh::write(dir.path().join("cylinder.msh"), &cylinder.build().unwrap()).unwrap();
    let lattice = "radius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 1.5\n";
    let mesh = "mesh = \"cylinder.msh\"\nregions = { matrix = \"matrix\", grain = \"grain\" }\n\
                surfaces = { bottom = \"bottom\", top = \"top\" }\n";
    let changes: &[(&str, String, &[&str])] = &[
        (
            "spacing_mm",
            "spacing".into(),
            &["specimen.spacing = 1.5", "unknown key", "\"spacing_mm\""],
        ),
        ("radius_mm = 2.5", "radius_mm = -2.5".into(), &["specimen.radius_mm = -2.5", "mm"]),
        ("young_mpa = 275.0", "young_mpa = 275e6".into(), &["material.matrix.young_mpa", "MPa"]),
        (
            "young_mpa = 275.0",
            "young_mpa = \"stiff\"".into(),
            &["material.matrix.young_mpa = \"stiff\""],
        ),
        ("poisson = 0.25", String::new(), &["material.matrix.poisson", "is missing", "Add it."]),
        (
            "[material.matrix]",
            "[material.matrx]".into(),
            &["material.matrix", "Did you mean material.matrx"],
        ),
        ("[test]", "[tset]".into(), &["unknown key \"tset\"", "mean \"test\""]),
        ("steps = 4", "steps = -4".into(), &["test.steps = -4"]),
        (
            "[250.0, 300.0]",
            "[300.0, 250.0]".into(),
            &["prior.matrix.young_mpa = [300.0, 250.0]", "[lower, upper]"],
        ),
        (
            lattice,
            "mesh = \"gone.msh\"\nregions = { matrix = 1 }\n".into(),
            &["specimen.mesh = gone.msh", "no such file"],
        ),
        (
            lattice,
            format!("{mesh}[material.grain]\nyoung_mpa = 22000.0\npoisson = 0.25\n"),
            &["cylinder.msh", "grain"],
        ),
    ];
    for (from, to, parts) in changes {
        assert!(SMALL.contains(from), "{from}");
        let mut case = SMALL.replacen(from, to, 1);
        if to.contains("mesh") {
            // a mesh file cannot have virtual specimens
            case.truncate(case.find("[experiments]").unwrap());
        }
        std::fs::write(dir.path().join("case.toml"), case).unwrap();
        let (code, _, err) = said(&breccia(dir.path(), &["simulate", "case.toml", "--out", "out"]));
        assert_eq!(code, Some(1), "{from} -> {to}: {err}");
        for part in *parts {
            assert!(err.contains(part), "{part:?} is not in {err:?}");
        }
        assert!(err.contains("case.toml") || err.contains("cylinder.msh"), "{err}");
    }
}

#[test]
fn a_wrong_command_line_and_a_missing_case_fail() {
    let dir = tempfile::tempdir().unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["simulte"]));
    assert!(code == Some(2) && err.contains("simulate"), "{err}");
    let (code, _, err) = said(&breccia(dir.path(), &["run", "gone.toml"]));
    assert!(code == Some(1) && err.contains("gone.toml") && err.contains("breccia init"), "{err}");
    for command in ["my.toml", "./cases/my.toml"] {
        let (code, _, err) = said(&breccia(dir.path(), &[command]));
        let hint = format!("did you mean `breccia run {command}`?");
        assert!(code == Some(2) && err.contains(&hint), "{err}");
    }
    let (code, _, _) = said(&breccia(dir.path(), &["run", "--threads", "0"]));
    assert_eq!(code, Some(2));
}

#[test]
fn a_stage_out_of_order_says_which_comes_first() {
    let dir = tempfile::tempdir().unwrap();
    let case = SMALL.replace("steps = 4", "steps = 40");
    std::fs::write(dir.path().join("case.toml"), case).unwrap();
    for (stage, first) in
        [("ensemble", "mesh"), ("surrogate", "ensemble"), ("calibrate", "surrogate")]
    {
        let (code, _, err) = said(&breccia(dir.path(), &[stage, "case.toml", "--out", "out"]));
        assert!(
            code == Some(1) && err.contains(&format!("`breccia {first}` first")),
            "{stage}: {err}"
        );
    }
}

#[test]
fn simulate_writes_a_curve_in_the_documented_columns() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("case.toml"), SMALL).unwrap();
    let (code, out, err) = said(&breccia(dir.path(), &["simulate", "case.toml", "--out", "try"]));
    assert_eq!(code, Some(0), "{err}");
    // a lattice of 1.5 mm does not resolve cracks of 0.06 mm, and a note reports this
    assert!(err.contains("mm apart, cracks 0.06 mm wide"), "{err}");
    assert_eq!(Path::new(out.trim()), Path::new("try").join("curve.csv"));
    let text = std::fs::read_to_string(dir.path().join("try/curve.csv")).unwrap();
    let header = "time_s,displacement_mm,force_N,elastic_N_mm,fracture_N_mm,viscous_N_mm,phi_mean,phi_max,newton,linear";
    assert!(text.starts_with(header), "{text}");
    let rows: Vec<Vec<f64>> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
        .collect();
    assert_eq!(rows.len(), 4);
    for (i, row) in rows.iter().enumerate() {
        let part = (i + 1) as f64 / 4.0;
        approx::assert_relative_eq!(row[0], part, max_relative = 1e-12);
        approx::assert_relative_eq!(row[1], 0.2 * part, max_relative = 1e-12);
        assert!(row[2] > 0.0, "compression is positive");
        assert!((0.0..1.0).contains(&row[6]) && (0.0..1.0).contains(&row[7]));
        assert!(row[8] >= 1.0 && row[9] >= 1.0, "Newton and linear iterations");
    }
    let collection = std::fs::read_to_string(dir.path().join("try/fields.pvd")).unwrap();
    for step in 1..=4 {
        let name = format!("fields/step-{step:05}.vtu");
        assert!(collection.contains(&format!("file=\"{name}\"")), "{collection}");
        let fields = std::fs::read_to_string(dir.path().join("try").join(name)).unwrap();
        assert!(fields.contains("displacement_mm") && fields.contains("damage"));
    }
    assert!(!dir.path().join("try/simulate.state").exists(), "a finished run leaves no state");
}

#[test]
fn a_killed_simulation_continues_to_the_identical_curve() {
    let dir = tempfile::tempdir().unwrap();
    let case = SMALL.replace("steps = 4", "steps = 60");
    let case = format!("{case}[output]\nfields_every = 20\ncheckpoint_every = 5\n");
    std::fs::write(dir.path().join("case.toml"), case).unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["simulate", "case.toml", "--out", "whole"]));
    assert_eq!(code, Some(0), "{err}");
    let mut child = Command::new(env!("CARGO_BIN_EXE_breccia"))
        .args(["simulate", "case.toml", "--out", "killed"])
        .current_dir(dir.path())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    // killed as soon as the state has been saved; if the run has ended before, its results are complete
    let state = dir.path().join("killed/simulate.state");
    while !state.exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    child.kill().ok();
    child.wait().unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["simulate", "case.toml", "--out", "killed"]));
    assert_eq!(code, Some(0), "{err}");
    for file in ["curve.csv", "fields.pvd", "fields/step-00060.vtu"] {
        let [whole, killed] =
            ["whole", "killed"].map(|out| std::fs::read(dir.path().join(out).join(file)).unwrap());
        assert!(whole == killed, "{file} differs");
    }
}

/// A misspelt results folder is not created.
#[test]
fn a_stage_that_needs_results_makes_no_folder() {
    let dir = tempfile::tempdir().unwrap();
    for stage in ["report", "calibrate", "next-test"] {
        let (code, _, err) = said(&breccia(dir.path(), &[stage, "--out", "typo"]));
        assert_eq!(code, Some(1), "{err}");
        assert!(err.contains("typo is not a results folder: there is no such folder"), "{err}");
        assert!(!dir.path().join("typo").exists(), "{stage}");
    }
    // a folder in which nothing has been run has no results to report
    std::fs::create_dir(dir.path().join("empty")).unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["report", "--out", "empty"]));
    assert!(code == Some(1) && err.contains("no stage has been run there"), "{err}");
    assert_eq!(std::fs::read_dir(dir.path().join("empty")).unwrap().count(), 0);
}
