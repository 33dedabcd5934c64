//! Three further quantities from curves to the report: work to the peak, slope past the peak, force at a displacement.

use std::path::Path;

use super::{breccia, number, table, without_image};

const COLUMNS: [&str; 3] =
    ["energy_to_peak_N_mm", "post_peak_slope_N_per_mm", "force_at_0.05_mm_N"];

/// The tiny case with three further quantities instead of the paper's quantities, and with curves that continue past
/// the peak.
fn case() -> String {
    let qoi =
        "[qoi]\nquantities = [\"energy-to-peak\", \"post-peak-slope\", \"force-at-0.05-mm\"]\n";
    without_image()
        .replace("stop_below_peak = 0.1\n", "stop_below_peak = 0.25\n")
        .replace("[surrogate]", &format!("{qoi}[surrogate]"))
}

/// Computes the three quantities independently from the piecewise linear curve: the work by the trapezoidal rule, the
/// slope by a line through many points of its window, and the force by interpolation. The window refers to the vertex
/// of a parabola through the highest three points.
fn by_hand(path: &Path) -> [f64; 3] {
    let rows = table(path);
    let mut points = vec![[0.0, 0.0]];
    points.extend(rows.iter().map(|row| [number(row, "displacement_mm"), number(row, "force_N")]));
    let force = |at: f64| {
        let k = points.iter().position(|p| p[0] >= at).unwrap();
        let [a, b] = [points[k - 1], points[k]];
        a[1] + (b[1] - a[1]) * (at - a[0]) / (b[0] - a[0])
    };
    let peak = (0..points.len()).max_by(|&a, &b| points[a][1].total_cmp(&points[b][1])).unwrap();
    let trapezium = |pair: &[[f64; 2]]| 0.5 * (pair[1][0] - pair[0][0]) * (pair[1][1] + pair[0][1]);
    let energy = points[..=peak].windows(2).map(trapezium).sum();
    let [before, at, after] = [points[peak - 1], points[peak], points[peak + 1]];
    let (rise, fall) = (at[1] - before[1], at[1] - after[1]);
    let vertex = at[0] + 0.5 * (after[0] - at[0]) * (rise - fall) / (rise + fall);
    let place = |i: i32| vertex * (1.1 + 0.002 * f64::from(i));
    let window: Vec<[f64; 2]> = (0..=100).map(|i| [place(i), force(place(i))]).collect();
    let mean = |k: usize| window.iter().map(|p| p[k]).sum::<f64>() / window.len() as f64;
    let [x, y] = [mean(0), mean(1)];
    let slope = window.iter().map(|p| (p[0] - x) * (p[1] - y)).sum::<f64>()
        / window.iter().map(|p| (p[0] - x).powi(2)).sum::<f64>();
    [energy, slope, force(0.05)]
}

#[test]
fn further_quantities_are_calibrated_against_from_runs_to_the_report() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("tiny.toml"), case()).unwrap();
    let run = ["run", "tiny.toml", "--out", "results", "--accept-out-of-range"];
    let (code, _, err) = breccia(dir.path(), &run);
    assert_eq!(code, Some(0), "{err}");
    let results = dir.path().join("results");

    // the work up to the highest step has an error of up to half a step, about 4 %
    let runs = table(&results.join("runs.csv"));
    assert!(runs.len() >= 10, "{}", runs.len());
    for row in &runs {
        let exact = by_hand(&results.join(format!("curves/run-{:0>3}.csv", row["run"])));
        let found = COLUMNS.map(|column| number(row, column));
        for ((found, exact), within) in found.iter().zip(exact).zip([0.06, 0.01, 0.01]) {
            assert!((found / exact - 1.0).abs() < within, "{found} {exact} {row:?}");
        }
    }
    // single predictions are draws from a normal distribution and may have another sign than the mean
    for file in ["experiments.csv", "predictive.csv"] {
        let rows = table(&results.join(file));
        let [energy, slope, force] =
            COLUMNS.map(|column| rows.iter().map(|row| number(row, column)).sum::<f64>());
        assert!(energy > 0.0 && slope < 0.0 && force > 0.0, "{file}: {energy} {slope} {force}");
    }
    for file in ["range.csv", "confirm.csv"] {
        let named: Vec<String> =
            table(&results.join(file)).iter().map(|row| row["qoi"].clone()).collect();
        assert_eq!(named, COLUMNS, "{file}");
    }
    let sobol = table(&results.join("sobol.csv"));
    assert!(COLUMNS.iter().all(|column| sobol.iter().any(|row| row["qoi"] == *column)));
    // the simulation at the mode agrees with the specimens' means within their scatter and the surrogate's error
    for row in table(&results.join("confirm.csv")) {
        assert!(number(&row, "percent_error").abs() < 25.0, "{row:?}");
    }
    let summary = std::fs::read_to_string(results.join("summary.csv")).unwrap();
    for part in ["mean[post_peak_slope_N_per_mm]", "correlation[force-at-0.05-mm,energy-to-peak]"] {
        assert!(summary.contains(part), "{part}: {summary}");
    }
    let report = std::fs::read_to_string(results.join("report.html")).unwrap();
    for part in ["energy to the peak (N mm)", "slope past the peak (N/mm)", "force at 0.05 mm (N)"]
    {
        assert!(report.contains(part), "{part}");
    }
    assert!(!report.contains(">NaN"));
}
