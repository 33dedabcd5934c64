//! Curves of a user that are refused, with the reason and the remedy.

use super::*;

/// Runs a changed example in a new folder and returns the printed error; asserts that nothing is simulated.
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
        (|u, f| (-u, f), &["displacements that decrease", "Compression is positive"]),
        (|u, f| (f, u), &["columns are swapped"]),
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
        ("height_mm", "hieght", &["Did you mean the column \"hieght\""]),
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
    // simulations that end before the measured peaks have no peak
    let err = refused(|mine| {
        edit(&mine.join("case.toml"), |text| {
            text.replace("displacement_mm = 0.22", "displacement_mm = 0.05")
        });
    });
    for part in ["mine/curves/S-01.csv: smallest displacement at peak", "test.displacement_mm"] {
        assert!(err.contains(part), "{part:?} is not in {err:?}");
    }
}

/// Units that are wrong by a factor of 4 to 20 are within the range of the closed form of the matrix alone. The first
/// run detects them, before the other runs are made.
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
    // with the unit that the message suggests, the same curves are accepted
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
        "is outside the range of the ensemble",
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
        assert!(told.contains("No parameter is identified"), "{told}");
    }
    let report = read("report.html");
    assert!(report.contains(">data out of range</span>"));
    assert!(!report.contains("identified</span>") && !report.contains("verdict good"));
}
