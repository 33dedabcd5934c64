//! Runs of a program that are shared by processes and studies, extended, or curves.

use super::super::{breccia, number, start, table};
use super::{CASE, SOLVER, check_posterior, folder, row_of, run, solved};

/// Several processes share the runs: each run is made once. A study of two priors makes the runs of each case.
#[test]
fn processes_and_studies_share_the_runs_of_a_program() {
    let dir = folder(CASE, &format!("sleep 0.1\n{SOLVER}"));
    let share = ["ensemble", "bar.toml", "--out", "results", "--threads", "1", "--share"];
    let both = [0; 2].map(|_| start(dir.path(), &share));
    for process in both {
        let output = process.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    assert_eq!((1..=10).map(|run| solved(dir.path(), run)).collect::<Vec<_>>(), [1; 10]);
    let (code, _, err) = breccia(dir.path(), &["ensemble", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    assert_eq!((1..=10).map(|run| solved(dir.path(), run)).sum::<usize>(), 10);

    let dir = folder(CASE, SOLVER);
    let study = "title = \"Two seeds\"\nbase = \"bar.toml\"\n[[case]]\nname = \"wide\"\n[[case]]\nname = \"other\"\n\
                 set.calibration = { seed = 8 }\n";
    std::fs::write(dir.path().join("study.toml"), study).unwrap();
    let (code, _, err) = breccia(dir.path(), &["study", "study.toml", "--out", "study"]);
    assert_eq!(code, Some(0), "{err}");
    // the cases have the same runs of the design; each case also has two runs that confirm its mode
    assert_eq!((3..=10).map(|run| solved(dir.path(), run)).sum::<usize>(), 8);
    assert!(dir.path().join("study/report.html").is_file());
}

/// A prior that truncates the posterior is extended with further runs of the program.
#[test]
fn a_prior_with_a_free_name_is_extended() {
    let narrow = CASE.replace("[1.0, 2.0]", "[1.0, 1.5]").replace("runs = 10", "runs = 6");
    let dir = folder(&narrow, SOLVER);
    let (_, err) = run(dir.path(), &["--accept-out-of-range"]);
    let offer = "extend = [{ runs = 6, prior = { k1 = [1.5, 2.0] } }]";
    assert!(err.contains(offer), "{err}");
    let goal = "[further_tests]\nwidth90 = { k1 = 0.05 }\n";
    std::fs::write(dir.path().join("bar.toml"), format!("{offer}\n{narrow}{goal}")).unwrap();
    run(dir.path(), &[]);
    let results = dir.path().join("results");
    assert_eq!(table(&results.join("runs.csv")).len(), 12);
    assert_eq!((3..=12).map(|run| solved(dir.path(), run)).collect::<Vec<_>>(), [1; 10]);
    check_posterior(&results);
    let goals = table(&results.join("next-test-specimens.csv"));
    assert!(goals.iter().any(|row| row["goal"] == "width90" && row["parameter"] == "k1"));
}

/// A program that writes curves is compared with measured curves, which are not scaled to any mesh.
#[test]
fn curves_of_a_program_are_compared_with_measured_curves() {
    // F = k1 (u − u²/(2 d)) with its peak k1 d/2 at d = a mm
    let solver = r#"awk -v k="$1" -v a="$2" 'BEGIN { print "displacement_mm,force_n";
        for (i = 0; i <= 30; i++) { u = i * a / 20; printf "%.17g,%.17g\n", u, k * (u - u * u / (2 * a)) } }' > curve.csv"#;
    let case = r#"
[simulator]
command = ["sh", "solver.sh", "{k1}", "{a:.9e}"]
files = ["solver.sh"]
result = "curve.csv"
[parameters]
k1 = { unit = "N/mm", prior = [80.0, 120.0] }
a = { unit = "mm", prior = [0.08, 0.12] }
[qoi]
quantities = ["peak-force", "displacement-at-peak"]
[design]
runs = 24
[experiments]
table = "specimens.csv"
[calibration]
chains = 2
warmup = 300
draws = 500
[confirm]
draws = 1
"#;
    let dir = folder(case, solver);
    std::fs::create_dir(dir.path().join("curves")).unwrap();
    let mut list = "id,height_mm,radius_mm,group\n".to_owned();
    for (i, (k1, a)) in
        [(98.0, 0.101), (103.0, 0.098), (100.0, 0.1), (96.0, 0.103)].into_iter().enumerate()
    {
        list += &format!("S-{i},{},1.0,A\n", 5 + i);
        let point = |j: i32| {
            let u: f64 = f64::from(j) * a / 20.0;
            format!("{u},{}\n", k1 * (u - u * u / (2.0 * a)))
        };
        let curve: String = (0..=30).map(point).collect();
        let path = dir.path().join(format!("curves/S-{i}.csv"));
        std::fs::write(path, format!("displacement_mm,force_N\n{curve}")).unwrap();
    }
    std::fs::write(dir.path().join("specimens.csv"), list).unwrap();
    run(dir.path(), &["--threads", "2"]);
    let results = dir.path().join("results");
    for row in table(&results.join("experiments.csv")) {
        assert_eq!((number(&row, "displacement_factor"), number(&row, "force_factor")), (1.0, 1.0));
    }
    for row in table(&results.join("runs.csv")) {
        let [k1, a] = ["k1", "a"].map(|column| number(&row, column));
        assert!((number(&row, "peak_force_N") / (0.5 * k1 * a) - 1.0).abs() < 1e-6, "{row:?}");
        assert!((number(&row, "displacement_at_peak_mm") / a - 1.0).abs() < 1e-6, "{row:?}");
        assert!(results.join(format!("curves/run-{:0>3}.csv", row["run"])).is_file());
    }
    for (parameter, truth) in [("k1", 99.25), ("a", 0.1005)] {
        let row = row_of(&results, "summary.csv", parameter);
        let [low, high] = ["q05", "q95"].map(|column| number(&row, column));
        assert!(low < truth && truth < high, "{row:?}");
    }
    assert!(results.join("predictive_curves.csv").is_file());
    assert!(results.join("curves/map.csv").is_file());
}
