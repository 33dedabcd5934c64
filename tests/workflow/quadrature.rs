//! Compares the two rules by which damage is integrated, on one run of the ensemble.

use super::{breccia, number, table, without_image};

#[test]
fn the_other_quadrature_is_compared_with_a_run_that_is_as_if_made_with_it() {
    let dir = tempfile::tempdir().unwrap();
    let ensemble = |name: &str, length: &str| {
        let text = without_image()
            .replace("runs = 12", "runs = 4")
            .replace("steps = 44", "steps = 22")
            .replace("order = 1\n", "order = 2\n")
            .replace("length_mm = 0.06", length);
        std::fs::write(dir.path().join(format!("{name}.toml")), text).unwrap();
        let case = format!("{name}.toml");
        let mut told = String::new();
        for stage in ["mesh", "ensemble"] {
            let (code, _, err) = breccia(dir.path(), &[stage, &case, "--out", name]);
            assert_eq!(code, Some(0), "{err}");
            told = err;
        }
        (dir.path().join(name), told)
    };
    let (vertex, told) = ensemble("vertex", "length_mm = 0.06");
    let (consistent, _) = ensemble("consistent", "length_mm = 0.06\nquadrature = \"consistent\"");
    let compared = table(&vertex.join("quadrature.csv"));
    assert_eq!(compared.len(), 3);
    let peak = &compared[1];
    assert_eq!(peak["qoi"], "peak_force_N");
    // the compared run is a run of the design, which the other ensemble has also made
    let runs = [&vertex, &consistent].map(|results| table(&results.join("runs.csv")));
    let middle = runs[0].iter().position(|run| run["peak_force_N"] == peak["vertex"]).unwrap();
    for row in &compared {
        let (own, other) = (number(row, "vertex"), number(row, "consistent"));
        assert_eq!(own, number(&runs[0][middle], &row["qoi"]));
        assert_eq!(other, number(&runs[1][middle], &row["qoi"]));
        assert!((number(row, "percent") - 100.0 * (other / own - 1.0)).abs() < 1e-9);
    }
    let moved = number(peak, "percent");
    assert!(moved.abs() > 1.0, "{compared:?}");
    assert!(told.contains(&format!("peak-force by {moved:+.1} %")), "{told}");
    // an ensemble with the other rule writes the same comparison
    let back = table(&consistent.join("quadrature.csv"));
    assert_eq!(
        (&back[1]["vertex"], &back[1]["consistent"]),
        (&peak["vertex"], &peak["consistent"])
    );

    let (wide, _) = ensemble("wide", "length_mm = 6.0");
    assert!(!wide.join("quadrature.csv").exists());
}
