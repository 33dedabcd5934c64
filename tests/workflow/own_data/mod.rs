//! Curves that a user has measured, from the shipped example to the posterior, and possible
//! mistakes.

mod refused;
mod verdicts;

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::{breccia, content, copy, copy_with_results, edit, number, record, table};

/// Writes the shipped example to `mine`, with the case and the curves of `coarse_example/`, which runs in seconds.
fn coarse_example(dir: &Path) -> PathBuf {
    let (code, out, err) = breccia(dir, &["init", "--own-data", "mine"]);
    assert!(code == Some(0) && out.contains("breccia run mine/case.toml"), "{out} {err}");
    let coarse = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/workflow/coarse_example");
    let mine = dir.join("mine");
    copy(&coarse, &mine);
    mine
}

/// Reduces the coarse example further.
fn smaller(folder: &Path) {
    let path = folder.join("case.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let changed = text
        .replace("spacing_mm = 1.2", "spacing_mm = 1.5")
        .replace("runs = 24", "runs = 12")
        .replace("max_order = 3", "max_order = 2")
        .replace("draws = 1000 ", "warmup = 200\nchains = 2\ndraws = 200 ")
        .replace("draws = 2 ", "draws = 1 ");
    assert_ne!(changed, text);
    std::fs::write(path, changed).unwrap();
}

/// A folder with the small example in `mine`, finished in `out`.
fn finished() -> tempfile::TempDir {
    static ONCE: OnceLock<tempfile::TempDir> = OnceLock::new();
    let whole = ONCE.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        smaller(&coarse_example(dir.path()));
        let (code, _, err) = breccia(dir.path(), &["run", "mine/case.toml", "--out", "out"]);
        assert_eq!(code, Some(0), "{err}");
        dir
    });
    copy_with_results(whole.path(), "out")
}

/// A curve with every reading changed.
fn readings(text: &str, change: impl Fn(f64, f64) -> (f64, f64)) -> String {
    let line = |line: &str| match line.split_once(',') {
        Some((u, force)) if !line.starts_with(['#', 'd']) => {
            let (u, force) = change(u.parse().unwrap(), force.parse().unwrap());
            format!("{u},{force}\n")
        }
        _ => format!("{line}\n"),
    };
    text.lines().map(line).collect()
}

/// The steps of the README: `init --own-data`, the curves of the user instead of the examples,
/// `run`.
#[test]
fn a_folder_of_curves_becomes_a_posterior() {
    let dir = tempfile::tempdir().unwrap();
    let case = coarse_example(dir.path()).join("case.toml");
    edit(&case, |text| {
        text.replace("runs = 24", "runs = 16").replace("draws = 1000", "draws = 400")
    });
    // four curves of the user replace the five curves of the example
    for k in 1..=5 {
        let path = dir.path().join(format!("mine/curves/S-0{k}.csv"));
        if k < 5 {
            let own = dir.path().join(format!("mine/curves/mix A {k}.csv"));
            let text = std::fs::read_to_string(&path).unwrap();
            std::fs::write(own, readings(&text, |u, f| (u, 1.01 * f))).unwrap();
        }
        std::fs::remove_file(path).unwrap();
    }
    let rows = (1..=4).map(|k| format!("{},2.5,mix A {k},A\n", 4.4 + 0.01 * f64::from(k)));
    let text = format!("height_mm,radius_mm,id,group\n{}", rows.collect::<String>());
    std::fs::write(dir.path().join("mine/specimens.csv"), text).unwrap();

    let (code, out, err) = breccia(dir.path(), &["run", "mine/case.toml", "--out", "out"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(out.contains("matrix.young_mpa") && out.contains("report:"), "{out}");
    assert!(err.contains("mix A 1 is 4.41 mm high"), "{err}");
    assert!(err.contains("the curves begin to carry load at"), "{err}");
    let results = dir.path().join("out");
    assert_eq!(table(&results.join("experiments.csv")).len(), 4);
    let map = table(&results.join("map.csv"));
    // the MAP agrees with the true parameters of the example, within the scatter of specimens and packings
    for (row, [truth, within]) in map.iter().zip([[280.0, 0.12], [0.3, 0.2]]) {
        let map = number(row, "map");
        assert!((map / truth - 1.0).abs() < within, "{row:?}");
    }
    for row in table(&results.join("range.csv")) {
        assert_eq!(row["inside"], "true");
    }
    assert!(results.join("report.html").is_file());
}

#[test]
fn what_is_deleted_is_made_again_and_what_a_person_changed_or_added_stays() {
    let dir = finished();
    let out = dir.path().join("out");
    let zarr = out.join("posterior.zarr");
    let read = |name: &str| std::fs::read(out.join(name)).unwrap();
    let names = ["summary.txt", "mesh.vtu", "curves/run-003.csv", "curve_checks.csv", "range.csv"];
    let whole = names.map(read);
    let group = std::fs::read(zarr.join("zarr.json")).unwrap();
    let run_with = |extra: &[&str]| {
        let command = [&["run", "mine/case.toml", "--out", "out"], extra].concat();
        breccia(dir.path(), &command)
    };
    let run = || run_with(&[]);
    for name in names {
        std::fs::remove_file(out.join(name)).unwrap();
    }
    std::fs::remove_dir_all(&zarr).unwrap();
    let (code, _, err) = run();
    assert_eq!(code, Some(0), "{err}");
    assert!(names.map(read) == whole, "{err}");
    assert!(std::fs::read(zarr.join("zarr.json")).unwrap() == group);
    let (_, _, err) = run();
    assert!(!err.contains("again"), "{err}");

    // files of the user have the names of products, but no stage has to run
    let own = ["curves/run-099.csv", "curves/draw-7.csv", "next-test/notes.txt"];
    let assert_own_files_stay = || {
        for name in own {
            assert_eq!(read(name), b"of a person\n", "{name}");
        }
    };
    std::fs::create_dir_all(out.join("next-test")).unwrap();
    for name in own {
        std::fs::write(out.join(name), "of a person\n").unwrap();
    }
    let (code, _, err) = run();
    assert_eq!(code, Some(0), "{err}");
    assert_own_files_stay();

    // a file that the user has changed is replaced only if `--replace` names it
    for (name, content) in names.iter().zip(&whole) {
        let half = &content[..content.len() / 2];
        std::fs::write(out.join(name), half).unwrap();
        let (code, _, err) = run();
        assert_eq!(code, Some(1), "{err}");
        for part in [*name, "was changed after breccia wrote it", "--replace"] {
            assert!(err.contains(part), "{part:?} is not in {err:?}");
        }
        assert!(read(name) == half, "{name}");
        // no run of this case has the number of the user's file curves/run-099.csv
        let (code, _, err) = run_with(&["--replace", name]);
        assert_eq!(code, Some(0), "{err}");
        assert!(read(name) == *content, "{name}");
        assert_own_files_stay();
    }
    std::fs::write(zarr.join("notes.txt"), "of a person").unwrap();
    let (code, _, err) = run();
    assert!(code == Some(1) && err.contains("posterior.zarr"), "{err}");
    assert!(zarr.join("notes.txt").exists());
    let (code, _, err) = run_with(&["--replace", "posterior.zarr"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(std::fs::read(zarr.join("zarr.json")).unwrap() == group);
    assert!(!zarr.join("notes.txt").exists());

    // with a smaller design, surplus curves of the larger design are removed, but files of the user are kept
    for name in ["curves/run-099.csv", "curves/draw-7.csv"] {
        std::fs::remove_file(out.join(name)).unwrap();
    }
    edit(&dir.path().join("mine/case.toml"), |text| text.replace("runs = 12", "runs = 11"));
    std::fs::write(out.join("curves/run-012.csv"), "of a person\n").unwrap();
    let (code, _, err) = run_with(&["--replace", "curves/run-012.csv"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(out.join("curves/run-011.csv").exists());
    assert_eq!(read("curves/run-012.csv"), b"of a person\n");
    edit(&dir.path().join("mine/case.toml"), |text| text.replace("runs = 11", "runs = 10"));
    let (code, _, err) = run_with(&["--replace", "curves/run-012.csv"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(!out.join("curves/run-011.csv").exists(), "{err}");
}

/// The stages use a mesh and a curve that the user has corrected.
#[test]
fn edited_products_are_used_and_never_replaced() {
    let dir = finished();
    let out = dir.path().join("out");
    let read = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let stage = |name: &str, extra: &[&str]| {
        breccia(dir.path(), &[&[name, "mine/case.toml", "--out", "out"], extra].concat())
    };
    let peaks = || -> Vec<f64> {
        let rows = table(&out.join("experiments.csv"));
        rows.iter().map(|row| number(row, "peak_force_N")).collect()
    };

    // the edited copy of a curve in the results is used instead of the original
    let (before, copy) = (peaks(), "experiments/curves/S-02.csv");
    let whole = read(copy);
    edit(&out.join(copy), |text| readings(text, |u, f| (u, 1.1 * f)));
    let edited = read(copy);
    let (code, _, err) = stage("experiments", &[]);
    assert_eq!(code, Some(0), "{err}");
    for part in [copy, "was edited and is used in place of mine/curves/S-02.csv", "--replace"] {
        assert!(err.contains(part), "{part:?} is not in {err:?}");
    }
    assert!((peaks()[1] / before[1] - 1.1).abs() < 1e-9 && peaks()[0] == before[0]);
    assert_eq!(read(copy), edited);
    let (code, _, err) = stage("experiments", &["--replace", copy]);
    assert_eq!(code, Some(0), "{err}");
    assert!(read(copy) == whole && peaks() == before);

    // with an edited mesh the stage counts as done, even if the case has changed
    let heights = || number(&table(&out.join("experiments.csv"))[0], "displacement_factor");
    let factor = heights();
    let whole = read("mesh.msh");
    let mut mesh = fem::gmsh::read(out.join("mesh.msh"), &fem::gmsh::GmshNames::default()).unwrap();
    mesh.nodes.iter_mut().for_each(|node| node[2] *= 1.02);
    fem::gmsh::write(out.join("mesh.msh"), &mesh).unwrap();
    let edited = read("mesh.msh");
    assert_ne!(edited, whole);
    let (code, _, err) = stage("mesh", &[]);
    assert!(code == Some(0) && err.contains("mesh.msh was edited and is used as it is"), "{err}");
    edit(&dir.path().join("mine/case.toml"), |text| {
        text.replace("spacing_mm = 1.5", "spacing_mm = 1.45")
    });
    for name in ["mesh", "experiments"] {
        let (code, _, err) = stage(name, &[]);
        assert!(
            code == Some(0) && err.contains("mesh.msh was edited and is used as it is"),
            "{err}"
        );
    }
    assert!((heights() / factor - 1.02).abs() < 1e-6, "{} {factor}", heights());
    let (_, told, _) = breccia(dir.path(), &["status", "out"]);
    assert!(told.lines().any(|line| line.starts_with("mesh") && line.contains("done")), "{told}");
    assert_eq!(read("mesh.msh"), edited);
    let (code, _, err) = stage("mesh", &["--replace", "mesh.msh"]);
    assert!(code == Some(0) && err.contains("discards the edit"), "{err}");
    assert_ne!(read("mesh.msh"), edited);
}

#[test]
fn a_folder_belongs_to_one_case_and_a_report_to_one_state_of_it() {
    let dir = finished();
    let case = dir.path().join("mine/case.toml");
    let report = std::fs::read(dir.path().join("out/report.html")).unwrap();

    // a case file with another name and the same content is the same case
    std::fs::copy(&case, dir.path().join("mine/moved.toml")).unwrap();
    for alike in ["mine/moved.toml", "mine/case.toml"] {
        let (code, _, err) = breccia(dir.path(), &["report", alike, "--out", "out"]);
        assert_eq!(code, Some(0), "{err}");
    }
    // a case file with another prior box is another case, and so is a case with other curves
    let other = dir.path().join("mine/other.toml");
    std::fs::copy(&case, &other).unwrap();
    edit(&other, |text| text.replace("[220.0, 340.0]", "[200.0, 340.0]"));
    copy(&dir.path().join("mine"), &dir.path().join("theirs"));
    edit(&dir.path().join("theirs/curves/S-02.csv"), |text| text.replace(".5", ".6"));
    for stranger in ["mine/other.toml", "theirs/case.toml"] {
        for command in ["run", "report", "calibrate", "mesh"] {
            let (code, _, err) = breccia(dir.path(), &[command, stranger, "--out", "out"]);
            assert_eq!(code, Some(1), "{command} {stranger}");
            for part in ["out has the results of another case", "mine", "--out", "--reuse"] {
                assert!(err.contains(part), "{part:?} is not in {err:?}");
            }
        }
    }
    let (code, _, err) = breccia(dir.path(), &["report", "--out", "out"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(std::fs::read(dir.path().join("out/report.html")).unwrap() == report);

    // neither the report nor another stage mixes results of two states of a case
    edit(&case, |text| text.replace("[220.0, 340.0]", "[230.0, 340.0]"));
    for stage in ["report", "surrogate", "confirm"] {
        let (code, _, err) = breccia(dir.path(), &[stage, "mine/case.toml", "--out", "out"]);
        assert_eq!(code, Some(1), "{stage}: {err}");
        for part in ["not up to date", "prior has changed", "run `breccia "] {
            assert!(err.contains(part), "{stage}: {part:?} is not in {err:?}");
        }
    }
    let (code, _, err) =
        breccia(dir.path(), &["experiments", "mine/other.toml", "--out", "out", "--reuse"]);
    assert_eq!(code, Some(0), "{err}");
    let (code, _, err) = breccia(dir.path(), &["ensemble", "mine/other.toml", "--out", "out"]);
    assert_eq!(code, Some(0), "{err}");
    let runs = std::fs::read_to_string(dir.path().join("out/runs.csv")).unwrap();
    assert!(runs.contains("# input,matrix.young_mpa,200.0,340.0"), "{runs}");
}

#[test]
fn a_chain_that_does_not_exist_is_an_error() {
    let dir = finished();
    let path = dir.path().join("out/posterior.csv");
    let whole = content(&path);
    edit(&path, |text| text.replacen("\n1,", "\n1e18,", 1));
    let report = || breccia(dir.path(), &["report", "--out", "out"]);
    let (code, _, err) = report();
    assert!(code == Some(1) && err.contains("posterior.csv"), "{err}");
    // the report is also refused if the recorded checksum hides the change
    edit(&dir.path().join("out/stages.toml"), |text| text.replace(&whole, &content(&path)));
    record(&dir.path().join("out"), "stages.toml");
    std::fs::remove_file(dir.path().join("out/report.html")).unwrap();
    let (code, _, err) = report();
    assert!(code == Some(1) && err.contains("chain = 1e18: is not a chain of this case"), "{err}");
}
