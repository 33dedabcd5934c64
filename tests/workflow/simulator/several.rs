//! Several tests with a program as the source of runs: validations and candidates of further tests beside `[[tests]]`.

use std::path::Path;

use super::super::{breccia, number, table};
use super::{folder, row_of, run};

/// The extension of a bar, whose factor is the second argument.
const SOLVER: &str = r#"echo solved >> "$MARKS/$3"
awk -v k="$1" -v t="$2" 'BEGIN { print "extension_mm"; printf "%.17g\n", 3 * k * t }' > result.csv"#;

const CASE: &str = r#"
[simulator]
command = ["sh", "solver.sh", "{k1}", "1", "{run}"]
files = ["solver.sh"]
[parameters]
k1 = { unit = "MPa", prior = [1.0, 2.0] }
[qoi]
quantities = ["column:extension_mm"]
[design]
runs = 10
[surrogate]
max_order = 2
[experiments]
[calibration]
chains = 2
warmup = 500
draws = 1000
[confirm]
draws = 1
[further_tests]
specimens = [1, 4]
width90 = { k1 = 0.05 }

[[tests]]
name = "single"
set.experiments.values = "single.csv"
[[tests]]
name = "double"
set.simulator.command = ["sh", "solver.sh", "{k1}", "2", "{run}"]
set.experiments.values = "double.csv"

[[validation]]
name = "more"
test = "single"
set.experiments.values = "more.csv"
[[validation]]
name = "triple"
test = "double"
draws = 12
set.simulator.command = ["sh", "solver.sh", "{k1}", "3", "{run}"]
set.experiments.values = "triple.csv"

[[further_tests.candidate]]
name = "tenfold"
test = "single"
runs = 8
set.simulator.command = ["sh", "solver.sh", "{k1}", "10", "{run}"]
"#;

/// Extensions of bars with a scatter of about 3 %, relative to their mean.
const RELATIVE: [f64; 6] = [0.97, 1.04, 1.0, 0.965, 1.03, 0.995];

/// The case with specimens of k1 = 1.5. The extensions of the held-out specimens of the triple test are multiplied by `shift`.
fn case(shift: f64) -> tempfile::TempDir {
    let dir = folder(CASE, SOLVER);
    for (name, mean, first) in
        [("single", 4.5, 0), ("double", 9.0, 1), ("more", 4.52, 2), ("triple", 13.5 * shift, 0)]
    {
        let values = RELATIVE[first..].iter().enumerate();
        let rows: String = values.map(|(i, u)| format!("{name}-{i},{:?}\n", u * mean)).collect();
        let path = dir.path().join(format!("{name}.csv"));
        std::fs::write(path, format!("id,extension_mm\n{rows}")).unwrap();
    }
    dir
}

/// Validation, method and verdict of each quantity in the folder of a test.
fn verdicts(results: &Path, test: &str) -> Vec<[String; 3]> {
    let rows = table(&results.join(format!("tests/{test}/validation_summary.csv")));
    rows.iter().map(|row| ["validation", "method", "verdict"].map(|c| row[c].clone())).collect()
}

/// The joint posterior predicts other specimens of a test by its surrogate, and another test by simulations at draws of
/// the joint posterior. A further test with ten times the extension is as informative as more specimens of the same
/// test.
#[test]
fn the_joint_posterior_predicts_held_out_and_further_tests() {
    let dir = case(1.0);
    let (code, told, err) = breccia(dir.path(), &["check", "bar.toml"]);
    assert_eq!(code, Some(0), "{told}{err}");
    for part in ["validation more", "by the surrogate", "validation triple", "by 12 simulations"] {
        assert!(told.contains(part), "{part}: {told}");
    }
    run(dir.path(), &["--threads", "2"]);
    let results = dir.path().join("results");
    assert_eq!(verdicts(&results, "single"), [["more", "surrogate", "consistent"]]);
    assert_eq!(verdicts(&results, "double"), [["triple", "simulations", "consistent"]]);
    let rows = table(&results.join("tests/double/validation_summary.csv"));
    let predicted = number(&rows[0], "predicted_mean");
    let summary = row_of(&results, "summary.csv", "k1");
    let [mean, sd] = ["mean", "sd"].map(|column| number(&summary, column));
    // mean of 12 draws
    assert!((predicted - 9.0 * mean).abs() < 9.0 * 4.0 * sd / 12f64.sqrt(), "{predicted} {mean}");
    assert_eq!(row_of(&results, "verdict.csv", "k1")["verdict"], "identified");

    let design = table(&results.join("tests/single/next-test.csv"));
    let contraction = |candidate: &str, specimens: &str| {
        let is_row = |row: &&std::collections::BTreeMap<String, String>| {
            row["candidate"] == candidate && row["specimens"] == specimens
        };
        number(design.iter().find(is_row).unwrap(), "contraction")
    };
    for specimens in ["1", "4"] {
        let (more, other) =
            (contraction("more specimens", specimens), contraction("tenfold", specimens));
        assert!((more - other).abs() < 1e-3, "{more} {other}");
    }
    assert!(contraction("tenfold", "4") > contraction("tenfold", "1"));
    // the present posterior is the joint posterior
    let joint = number(&summary, "contraction");
    let now = contraction("tenfold", "0");
    assert!((now - joint).abs() < 0.01 && now == contraction("more specimens", "0"), "{joint}");
    let page = std::fs::read_to_string(results.join("report.html")).unwrap();
    for part in ["triple", "tenfold"] {
        assert!(page.contains(part), "{part}");
    }

    // nothing is simulated again
    let solved = || -> usize {
        let marks = std::fs::read_dir(dir.path().join("marks")).unwrap();
        let lines = marks.map(|mark| std::fs::read_to_string(mark.unwrap().path()).unwrap());
        lines.map(|text| text.lines().count()).sum()
    };
    let before = solved();
    let (_, err) = run(dir.path(), &[]);
    assert!(err.contains("finished before") && solved() == before, "{err}");
}

/// The modulus varies between tests, so that a further test has a new value. Its quantity informs about the modulus of the
/// calibrated test by the covariance C of both values: n specimens with the relative scatter s reduce the variance by
/// C²/(V + s² k²/n), where V is the variance of the new value k.
#[test]
fn a_further_test_has_another_value_of_a_varying_parameter() {
    let dir = case(1.0);
    let varying = "[calibration]\nbetween_tests.k1 = { varies-percent = 2.0 }\n";
    let text = CASE.replacen("[calibration]\n", varying, 1);
    std::fs::write(dir.path().join("bar.toml"), text).unwrap();
    run(dir.path(), &["--threads", "2"]);
    let results = dir.path().join("results");
    let present = table(&results.join("tests/single/posterior.csv"));
    let scatter = present[0].keys().find(|name| name.starts_with("sd[")).unwrap().clone();
    let column = |name: &str| present.iter().map(|row| number(row, name)).collect::<Vec<f64>>();
    let (here, sd) = (column("k1"), column(&scatter));
    let text = std::fs::read_to_string(results.join("joint/candidate/single-1.json")).unwrap();
    let rows: Vec<Vec<f64>> = serde_json::from_str(&text).unwrap();
    let there: Vec<f64> = rows.iter().map(|row| row[0]).collect();
    assert_eq!(there.len(), here.len());
    let covariance = |a: &[f64], b: &[f64]| {
        let count = a.len() as f64;
        let mean = |x: &[f64]| x.iter().sum::<f64>() / count;
        let (of_a, of_b) = (mean(a), mean(b));
        a.iter().zip(b).map(|(a, b)| (a - of_a) * (b - of_b)).sum::<f64>() / (count - 1.0)
    };
    let (both, new) = (covariance(&here, &there), covariance(&there, &there));
    // the value in a new test has a larger variance
    assert!(new > covariance(&here, &here), "{new}");
    let design = table(&results.join("tests/single/next-test.csv"));
    let contraction = |candidate: &str, specimens: usize| {
        let is_row = |row: &&std::collections::BTreeMap<String, String>| {
            row["candidate"] == candidate && row["specimens"] == specimens.to_string()
        };
        number(design.iter().find(is_row).unwrap(), "contraction")
    };
    for specimens in [1, 4] {
        let gain =
            |(k, sd): (&f64, &f64)| both * both / (new + (sd * k).powi(2) / specimens as f64);
        let exact = there.iter().zip(&sd).map(gain).sum::<f64>() / there.len() as f64;
        // the prior is uniform on [1, 2]
        let found = (contraction("tenfold", specimens) - contraction("tenfold", 0)) / 12.0;
        assert!((found / exact - 1.0).abs() < 0.05, "{specimens}: {found} {exact}");
        assert!(contraction("more specimens", specimens) > contraction("tenfold", specimens));
    }
}

#[test]
fn a_held_out_test_that_the_joint_posterior_misses_is_contradicted() {
    let dir = case(1.3);
    run(dir.path(), &["--threads", "2"]);
    let results = dir.path().join("results");
    assert_eq!(verdicts(&results, "double"), [["triple", "simulations", "contradicted"]]);
    let verdict = std::fs::read_to_string(results.join("verdict.csv")).unwrap();
    assert!(verdict.trim_end().ends_with("\"identified, validation failed\""), "{verdict}");
    let warnings = std::fs::read_to_string(results.join("warnings.txt")).unwrap();
    assert!(warnings.contains("double: ") && warnings.contains("triple"), "{warnings}");
}

#[test]
fn entries_beside_tests_name_their_test() {
    let dir = case(1.0);
    let tenfold =
        "runs = 8\nset.simulator.command = [\"sh\", \"solver.sh\", \"{k1}\", \"10\", \"{run}\"]";
    for (from, to, problem) in [
        (
            "name = \"more\"\ntest = \"single\"",
            "name = \"more\"",
            "validation (more).test: is missing",
        ),
        ("test = \"double\"", "test = \"twice\"", "validation (triple).test = \"twice\""),
        (
            "name = \"tenfold\"\ntest = \"single\"",
            "name = \"tenfold\"",
            "candidate (tenfold).test: is missing",
        ),
        ("name = \"triple\"", "name = \"more\"", "is the name of two validations"),
        ("\"more.csv\"", "\"double.csv\"", "has the data of double-0, which the calibration uses"),
        (tenfold, "quantities = [\"column:force_n\"]", "further quantities of present curves"),
        ("width90 = { k1", "width90 = { matrix.young_mpa", "is not calibrated"),
    ] {
        let text = CASE.replacen(from, to, 1);
        assert_ne!(text, CASE, "{from}");
        std::fs::write(dir.path().join("bar.toml"), text).unwrap();
        let (code, told, err) = breccia(dir.path(), &["check", "bar.toml"]);
        assert_ne!(code, Some(0), "{told}");
        assert!(format!("{told}{err}").contains(problem), "{problem}: {told}{err}");
    }
}
