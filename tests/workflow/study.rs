//! A study: several calibrations against the specimens of one laboratory.

use std::process::Command;

use super::{TINY, breccia, browser, finished, number, start, table};

const STUDY: &str = r#"
title = "Two microstructures"
base = "base/tiny.toml"
[[laboratory]]
name = "L"
set.experiments.virtual.seed = 12
[[case]]
name = "second"
laboratory = "L"
set.specimen.grains = { fraction = 0.07, seed = 4, form = "sphere" }
set.design.runs = 14
reference = { map.matrix.young_mpa = 286.181, percent_error = [1.225, 3.101, 9.091] }
[[case]]
name = "first"
laboratory = "L"
# so near to what the coarse mesh makes of the truth that the posterior is cut
set.prior.matrix.young_mpa = [276.0, 326.0]
set.design = { runs = 16, microstructure = "one" }
[[case]]
name = "twin"
laboratory = "L"
set.specimen.grains = { fraction = 0.07, seed = 4, form = "sphere" }
set.design.runs = 14
set.calibration.seed = 8
"#;

/// A case whose grains do not fit into its specimen.
const BROKEN: &str = "[[case]]\nname = \"broken\"\nset.specimen.grains.fraction = 0.49\n";

#[test]
fn cases_share_their_specimens_and_are_compared() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("base")).unwrap();
    std::fs::write(dir.path().join("base/tiny.toml"), TINY).unwrap();
    std::fs::write(dir.path().join("study.toml"), STUDY).unwrap();
    let results = dir.path().join("out");

    // Ctrl-C ends all cases; the same command continues, and a failing case does not stop the other cases
    let study = ["study", "study.toml", "--out", "out"];
    let runs = results.join("runs/ensemble");
    let mut child = start(dir.path(), &study);
    while finished(&runs).len() < 3 {
        assert!(child.try_wait().unwrap().is_none(), "ended before it was interrupted");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    if cfg!(unix) {
        let status = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(status.unwrap().success());
    } else {
        child.kill().unwrap();
    }
    let code = child.wait_with_output().unwrap().status.code();
    assert!(code == Some(130) || cfg!(not(unix)), "{code:?}");
    let kept = finished(&runs);
    let (code, told, err) = breccia(dir.path(), &["status", "out"]);
    assert_eq!(code, Some(3), "{err}");
    let lines: Vec<&str> = told.lines().collect();
    let parts: Vec<&str> = lines.iter().copied().filter(|line| !line.contains(' ')).collect();
    assert_eq!(parts, ["laboratories/L", "second", "first", "twin"], "{told}");
    assert!(lines[1..4].iter().all(|line| line.contains("done")), "{told}");
    std::fs::write(dir.path().join("study.toml"), format!("{STUDY}{BROKEN}")).unwrap();
    let (code, _, err) = breccia(dir.path(), &study);
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("failed broken: ") && err.contains("calibrate second: "), "{err}");
    let now = finished(&runs);
    assert!(kept.iter().all(|(run, time)| now.get(run) == Some(time)), "a run was run again");
    // the report and the table of the study are written without the failed case
    assert!(results.join("twin/report.html").is_file());
    assert_eq!(table(&results.join("study.csv")).len(), 9);
    let page = std::fs::read_to_string(results.join("report.html")).unwrap();
    assert!(page.contains("Cases that could not be calibrated: broken."), "{page}");
    std::fs::write(dir.path().join("study.toml"), STUDY).unwrap();
    let (code, out, err) = breccia(dir.path(), &study);
    assert_eq!(code, Some(0), "{err}");
    assert!(out.contains("study.csv") && out.contains("report.html"), "{out}");

    // two cases share one microstructure and one set of 14 + 1 runs, and the third case has 16 + 1 runs; the additional
    // run has the other quadrature in the middle of the box
    assert_eq!(finished(&runs).len(), 32);
    let [second, twin] = ["second", "twin"].map(|case| results.join(case));
    for name in ["scan.tif", "labels.tif", "mesh.msh", "runs.csv", "curves/run-003.csv"] {
        assert!(same(&second.join(name), &twin.join(name)), "{name}");
    }
    for name in ["posterior.csv", "confirm.csv"] {
        assert!(!same(&second.join(name), &twin.join(name)), "{name}");
    }
    assert_eq!(finished(&second.join("ensemble")).len(), 15, "each folder is complete");

    // the results equal the results of the same case without the study
    let alone = ["run", "out/second/case.toml", "--out", "alone"];
    let (code, _, err) = breccia(dir.path(), &alone);
    assert_eq!(code, Some(0), "{err}");
    for name in ["labels.tif", "surrogate.json", "posterior.csv", "map.csv", "confirm.csv"] {
        assert!(same(&second.join(name), &dir.path().join("alone").join(name)), "{name}");
    }

    // a product that is missing in one folder is restored from the folder of another case
    let before = std::fs::read(twin.join("report.html")).unwrap();
    std::fs::remove_file(twin.join("stages.toml")).unwrap();
    std::fs::remove_dir_all(twin.join("ensemble")).unwrap();
    let (code, _, err) = breccia(dir.path(), &study);
    assert_eq!(code, Some(0), "{err}");
    for stage in ["segment", "mesh", "experiments", "ensemble", "surrogate"] {
        assert!(err.contains(&format!("{stage} twin: as in second")), "{stage}: {err}");
    }
    assert!(err.contains("calibrate twin: 300 draws"), "{err}");
    assert!(std::fs::read(twin.join("report.html")).unwrap() == before);

    // each case has a folder with all files of `run` and the curves of the laboratory
    for case in ["first", "second", "twin"] {
        let file = |name: &str| std::fs::read(results.join(case).join(name)).unwrap();
        let tested = results.join("laboratories/L");
        for curve in ["experiments/curves/V-01.csv", "experiments/curves/V-03.csv"] {
            assert!(file(curve) == std::fs::read(tested.join(curve)).unwrap(), "{case}: {curve}");
        }
        assert!(!file("report.html").is_empty() && !file("confirm.csv").is_empty());
    }
    assert_eq!(table(&results.join("second/runs.csv")).len(), 14);

    // the table has the results of the cases, in the order of the study, and the truth of the laboratory
    let text = std::fs::read_to_string(results.join("study.csv")).unwrap();
    assert!(text.starts_with("case,parameter,map,mean,sd,q05,q95,truth\nsecond,matrix.young_mpa,"));
    let rows = table(&results.join("study.csv"));
    assert_eq!(rows.len(), 9);
    for row in &rows {
        let case = results.join(&row["case"]);
        let of = |file: &str| {
            let rows = table(&case.join(file));
            rows.into_iter().find(|r| r["parameter"] == row["parameter"]).unwrap()
        };
        assert_eq!(number(row, "map"), number(&of("map.csv"), "map"));
        for column in ["mean", "sd", "q05", "q95"] {
            assert_eq!(number(row, column), number(&of("summary.csv"), column), "{column}");
        }
        let truth = [("young", 275.0), ("tough", 0.0025), ("visco", 0.3)];
        let truth = truth.iter().find(|(name, _)| row["parameter"].contains(name)).unwrap().1;
        assert_eq!(number(row, "truth"), truth);
    }

    let page = std::fs::read_to_string(results.join("report.html")).unwrap();
    browser::check_page(&page, 100, 0);
    for part in [
        "Two microstructures",
        "href=\"second/report.html\"",
        "<th>published</th>",
        "286.2",
        "3.10 %",
        "Do the cases agree?",
        "of 9 quantities are within 10 %",
        "extend = [{ runs = 16, prior = { matrix.young_mpa = [226.0, 276.0] } }]",
        "<svg viewBox=",
    ] {
        assert!(page.contains(part), "{part}");
    }

    let now = finished(&runs);
    // the same command again has nothing to do and writes the same bytes; with one more draw, one stage is run again
    let (code, _, err) = breccia(dir.path(), &study);
    assert_eq!(code, Some(0), "{err}");
    assert_eq!(std::fs::read_to_string(results.join("report.html")).unwrap(), page);
    assert_eq!(finished(&runs), now);
    let (code, told, _) = breccia(dir.path(), &["status", "out"]);
    assert_eq!(code, Some(0), "{told}");
    let more_draws = [&study[..], &["--set", "calibration.draws=160"]].concat();
    let (code, _, err) = breccia(dir.path(), &more_draws);
    assert_eq!(code, Some(0), "{err}");
    assert!(err.contains("calibration has changed in the case"), "{err}");
    assert_eq!(finished(&runs), now);

    // the suggested lines are used: the runs of the first batch are used again, and the prior no longer
    // truncates the posterior
    let first = results.join("first/ensemble");
    let batch = finished(&first);
    // including one run that is repeated with the other quadrature in the middle of the box
    assert_eq!(batch.len(), 17);
    let offered = "set.extend = [{ runs = 16, prior = { matrix.young_mpa = [226.0, 276.0] } }]";
    let extended = STUDY.replace("set.design = {", &format!("{offered}\nset.design = {{"));
    std::fs::write(dir.path().join("study.toml"), extended).unwrap();
    let (code, _, err) = breccia(dir.path(), &more_draws);
    assert_eq!(code, Some(0), "{err}");
    let both = finished(&first);
    // the middle of the box has moved, so that another run may be repeated with the other quadrature
    assert!((33..=34).contains(&both.len()), "{}", both.len());
    assert!(batch.iter().all(|(run, time)| both.get(run) == Some(time)), "a run was run again");
    let rows = table(&results.join("first/runs.csv"));
    assert!(rows[..16].iter().all(|row| number(row, "matrix.young_mpa") >= 276.0));
    assert!(rows[16..].iter().all(|row| number(row, "matrix.young_mpa") <= 276.0));
    let page = std::fs::read_to_string(results.join("report.html")).unwrap();
    assert!(!page.contains("the prior truncates the posterior of"), "offered again");
    let before = numbers_of(&text, "first,matrix.young_mpa");
    let text = std::fs::read_to_string(results.join("study.csv")).unwrap();
    let after = numbers_of(&text, "first,matrix.young_mpa");
    assert!(before[3] >= 276.0 && after[3] < 276.0, "wider than the cut one: {before:?} {after:?}");

    assert_a_detached_case_needs_no_study(dir.path());
}

/// Detaches a case of the study in `dir/out`, and deletes the study.
fn assert_a_detached_case_needs_no_study(dir: &std::path::Path) {
    let detach = |case: &str| breccia(dir, &["study", "detach", case, "own"]);
    for case in ["out/laboratories/L", "out", "base"] {
        let (code, _, err) = detach(case);
        assert!(code == Some(1) && err.contains("is not the folder of a case of a study"), "{err}");
        assert!(!dir.join("own").exists());
    }
    let (code, out, err) = detach("out/second");
    assert!(code == Some(0) && out.trim() == "own", "{out} {err}");
    let (code, _, err) = detach("out/second");
    assert!(code == Some(1) && err.contains("own exists"), "{err}");
    for folder in ["out", "base"] {
        std::fs::remove_dir_all(dir.join(folder)).unwrap();
    }
    let (code, told, err) = breccia(dir, &["status", "own"]);
    assert_eq!(code, Some(0), "{told} {err}");

    // with more draws, only the calibration and the stages that read its results are run again
    let own = dir.join("own");
    let text = std::fs::read_to_string(own.join("case.toml")).unwrap();
    let more = text.replace("\ndraws = 160\n", "\ndraws = 170\n");
    assert_ne!(more, text);
    std::fs::write(own.join("case.toml"), more).unwrap();
    let runs = finished(&own.join("ensemble"));
    assert_eq!(runs.len(), 15);
    let (code, _, err) = breccia(dir, &["run", "--out", "own"]);
    assert_eq!(code, Some(0), "{err}");
    for stage in ["segment", "mesh", "experiments", "ensemble", "surrogate"] {
        assert!(err.contains(&format!("{stage} finished before, unchanged")), "{stage}: {err}");
    }
    assert!(err.contains("calibrate again, since calibration has changed in the case"), "{err}");
    assert_eq!(finished(&own.join("ensemble")), runs);
    assert_eq!(table(&own.join("posterior.csv")).len(), 2 * 170);
}

fn same(a: &std::path::Path, b: &std::path::Path) -> bool {
    std::fs::read(a).unwrap() == std::fs::read(b).unwrap()
}

/// The numbers of a line of `study.csv`: map, mean, sd, q05, q95, truth.
fn numbers_of(text: &str, start: &str) -> Vec<f64> {
    let line = text.lines().find(|line| line.starts_with(start)).unwrap();
    line.split(',').filter_map(|cell| cell.parse().ok()).collect()
}

#[test]
fn the_shipped_study_is_the_papers() {
    let path =
        std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../studies/bonded-granular.toml");
    let study = models::StudyFile::read(&path, &[]).unwrap();
    let count = |case: &models::StudyCase| {
        let case = &case.file.case;
        case.design.runs + case.extend.iter().map(|batch| batch.runs).sum::<usize>()
    };
    let runs: Vec<_> =
        study.settings[0].cases.iter().map(|case| (case.name.as_str(), count(case))).collect();
    assert_eq!(
        runs,
        [("M-50-02", 100), ("M-50-03", 200), ("M-50-01", 100), ("M-50-01-Cal90", 100)]
    );
    for case in &study.settings[0].cases {
        let specimens =
            study.settings[0].laboratory(case).unwrap().file.case.experiments.clone().unwrap();
        let count = specimens.virtual_specimens.unwrap().specimens;
        assert_eq!(count, if case.name.ends_with("90") { 4 } else { 8 });
    }
    let mistaken = models::StudyFile::read(&path, &["design.rns=3".to_owned()]).unwrap_err();
    assert!(mistaken.to_string().contains("design.rns"), "{mistaken}");
}
