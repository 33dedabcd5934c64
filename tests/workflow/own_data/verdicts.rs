//! Verdicts and warnings on a user's curves: soft starts, and the error of the mesh.

use super::*;

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
    assert!(
        err.contains("S-05 begins to carry load at") && err.contains("the toe was kept"),
        "{err}"
    );
    assert!((left_in - before - 0.02).abs() < 1e-3, "{left_in} after {before}");
    edit(&dir.path().join("mine/case.toml"), |text| {
        text.replace("toe = \"report\" ", "toe = \"correct\"")
    });
    let (corrected, err) = experiments();
    assert!(err.contains("the toe was removed"), "{err}");
    assert!((corrected - before).abs() < 1e-3, "{corrected}, not {before}");
    let checks = table(&dir.path().join("out/curve_checks.csv"));
    let toes = checks.iter().filter(|row| row["finding"] == "toe");
    let toes: Vec<f64> = toes.map(|row| number(row, "value")).collect();
    assert!(toes.len() == 5 && toes.iter().all(|toe| (toe - 0.02).abs() < 3e-3), "{toes:?}");
}

/// Output of a run, and the contents of its files with warnings and verdicts.
fn said_of(dir: &Path, run: (Option<i32>, String, String)) -> [String; 4] {
    let (code, out, err) = run;
    assert_eq!(code, Some(0), "{err}");
    let read = |name: &str| std::fs::read_to_string(dir.join("out").join(name)).unwrap();
    [out + &err, read("warnings.txt"), read("summary.txt"), read("report.html")]
}

/// The example on a mesh of 1.5 mm: the error of the mesh is far above the width of the posterior and is reported in
/// all places.
#[test]
fn an_error_of_the_mesh_qualifies_the_result_everywhere() {
    let dir = finished();
    // finished stages are not run again, and the summary is printed
    let run = breccia(dir.path(), &["run", "mine/case.toml", "--out", "out"]);
    let said = said_of(dir.path(), run);
    for told in &said {
        assert!(told.contains("The calibrated values are valid for this mesh only"), "{told}");
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

/// A toe of 0.02 mm is a fifth of the displacement at peak. If the toe is not corrected, all reports contain a warning.
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
    for row in table(&dir.path().join("out/verdict.csv")) {
        assert!(row["verdict"].contains("with the toe"), "{row:?}");
    }

    // with the correction there is no warning
    edit(&dir.path().join("mine/case.toml"), |text| {
        text.replace("toe = \"report\" ", "toe = \"correct\"")
    });
    let [_, warnings, ..] = said_of(dir.path(), breccia(dir.path(), &command));
    assert!(!warnings.contains("begins to carry load"), "{warnings}");
}
