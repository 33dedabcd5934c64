//! A case with several tests: folders, joint posterior, resume, status and one stage alone.

use std::io::Write as _;

use super::*;

/// Two tests on the tiny mesh.
fn fast_and_slow() -> String {
    let tests = "[[tests]]\nname = \"fast\"\n[[tests]]\nname = \"slow\"\n\
        set.test = { displacement_mm = 0.11, duration_s = 30.0 }\n\
        set.qoi.quantities = [\"slope\", \"peak-force\"]\n[prior]\n";
    let text = without_image().replace("[prior]\n", tests).replace("spacing_mm = 1.25\n", "");
    text.replace("[0.00001, 0.005]", "[0.001, 0.005]")
}

/// Samples the exported joint model with a program that shares no code with this workspace, and compares means and
/// quantiles. Needs a Python with NumPy; otherwise a line says that the check was skipped.
fn assert_same_posterior_in_python(results: &Path) {
    let python = std::env::var("BRECCIA_PYTHON").unwrap_or_else(|_| "python3".into());
    let probe = Command::new(&python).args(["-c", "import numpy"]).output();
    if !probe.is_ok_and(|output| output.status.success()) {
        // written to standard error directly, because the test harness hides the output of a passing test
        let note =
            format!("SKIPPED: {python} has no NumPy; set BRECCIA_PYTHON to a Python with NumPy");
        writeln!(std::io::stderr(), "{note}").expect("stderr is open");
        return;
    }
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/python/two_tests.py");
    let files = ["joint_model.json", "summary.csv"].map(|name| results.join(name));
    let output = Command::new(python).arg(script).args(files).output().expect("starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    let [printed, errors] = [&output.stdout, &output.stderr].map(|bytes| text(bytes));
    assert!(output.status.success(), "{printed}{errors}");
}

#[test]
fn two_tests_are_calibrated_together_in_folders_of_their_own() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("two.toml"), fast_and_slow()).unwrap();
    let run = ["run", "two.toml", "--out", "results", "--threads", "2"];
    let (code, printed, err) = breccia(dir.path(), &run);
    assert_eq!(code, Some(0), "{err}");
    assert!(printed.contains("without_tests.csv"), "{printed}");
    let out = dir.path().join("results");

    // the joint posterior, with the columns of a single calibration
    let header = std::fs::read_to_string(out.join("summary.csv")).unwrap();
    let columns = "parameter,mean,sd,q05,q50,q95,rhat,ess_bulk,ess_tail,contraction";
    assert!(header.starts_with(columns), "{header}");
    let summary = table(&out.join("summary.csv"));
    let names: Vec<&str> = summary.iter().map(|row| row["parameter"].as_str()).collect();
    for name in [
        "matrix.young_mpa",
        "matrix.toughness_n_per_mm",
        "matrix.viscosity_mpa_s",
        "sd[slope (fast)]",
        "sd[peak-force (slow)]",
        "correlation[peak-force slope (slow)]",
    ] {
        assert_eq!(names.iter().filter(|own| **own == name).count(), 1, "{name}: {names:?}");
    }
    assert!(!names.iter().any(|name| name.contains("displacement-at-peak (slow)")), "{names:?}");
    let of = |rows: &[BTreeMap<String, String>], name: &str, column: &str| {
        let row = rows.iter().find(|row| row["parameter"] == name).unwrap();
        number(row, column)
    };
    // a test has the draws of the joint posterior
    let joint = table(&out.join("posterior.csv"));
    for test in ["fast", "slow"] {
        let own = table(&out.join(format!("tests/{test}/posterior.csv")));
        assert_eq!(own.len(), joint.len());
        for (own, joint) in own.iter().zip(&joint) {
            let name = "matrix.toughness_n_per_mm";
            assert!((number(own, name) / number(joint, name) - 1.0).abs() < 1e-6);
        }
        for file in ["confirm.csv", "verdict.csv", "report.html", "loo.csv"] {
            assert!(out.join(format!("tests/{test}/{file}")).is_file(), "{test}/{file}");
        }
        // the shares of the posterior variance refer to all tests
        assert!(!out.join(format!("tests/{test}/uncertainty.csv")).exists(), "{test}");
    }
    // only the slow test has information on the toughness
    let without = table(&out.join("without_tests.csv"));
    assert_eq!(without.len(), 6);
    let without_slow: Vec<_> =
        without.iter().filter(|row| row["without"] == "slow").cloned().collect();
    let name = "matrix.toughness_n_per_mm";
    assert!(of(&without_slow, name, "sd") > of(&summary, name, "sd"));
    let shares = table(&out.join("uncertainty.csv"));
    let of_young: Vec<_> =
        shares.iter().filter(|row| row["parameter"] == "matrix.young_mpa").collect();
    let sum: f64 = of_young.iter().map(|row| number(row, "share")).sum();
    assert!((sum - 1.0).abs() < 1e-9, "{of_young:?}");
    assert!(of_young.iter().any(|row| row["source"] == "slow specimens"), "{of_young:?}");
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    for part in ["Test fast", "Test slow", "What does each test contribute?"] {
        assert!(page.contains(part), "{part}");
    }

    // nothing is computed again
    let before = std::fs::read(out.join("posterior.csv")).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "--out", "results", "--threads", "1"]);
    assert_eq!(code, Some(0), "{err}");
    for line in err.lines().filter(|line| line.contains("calibrate")) {
        assert!(line.contains("finished before"), "{err}");
    }
    assert_eq!(std::fs::read(out.join("posterior.csv")).unwrap(), before);
    let (code, status, _) = breccia(dir.path(), &["status", "results"]);
    assert_eq!(code, Some(0), "{status}");
    for part in ["tests/fast", "tests/slow", "all tests"] {
        assert!(status.contains(part), "{status}");
    }

    // a damaged result and all results that depend on it are restored with the same content
    std::fs::remove_file(out.join("joint/slow.json")).unwrap();
    let (code, status, _) = breccia(dir.path(), &["status", "results"]);
    assert_eq!(code, Some(3), "{status}");
    let (code, _, err) = breccia(dir.path(), &["run", "two.toml", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    assert_eq!(std::fs::read(out.join("posterior.csv")).unwrap(), before);

    // with a modulus of each test, the joint stage runs again and the ensembles do not
    let text = fast_and_slow()
        .replace("[calibration]\n", "[calibration]\nbetween_tests.matrix.young_mpa = \"own\"\n")
        .replace("chains = 2\nwarmup = 150\ndraws = 150", "chains = 4\nwarmup = 400\ndraws = 4000");
    std::fs::write(dir.path().join("two.toml"), text).unwrap();
    let (code, _, err) = breccia(dir.path(), &["calibrate", "two.toml", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    assert!(!err.contains("ensemble"), "{err}");
    let names: Vec<String> =
        table(&out.join("map.csv")).iter().map(|row| row["parameter"].clone()).collect();
    assert!(names.contains(&"matrix.young_mpa (fast)".to_owned()), "{names:?}");
    assert!(names.contains(&"matrix.young_mpa (slow)".to_owned()), "{names:?}");
    assert_same_posterior_in_python(&out);

    // a parameter that is a power of the rate: its values at both rates, and its value in each test
    let text = fast_and_slow().replace(
        "[calibration]\n",
        "[calibration]\nbetween_tests.matrix.young_mpa = { trend = \"rate\" }\n",
    );
    std::fs::write(dir.path().join("two.toml"), text).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "two.toml", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    let joint = table(&out.join("posterior.csv"));
    let ends: Vec<&String> =
        joint[0].keys().filter(|name| name.starts_with("matrix.young_mpa (at ")).collect();
    assert!(ends.len() == 2 && ends.iter().all(|name| name.ends_with(" 1/s)")), "{ends:?}");
    // the two tests are the ends of the trend
    for test in ["fast", "slow"] {
        let own = table(&out.join(format!("tests/{test}/posterior.csv")));
        let is_end = |end: &&String| {
            let pairs = own.iter().zip(&joint);
            let gap = |(own, joint): (&BTreeMap<String, String>, &BTreeMap<String, String>)| {
                (number(own, "matrix.young_mpa") / number(joint, end) - 1.0).abs()
            };
            pairs.map(gap).all(|gap| gap < 1e-6)
        };
        assert_eq!(ends.iter().filter(|end| is_end(end)).count(), 1, "{test}");
    }
    assert_eq!(table(&out.join("sensitivity.csv")).len(), 4);
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("matrix E (MPa), at ") || page.contains("E (MPa), at "), "no label");
}

#[test]
fn commands_of_a_single_test_name_the_folder_of_a_test() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("two.toml"), fast_and_slow()).unwrap();
    for command in ["simulate", "surfaces"] {
        let (code, _, err) = breccia(dir.path(), &[command, "two.toml", "--out", "results"]);
        assert_eq!(code, Some(1), "{err}");
        assert!(err.contains("several tests") && err.contains("tests/fast/case.toml"), "{err}");
    }
    let (code, printed, err) = breccia(dir.path(), &["check", "two.toml"]);
    assert_eq!(code, Some(0), "{err}");
    for part in ["fast, slow", "\nfast\n", "\nslow\n", "all tests together"] {
        assert!(printed.contains(part), "{part}: {printed}");
    }
    let study = "title = \"S\"\nbase = \"two.toml\"\n[[case]]\nname = \"a\"\n";
    std::fs::write(dir.path().join("study.toml"), study).unwrap();
    let (code, _, err) = breccia(dir.path(), &["study", "study.toml", "--out", "study"]);
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("has several tests"), "{err}");
}

/// Measured specimens of both tests in one table: each test uses only its specimens.
#[test]
fn a_table_of_specimens_has_a_column_test() {
    let dir = copy_of_tiny();
    let specimens = dir.path().join("results/experiments");
    let start = TINY.find("[experiments.virtual]").unwrap();
    let end = TINY.find("[calibration]").unwrap();
    let measured = "[experiments]\ntable = \"specimens.csv\"\n";
    let text = format!("{}{measured}{}", &TINY[..start], &TINY[end..]);
    let text = text.replace("[specimen.scan]\nvoxel_mm = 0.125\n[specimen.image]\n", "");
    let tests = "[[tests]]\nname = \"one\"\n[[tests]]\nname = \"two\"\n[prior]\n";
    let text = text.replace("[prior]\n", tests);
    std::fs::write(dir.path().join("two.toml"), text).unwrap();
    copy(&specimens.join("curves"), &dir.path().join("curves"));
    std::fs::copy(dir.path().join("curves/V-01.csv"), dir.path().join("curves/V-04.csv")).unwrap();
    // two specimens cannot have the readings of the same test
    edit(&dir.path().join("curves/V-04.csv"), |text| {
        let (header, rows) = text.split_once('\n').unwrap();
        let scaled = rows.lines().map(|row| {
            let mut cells: Vec<&str> = row.split(',').collect();
            let force_n = 1.01 * cells[1].parse::<f64>().unwrap();
            let force_n = force_n.to_string();
            cells[1] = &force_n;
            cells.join(",") + "\n"
        });
        format!("{header}\n{}", scaled.collect::<String>())
    });
    let row = |id: &str, test: &str| format!("{id},4.4,2.5,50C,{test}\n");
    let rows = [("V-01", "one"), ("V-02", "one"), ("V-03", "two"), ("V-04", "two")];
    let table = |rows: &[(&str, &str)]| {
        let rows: String = rows.iter().map(|(id, test)| row(id, test)).collect();
        format!("id,height_mm,radius_mm,group,test\n{rows}")
    };
    std::fs::write(dir.path().join("specimens.csv"), table(&rows)).unwrap();
    let (code, printed, err) = breccia(dir.path(), &["check", "two.toml"]);
    assert_eq!(code, Some(0), "{err}");
    assert_eq!(printed.matches("2 readable in").count(), 2, "{printed}");
    std::fs::write(dir.path().join("specimens.csv"), table(&rows[..2])).unwrap();
    let (code, _, err) = breccia(dir.path(), &["check", "two.toml"]);
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("two: ") && err.contains("The column test has: one."), "{err}");
}
