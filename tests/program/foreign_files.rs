//! Files of the user that have the names of products: no command removes or replaces them.

use std::path::Path;

use models::{STAGES, Stage};

use super::{breccia, said};

/// A case for which every stage may write every product: virtual specimens on a virtual scan.
const CASE: &str = r#"
[specimen]
radius_mm = 2.5
height_mm = 4.4
spacing_mm = 1.5
order = 1
grains = { fraction = 0.05, seed = 1, film_mm = 0.5 }
[specimen.scan]
voxel_mm = 0.2
[specimen.image]
[material.matrix]
young_mpa = 275.0
poisson = 0.25
toughness_n_per_mm = 0.0025
viscosity_mpa_s = 0.3
[material.grain]
young_mpa = 22000.0
poisson = 0.25
toughness_n_per_mm = 1.83
viscosity_mpa_s = 0.1
[phase_field]
length_mm = 0.06
[test]
displacement_mm = 0.22
steps = 44
[prior]
matrix.young_mpa = [250.0, 300.0]
[experiments.virtual]
specimens = 2
seed = 3
scans = true
truth = { matrix.young_mpa = 275.0 }
"#;

/// Files that `simulate` writes, an example for each pattern.
const SIMULATION: [&str; 8] = [
    "curve.csv",
    "effort.csv",
    "fields.pvd",
    "fields/step-00002.vtu",
    "fields/last.vtu",
    "damage/step-00002.png",
    "failure.txt",
    "simulate.state",
];

/// Files that `surfaces` writes, an example for each pattern.
const SURFACES: [&str; 2] = ["surfaces/grain-001.stl", "surfaces.csv"];

/// Files that are written when a folder of results is opened, and files with the records of the program.
const OPENING: [&str; 4] = ["case.toml", "origin.toml", "written.csv", "stages.toml"];

const TEXT: &str = "of a person\n";

/// A file name that matches a pattern of products.
fn example(product: &str) -> String {
    product.replace('#', "1").replace('*', "mine")
}

/// A folder with the case, and with files of the user that have these names in `out`.
fn folder_with(names: &[String]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("my.toml"), CASE).unwrap();
    for name in names {
        let path = dir.path().join("out").join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, TEXT).unwrap();
    }
    dir
}

/// All commands that write into a folder of results.
fn commands() -> Vec<Vec<&'static str>> {
    let stage = |stage: &Stage| vec![stage.name, "my.toml", "--out", "out"];
    let others = ["run", "simulate", "surfaces"].map(|name| [name, "my.toml", "--out", "out"]);
    STAGES.iter().map(stage).chain(others.map(Vec::from)).collect()
}

fn assert_unchanged(dir: &Path, names: &[String], what: &str) {
    for name in names {
        let text = std::fs::read_to_string(dir.join("out").join(name));
        assert_eq!(text.ok().as_deref(), Some(TEXT), "{name} after {what}");
    }
}

/// Asserts that the command fails with an error that names the file and the remedies.
fn assert_refused(dir: &Path, command: &[&str], name: &str) {
    let (code, _, err) = said(&breccia(dir, command));
    assert_eq!(code, Some(1), "{command:?} with {name}: {err}");
    let file = Path::new("out").join(name).display().to_string();
    // labels may be the result of much work by hand, so that the advice is not to replace them
    let mend = match name.ends_with("labels.tif") {
        true => "move the file to another place".to_owned(),
        false => format!("--replace {name}"),
    };
    for part in [&*file, "was not written by breccia", "--out", &mend] {
        assert!(err.contains(part), "{command:?} with {name}: {part:?} is not in {err:?}");
    }
}

/// Loops over the table of stages, so that a new product is tested as soon as it is declared.
#[test]
fn a_stage_stops_at_a_file_of_the_users_in_the_place_of_any_product() {
    for stage in STAGES.iter() {
        for product in stage.products {
            let name = example(product);
            let dir = folder_with(std::slice::from_ref(&name));
            for command in [stage.name, "run"] {
                assert_refused(dir.path(), &[command, "my.toml", "--out", "out"], &name);
            }
            if stage.is_shared() {
                let share = [stage.name, "my.toml", "--out", "out", "--share"];
                assert_refused(dir.path(), &share, &name);
            }
            assert_unchanged(dir.path(), &[name], stage.name);
        }
    }
    for name in SIMULATION {
        let dir = folder_with(&[name.to_owned()]);
        assert_refused(dir.path(), &["simulate", "my.toml", "--out", "out"], name);
        assert_unchanged(dir.path(), &[name.to_owned()], "simulate");
    }
    for name in SURFACES {
        let dir = folder_with(&[name.to_owned()]);
        assert_refused(dir.path(), &["surfaces", "my.toml", "--out", "out"], name);
        assert_unchanged(dir.path(), &[name.to_owned()], "surfaces");
    }
}

#[test]
fn no_command_changes_any_file_of_the_users() {
    let products = STAGES.iter().flat_map(|stage| stage.products).map(|product| example(product));
    let names: Vec<String> =
        products.chain(SIMULATION.map(str::to_owned)).chain(SURFACES.map(str::to_owned)).collect();
    let dir = folder_with(&names);
    for command in commands() {
        let (code, _, err) = said(&breccia(dir.path(), &command));
        assert!(code == Some(1) && err.contains("--replace"), "{command:?}: {err}");
        assert_unchanged(dir.path(), &names, command[0]);
    }
    breccia(dir.path(), &["status", "out"]);
    assert_unchanged(dir.path(), &names, "status");

    for name in OPENING {
        let names = [name.to_owned()];
        for command in commands().iter().filter(|command| command[0] != "simulate") {
            let dir = folder_with(&names);
            let (code, _, err) = said(&breccia(dir.path(), command));
            assert!(code == Some(1) && err.contains(name), "{command:?} with {name}: {err}");
            assert_unchanged(dir.path(), &names, command[0]);
        }
    }
}

/// A file whose name is similar to the name of a product does not stop a stage and is not removed.
#[test]
fn a_stage_leaves_other_files_where_they_are() {
    let names =
        ["meshes/notes.txt", "design/notes.txt", "images/2.tif", "curves/mine.csv", "mesh.bak"];
    let names = names.map(str::to_owned);
    let dir = folder_with(&names);
    for stage in ["segment", "mesh"] {
        for _ in 0..2 {
            let command = [stage, "my.toml", "--out", "out"];
            let (code, _, err) = said(&breccia(dir.path(), &command));
            assert_eq!(code, Some(0), "{err}");
            assert_unchanged(dir.path(), &names, stage);
        }
    }
    // a file that `--replace` names is replaced and then counts as written by the program
    let mesh = dir.path().join("out/mesh.csv");
    std::fs::write(&mesh, TEXT).unwrap();
    let command = ["mesh", "my.toml", "--out", "out"];
    let (code, _, err) = said(&breccia(dir.path(), &command));
    assert!(code == Some(1) && err.contains("was changed after breccia wrote it"), "{err}");
    assert_eq!(std::fs::read_to_string(&mesh).unwrap(), TEXT);
    for file in ["gone.csv", "mesh.csv"] {
        let (code, _, err) =
            said(&breccia(dir.path(), &[&command[..], &["--replace", file]].concat()));
        assert_eq!(code, Some(i32::from(file == "gone.csv")), "{err}");
    }
    assert!(std::fs::read_to_string(&mesh).unwrap().starts_with("quantity,value"));
    let (code, _, err) = said(&breccia(dir.path(), &command));
    assert!(code == Some(0) && err.contains("finished before, unchanged"), "{err}");
}

/// Only curves that the case can have count as products. The stage makes its missing products and does not suggest
/// replacing the file.
#[test]
fn a_curve_beyond_the_draws_of_the_case_does_not_stop_its_stage() {
    for (draws, is_refused) in [(2, false), (9, true)] {
        let name = "curves/draw-7.csv".to_owned();
        let dir = folder_with(std::slice::from_ref(&name));
        let case = format!("{CASE}\n[confirm]\ndraws = {draws}\n");
        std::fs::write(dir.path().join("my.toml"), case).unwrap();
        let (code, _, err) = said(&breccia(dir.path(), &["confirm", "my.toml", "--out", "out"]));
        assert_eq!(code, Some(1), "nothing to confirm yet: {err}");
        assert_eq!(err.contains("--replace"), is_refused, "{draws} draws: {err}");
        assert_unchanged(dir.path(), &[name], "confirm");
    }
}

/// Regression: the image of the case is in the place where the stage writes its scan.
#[test]
fn a_folder_with_inputs_in_the_place_of_products_is_refused() {
    let image =
        "[specimen]\nspacing_mm = 0.7\n[specimen.image]\nstack = \"FILE\"\nvoxel_mm = 0.1\n";
    let mesh = "[specimen]\nmesh = \"FILE\"\nregions = { matrix = 1 }\nsurfaces = { bottom = 2, top = 3 }\n";
    let rest =
        "[material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\ndisplacement_mm = 0.2\n";
    let grain = "[material.grain]\nyoung_mpa = 22000\npoisson = 0.25\n";
    for (specimen, file) in
        [(image, "scan.tif"), (image, "images/2-labels.tif"), (mesh, "mesh.msh")]
    {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join(file);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, TEXT).unwrap();
        let grain = if specimen == image { grain } else { "" };
        let case = format!("{}{grain}{rest}", specimen.replace("FILE", file));
        std::fs::write(dir.path().join("case.toml"), &case).unwrap();
        for command in ["segment", "mesh", "run", "simulate"] {
            for extra in [&[][..], &["--replace", file]] {
                let command = [&[command, "case.toml", "--out", "."], extra].concat();
                let (code, _, err) = said(&breccia(dir.path(), &command));
                assert_eq!(code, Some(1), "{command:?}: {err}");
                for part in ["case.toml", file, "is in the results folder", "--out"] {
                    assert!(err.contains(part), "{command:?}: {part:?} is not in {err:?}");
                }
            }
        }
        assert_eq!(std::fs::read_to_string(&path).unwrap(), TEXT);
        assert_eq!(std::fs::read_to_string(dir.path().join("case.toml")).unwrap(), case);
        let entries = std::fs::read_dir(dir.path()).unwrap().count();
        assert_eq!(entries, 2, "nothing is written");
    }

    for id in ["run-001", "map", "baseline", "draw-7"] {
        let dir = tempfile::tempdir().unwrap();
        let (code, _, err) = said(&breccia(dir.path(), &["init", "--own-data", "."]));
        assert_eq!(code, Some(0), "{err}");
        let table = dir.path().join("specimens.csv");
        let text = std::fs::read_to_string(&table).unwrap().replace("S-02", id);
        std::fs::write(&table, text).unwrap();
        let [old, new] = ["S-02", id].map(|id| dir.path().join(format!("curves/{id}.csv")));
        std::fs::rename(old, &new).unwrap();
        let curve = std::fs::read(&new).unwrap();
        for command in ["run", "confirm", "ensemble"] {
            let (code, _, err) = said(&breccia(dir.path(), &[command, "case.toml", "--out", "."]));
            assert!(code == Some(1) && err.contains(&format!("specimen {id}")), "{err}");
        }
        assert!(std::fs::read(&new).unwrap() == curve);
    }
}

#[test]
fn a_case_in_the_folder_of_its_results_is_read_as_it_is_and_never_rewritten() {
    let dir = tempfile::tempdir().unwrap();
    let text = format!("# a comment of a person\n{}", super::SMALL);
    std::fs::write(dir.path().join("case.toml"), &text).unwrap();
    for changed in [text.clone(), text.replace("spacing_mm = 1.5", "spacing_mm = 1.4")] {
        std::fs::write(dir.path().join("case.toml"), &changed).unwrap();
        for command in ["mesh", "report"] {
            let (code, _, err) = said(&breccia(dir.path(), &[command, "case.toml", "--out", "."]));
            assert_eq!(code, Some(0), "{err}");
        }
        assert_eq!(std::fs::read_to_string(dir.path().join("case.toml")).unwrap(), changed);
        let (_, out, err) = said(&breccia(dir.path(), &["status", "."]));
        assert!(
            out.lines().any(|line| line.starts_with("mesh") && line.contains("done")),
            "{out}{err}"
        );
    }
    // an edited copy of another case is not overwritten with the original
    std::fs::write(dir.path().join("my.toml"), super::SMALL).unwrap();
    let mesh = ["mesh", "my.toml", "--out", "out"];
    assert_eq!(said(&breccia(dir.path(), &mesh)).0, Some(0));
    let copy = dir.path().join("out/case.toml");
    let edited =
        std::fs::read_to_string(&copy).unwrap().replace("spacing_mm = 1.5", "spacing_mm = 1.6");
    std::fs::write(&copy, &edited).unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &mesh));
    assert!(code == Some(1) && err.contains("--replace case.toml"), "{err}");
    assert_eq!(std::fs::read_to_string(&copy).unwrap(), edited);
}

#[test]
fn a_study_and_a_script_replace_no_file_of_the_users() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = dir.path().join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    let read = |name: &str| std::fs::read_to_string(dir.path().join(name)).unwrap();
    write("base.toml", &super::SMALL.replace("steps = 4", "steps = 40"));
    let study = "title = \"t\"\nbase = \"base.toml\"\n[[case]]\nname = \"a\"\n";
    write("study.toml", study);
    // the file of the study has the name of a file that a study writes
    for extra in [&[][..], &["--replace", "study.toml"]] {
        let command = [&["study", "study.toml", "--out", "."], extra].concat();
        let (code, _, err) = said(&breccia(dir.path(), &command));
        assert!(code == Some(1) && err.contains("study.toml") && err.contains("--out"), "{err}");
        assert_eq!(read("study.toml"), study);
    }
    for (out, name) in
        [("1", "study.toml"), ("2", "study.csv"), ("3", "report.html"), ("4", "a/mesh.msh")]
    {
        let file = format!("{out}/{name}");
        write(&file, TEXT);
        let (code, _, err) = said(&breccia(dir.path(), &["study", "study.toml", "--out", out]));
        assert!(code == Some(1) && err.contains("was not written by breccia"), "{name}: {err}");
        assert_eq!(read(&file), TEXT);
    }

    write("my.toml", CASE);
    write("job.sh", TEXT);
    let script = ["ensemble", "my.toml", "--out", "out", "--slurm-script", "job.sh"];
    let (code, _, err) = said(&breccia(dir.path(), &script));
    assert!(code == Some(1) && err.contains("job.sh was not written by breccia"), "{err}");
    assert_eq!(read("job.sh"), TEXT);
    let allowed = [&script[..], &["--replace", "job.sh"]].concat();
    for command in [&allowed[..], &script] {
        let (code, _, err) = said(&breccia(dir.path(), command));
        assert_eq!(code, Some(0), "{err}");
    }
    assert!(read("job.sh").starts_with("#!/bin/bash"));
}

/// If the program is killed at any moment, its next run still recognises the files that it wrote: the same command
/// succeeds and gives the same results.
#[test]
fn a_killed_command_knows_its_own_files() {
    let dir = tempfile::tempdir().unwrap();
    let case = super::SMALL.replace("steps = 4", "steps = 30");
    let case = format!("{case}[output]\nfields_every = 5\ncheckpoint_every = 5\n");
    std::fs::write(dir.path().join("my.toml"), case).unwrap();
    for command in ["mesh", "simulate"] {
        let whole = [command, "my.toml", "--out", "whole"];
        let start = std::time::Instant::now();
        assert_eq!(said(&breccia(dir.path(), &whole)).0, Some(0));
        let takes = start.elapsed();
        for part in 1..=12 {
            let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_breccia"))
                .args([command, "my.toml", "--out", "killed"])
                .current_dir(dir.path())
                .stdout(std::process::Stdio::null())
                .stderr(std::process::Stdio::null())
                .spawn()
                .unwrap();
            std::thread::sleep(takes * part / 12);
            child.kill().ok();
            child.wait().unwrap();
        }
        let (code, _, err) = said(&breccia(dir.path(), &[command, "my.toml", "--out", "killed"]));
        assert_eq!(code, Some(0), "{command}: {err}");
        let files: &[&str] = match command {
            "mesh" => &["mesh.msh", "mesh.vtu", "mesh.csv"],
            _ => &["curve.csv", "fields.pvd", "fields/step-00030.vtu"],
        };
        for file in files {
            let [whole, killed] = ["whole", "killed"]
                .map(|out| std::fs::read(dir.path().join(out).join(file)).unwrap());
            assert!(whole == killed, "{file} differs");
        }
    }
}
