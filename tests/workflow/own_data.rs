//! A person's own curves, from the shipped example to the posterior, and what can go wrong on the way.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::{breccia, content, copy, copy_with_results, edit, number, record, table};

/// The shipped example in `mine`, with the case and the curves of `coarse_example/`: a case of seconds.
fn coarse_example(dir: &Path) -> PathBuf {
    let (code, out, err) = breccia(dir, &["init", "--own-data", "mine"]);
    assert!(code == Some(0) && out.contains("breccia run mine/case.toml"), "{out} {err}");
    let coarse = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/workflow/coarse_example");
    let mine = dir.join("mine");
    copy(&coarse, &mine);
    mine
}

/// The coarse example, smaller still.
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

/// The way of the README: `init --own-data`, own curves in place of the examples, `run`.
#[test]
fn a_folder_of_curves_becomes_a_posterior() {
    let dir = tempfile::tempdir().unwrap();
    coarse_example(dir.path());
    // a person's four curves take the place of the five
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
    // what the examples were simulated with, within their scatter and that of the packings
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

    // a person's own curves have names of products, and nothing is due
    let own = ["curves/run-099.csv", "curves/draw-7.csv", "design/notes.txt"];
    let assert_own_files_stay = || {
        for name in own {
            assert_eq!(read(name), b"of a person\n", "{name}");
        }
    };
    std::fs::create_dir_all(out.join("design")).unwrap();
    for name in own {
        std::fs::write(out.join(name), "of a person\n").unwrap();
    }
    let (code, _, err) = run();
    assert_eq!(code, Some(0), "{err}");
    assert_own_files_stay();

    // what a person has changed is not replaced before that is allowed by its name
    for (name, content) in names.iter().zip(&whole) {
        let half = &content[..content.len() / 2];
        std::fs::write(out.join(name), half).unwrap();
        let (code, _, err) = run();
        assert_eq!(code, Some(1), "{err}");
        for part in [*name, "was changed after breccia wrote it", "--replace"] {
            assert!(err.contains(part), "{part:?} is not in {err:?}");
        }
        assert!(read(name) == half, "{name}");
        let mut allowed = vec!["--replace", name];
        // the stage would write files of this name too
        if name.starts_with("curves/") {
            let (code, _, err) = run_with(&allowed);
            assert!(code == Some(1) && err.contains("curves/run-099.csv"), "{err}");
            allowed.extend(["--replace", "curves/run-099.csv"]);
        }
        let (code, _, err) = run_with(&allowed);
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

    // a smaller design leaves no curves of the larger one, but those of a person
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

/// A person's corrections of a mesh and of a curve, which the following stages use.
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

    // a curve: its copy in the results is used in place of the original
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

    // the mesh: the stage counts as done, whatever has changed in the case
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
    assert!(code == Some(0) && err.contains("gives up what was edited"), "{err}");
    assert_ne!(read("mesh.msh"), edited);
}

#[test]
fn a_folder_belongs_to_one_case_and_a_report_to_one_state_of_it() {
    let dir = finished();
    let case = dir.path().join("mine/case.toml");
    let report = std::fs::read(dir.path().join("out/report.html")).unwrap();

    // another file with the same case is the same case
    std::fs::copy(&case, dir.path().join("mine/moved.toml")).unwrap();
    for alike in ["mine/moved.toml", "mine/case.toml"] {
        let (code, _, err) = breccia(dir.path(), &["report", alike, "--out", "out"]);
        assert_eq!(code, Some(0), "{err}");
    }
    // another file with another box is another case, and so is one with other curves
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

    // a report does not mix the numbers of two states of a case, nor does any other stage
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
    let (code, _, err) = breccia(dir.path(), &["run", "mine/other.toml", "--out", "out"]);
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
    // the same where nobody notices the change
    edit(&dir.path().join("out/stages.toml"), |text| text.replace(&whole, &content(&path)));
    record(&dir.path().join("out"), "stages.toml");
    std::fs::remove_file(dir.path().join("out/report.html")).unwrap();
    let (code, _, err) = report();
    assert!(code == Some(1) && err.contains("chain = 1e18: is no chain of this case"), "{err}");
}

/// What the program says of a changed example, run into a new folder; nothing is simulated.
fn refused(change: impl Fn(&Path)) -> String {
    let dir = tempfile::tempdir().unwrap();
    smaller(&coarse_example(dir.path()));
    change(&dir.path().join("mine"));
    let (code, _, err) = breccia(dir.path(), &["run", "mine/case.toml", "--out", "out"]);
    assert_eq!(code, Some(1), "{err}");
    assert!(!dir.path().join("out/ensemble").exists(), "refused after the ensemble: {err}");
    let error = err.lines().find(|line| line.starts_with("error: ")).unwrap_or_default();
    assert!(!error.contains("out/"), "not the person's own file: {error}");
    err
}

#[test]
fn specimens_that_cannot_be_meant_are_refused_before_the_ensemble_by_the_persons_own_file() {
    type Change = fn(f64, f64) -> (f64, f64);
    let curves: [(Change, &[&str]); 7] = [
        (|u, f| (u, 1e-3 * f), &["peak_force_N", "Is the force in kN?", "force_unit = \"kN\""]),
        (|u, f| (1e-3 * u, f), &["Is displacement in m?", "displacement_unit = \"m\""]),
        (|u, f| (-u, f), &["displacements that fall", "Compression is positive"]),
        (|u, f| (f, u), &["columns swapped"]),
        (|u, f| (u, if (60.0..70.0).contains(&f) { 400.0 } else { f }), &["single reading"]),
        (|u, f| (u, if u > 0.05 { 200.0 + u } else { f }), &["no peak"]),
        (|u, f| (u, f - 20.0), &["in tension", "load cell was not zeroed", "zero_force = true"]),
    ];
    for (change, parts) in curves {
        let err = refused(|mine| {
            edit(&mine.join("curves/S-03.csv"), |text| readings(text, change));
        });
        for part in ["error: mine/curves/S-03.csv: "].iter().chain(parts) {
            assert!(err.contains(part), "{part:?} is not in {err:?}");
        }
    }
    let err = refused(|mine| {
        edit(&mine.join("specimens.csv"), |text| {
            text.replace("S-05,4.4,2.5,50C", "S-05,4.4,2.5,90C")
        });
    });
    for part in [
        "error: mine/case.toml: experiments.group: is missing",
        "\"50C\" (4 specimens), \"90C\" (1 specimens)",
        "group = \"50C\"",
    ] {
        assert!(err.contains(part), "{part:?} is not in {err:?}");
    }
    let tables: [(&str, &str, &[&str]); 4] = [
        ("S-02,4.4,", "S-02,0.44,", &["specimen S-02, column height_mm = 0.44", "in mm"]),
        ("S-02,4.4,2.5", "S-02,4.4,5.0", &["specimen S-02, column radius_mm = 5", "in mm"]),
        (
            "S-02,4.4,2.5,50C\nS-03,4.4,2.5,50C\nS-04,4.4,2.5,50C\nS-05,4.4,2.5,50C\n",
            "",
            &["specimen = S-01", "at least two"],
        ),
        ("height_mm", "hieght", &["\"hieght\" meant"]),
    ];
    for (from, to, parts) in tables {
        let err = refused(|mine| edit(&mine.join("specimens.csv"), |text| text.replace(from, to)));
        for part in ["error: mine/specimens.csv: "].iter().chain(parts) {
            assert!(err.contains(part), "{part:?} is not in {err:?}");
        }
    }
    let err = refused(|mine| {
        edit(&mine.join("case.toml"), |text| text.replace("steps = 44", "steps = 1"));
    });
    assert!(err.contains("mine/case.toml: test.steps = 1"), "{err}");
}

/// Units that are wrong by a factor of 4 to 20 are within what a closed form of the matrix alone allows: the first run
/// shows them, before the others are made.
#[test]
fn units_that_are_off_by_a_small_factor_are_refused_after_the_first_run() {
    type Change = fn(f64, f64) -> (f64, f64);
    let units: [(Change, &str); 4] = [
        (|u, f| (u, f / 9.806_65), "force_unit = \"kgf\""),
        (|u, f| (u, f / 4.448_222), "force_unit = \"lbf\""),
        (|u, f| (u, f / (std::f64::consts::PI * 6.25)), "force_unit = \"MPa\""),
        (|u, f| (u / 4.4, f), "displacement_unit = \"1\""),
    ];
    let dir = tempfile::tempdir().unwrap();
    smaller(&coarse_example(dir.path()));
    let curve = |k: usize| dir.path().join(format!("mine/curves/S-0{k}.csv"));
    let whole: Vec<String> = (1..=5).map(|k| std::fs::read_to_string(curve(k)).unwrap()).collect();
    let run = ["run", "mine/case.toml", "--out", "out", "--threads", "1"];
    for (change, unit) in units {
        for (k, text) in (1..).zip(&whole) {
            std::fs::write(curve(k), readings(text, change)).unwrap();
        }
        let (code, _, err) = breccia(dir.path(), &run);
        assert_eq!(code, Some(1), "{err}");
        for part in ["error: mine/specimens.csv: mean of ", "over the box of [prior]", unit] {
            assert!(err.contains(part), "{part:?} is not in {err:?}");
        }
        let is_record = |path: &Path| {
            let name = path.file_name().unwrap().to_string_lossy().into_owned();
            name.starts_with("run-") && name.ends_with(".json")
        };
        let records = |folder: &Path| -> usize {
            let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
            entries.filter(|path| is_record(path.as_path())).count()
        };
        let ensembles = std::fs::read_dir(dir.path().join("out/ensemble")).unwrap();
        let made: usize = ensembles.map(|entry| records(&entry.unwrap().path())).sum();
        assert_eq!(made, 1, "runs were made: {err}");
    }
    // the unit that the message names mends it: the same curves, read as they are meant
    for (k, text) in (1..).zip(&whole) {
        std::fs::write(curve(k), readings(text, |u, f| (u, f / 4.448_222))).unwrap();
    }
    edit(&dir.path().join("mine/case.toml"), |text| {
        text.replace("[calibration]", "[experiments.read]\nforce_unit = \"lbf\"\n\n[calibration]")
    });
    let ensemble = ["ensemble", "mine/case.toml", "--out", "out"];
    let (code, _, err) =
        breccia(dir.path(), &["experiments", ensemble[1], ensemble[2], ensemble[3]]);
    assert_eq!(code, Some(0), "{err}");
    let (code, _, err) = breccia(dir.path(), &ensemble);
    assert_eq!(code, Some(0), "{err}");
}

#[test]
fn a_folder_of_results_without_its_case_names_the_case_that_it_was_made_from() {
    let dir = finished();
    std::fs::remove_file(dir.path().join("out/case.toml")).unwrap();
    for command in ["report", "calibrate", "run"] {
        let (code, _, err) = breccia(dir.path(), &[command, "--out", "out"]);
        assert_eq!(code, Some(1), "{err}");
        let error = Path::new("out").join("case.toml").display().to_string();
        assert!(err.contains(&format!("error: {error}: is missing")), "{err}");
        assert!(err.contains("mine/case.toml") && !err.contains("another case"), "{err}");
    }
    let (code, _, err) = breccia(dir.path(), &["report", "mine/case.toml", "--out", "out"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(dir.path().join("out/case.toml").is_file());
}

#[test]
fn soft_starts_are_told_and_taken_away_on_request() {
    let dir = finished();
    for k in 1..=5 {
        edit(&dir.path().join(format!("mine/curves/S-0{k}.csv")), |text| {
            readings(text, |u, f| (u + 0.02 * (1.0 - (-u.max(0.0) / 0.004).exp()), f))
        });
    }
    let experiments = || {
        let (code, _, err) =
            breccia(dir.path(), &["experiments", "mine/case.toml", "--out", "out"]);
        assert_eq!(code, Some(0), "{err}");
        let rows = table(&dir.path().join("out/experiments.csv"));
        let mean = rows.iter().map(|row| number(row, "displacement_at_peak_mm")).sum::<f64>() / 5.0;
        (mean, err)
    };
    let before = table(&dir.path().join("out/experiments.csv"));
    let before: f64 =
        before.iter().map(|row| number(row, "displacement_at_peak_mm")).sum::<f64>() / 5.0;
    let (left_in, err) = experiments();
    assert!(err.contains("S-05 begins to carry load at") && err.contains("left in"), "{err}");
    assert!((left_in - before - 0.02).abs() < 1e-3, "{left_in} after {before}");
    edit(&dir.path().join("mine/case.toml"), |text| {
        text.replace("toe = \"report\" ", "toe = \"correct\"")
    });
    let (corrected, err) = experiments();
    assert!(err.contains("taken away"), "{err}");
    assert!((corrected - before).abs() < 1e-3, "{corrected}, not {before}");
    let checks = table(&dir.path().join("out/curve_checks.csv"));
    let toes = checks.iter().filter(|row| row["finding"] == "toe");
    let toes: Vec<f64> = toes.map(|row| number(row, "value")).collect();
    assert!(toes.len() == 5 && toes.iter().all(|toe| (toe - 0.02).abs() < 3e-3), "{toes:?}");
}

/// What a run prints, and its files that say what to think of the result.
fn said_of(dir: &Path, run: (Option<i32>, String, String)) -> [String; 4] {
    let (code, out, err) = run;
    assert_eq!(code, Some(0), "{err}");
    let read = |name: &str| std::fs::read_to_string(dir.join("out").join(name)).unwrap();
    [out + &err, read("warnings.txt"), read("summary.txt"), read("report.html")]
}

/// The example on a mesh of 1.5 mm: its error is far above the width of the posterior, and is said everywhere.
#[test]
fn an_error_of_the_mesh_qualifies_the_result_everywhere() {
    let dir = finished();
    // what is finished is not run again, and its summary is printed
    let run = breccia(dir.path(), &["run", "mine/case.toml", "--out", "out"]);
    let said = said_of(dir.path(), run);
    for told in &said {
        assert!(told.contains("The calibrated values are those on this mesh"), "{told}");
        assert!(!told.contains("Nothing wrong") && !told.contains("No stage has warned"), "{told}");
    }
    let [_, _, summary, report] = said;
    let slope = &table(&dir.path().join("out/confirm.csv"))[0];
    assert!(number(slope, "mesh_error_percent").abs() > 2.0, "{slope:?}");
    assert!(summary.contains("matrix.young_mpa") && summary.contains("identified on this mesh"));
    assert!(report.contains("<span class=\"verdict weak\">identified on this mesh"), "{summary}");
    assert!(!report.contains("verdict good"));
    for row in table(&dir.path().join("out/verdict.csv")) {
        assert!(row["verdict"].contains("on this mesh"), "{row:?}");
    }
}

/// A toe of 0.02 mm is a fifth of the displacement at peak: left in, it is a warning in every place.
#[test]
fn a_toe_that_is_left_in_is_a_warning() {
    let dir = finished();
    for k in 1..=5 {
        edit(&dir.path().join(format!("mine/curves/S-0{k}.csv")), |text| {
            readings(text, |u, f| (u + 0.02 * (1.0 - (-u.max(0.0) / 0.004).exp()), f))
        });
    }
    let command = ["run", "mine/case.toml", "--out", "out", "--accept-out-of-range"];
    let said = said_of(dir.path(), breccia(dir.path(), &command));
    for told in &said {
        assert!(told.contains("S-01 begins to carry load at 0.01"), "{told}");
        assert!(!told.contains("Nothing wrong was found"), "{told}");
    }
    assert!(!said[3].contains("verdict good") && !said[3].contains(">identified</span>"));

    // corrected, there is nothing to warn of
    edit(&dir.path().join("mine/case.toml"), |text| {
        text.replace("toe = \"report\" ", "toe = \"correct\"")
    });
    let [_, warnings, ..] = said_of(dir.path(), breccia(dir.path(), &command));
    assert!(!warnings.contains("begins to carry load"), "{warnings}");
}

#[test]
fn data_that_no_simulation_reaches_stop_the_calibration_unless_accepted() {
    let dir = finished();
    let out = dir.path().join("out");
    let summary = std::fs::read_to_string(out.join("summary.txt")).unwrap();
    assert!(!summary.contains("out of range"), "{summary}");
    for k in 1..=5 {
        edit(&dir.path().join(format!("mine/curves/S-0{k}.csv")), |text| {
            readings(text, |u, f| (u, 1.6 * f))
        });
    }
    let run = |extra: &[&str]| {
        let command = [&["run", "mine/case.toml", "--out", "out"], extra].concat();
        breccia(dir.path(), &command)
    };
    let (code, _, err) = run(&[]);
    assert_eq!(code, Some(1), "{err}");
    for part in [
        "error: mine/specimens.csv: mean of ",
        "_N",
        "over 5 specimens = ",
        "lies outside what the ensemble reaches",
        "widen the box of [prior]",
        "--accept-out-of-range",
    ] {
        assert!(err.contains(part), "{part:?} is not in {err:?}");
    }
    let (code, text, err) = run(&["--accept-out-of-range"]);
    assert_eq!(code, Some(0), "{err}");
    let read = |name: &str| std::fs::read_to_string(PathBuf::from(&out).join(name)).unwrap();
    for told in [&err, &text, &read("warnings.txt"), &read("summary.txt"), &read("report.html")] {
        assert!(told.contains("Data out of range: the experimental mean of"), "{told}");
        assert!(told.contains("Nothing here is identified"), "{told}");
    }
    let report = read("report.html");
    assert!(report.contains(">data out of range</span>"));
    assert!(!report.contains("identified</span>") && !report.contains("verdict good"));
}
