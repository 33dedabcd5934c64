//! Runs with the derivatives of their quantities.

use super::{TINY, breccia, number, table, without_image};

const PARAMETERS: [&str; 3] =
    ["matrix.young_mpa", "matrix.toughness_n_per_mm", "matrix.viscosity_mpa_s"];

/// Forces are homogeneous of degree one in E, Gc and ξ of all regions together. Therefore Σ θ ∂q/∂θ is q for the slope
/// and the peak force, and zero for the displacement at peak.
#[test]
fn derivatives_of_a_uniform_specimen_add_up() {
    let dir = tempfile::tempdir().unwrap();
    let uniform = without_image()
        .replace("grains = { fraction = 0.05, seed = 1, film_mm = 0.5, form = \"sphere\" }\n", "")
        .replace("runs = 12", "runs = 12\nderivatives = true");
    std::fs::write(dir.path().join("tiny.toml"), uniform).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "tiny.toml", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    let rows = table(&dir.path().join("results/runs.csv"));
    assert_eq!(rows.len(), 12);
    for row in rows {
        let sum = |quantity: &str| -> f64 {
            let term = |p: &&str| number(&row, p) * number(&row, &format!("d_{quantity}_d_{p}"));
            PARAMETERS.iter().map(term).sum()
        };
        for quantity in ["slope_N_per_mm", "peak_force_N"] {
            let (found, exact) = (sum(quantity), number(&row, quantity));
            assert!((found / exact - 1.0).abs() < 1e-5, "{quantity}: {found} for {exact}");
        }
        let at = "displacement_at_peak_mm";
        let largest =
            number(&row, PARAMETERS[0]) * number(&row, &format!("d_{at}_d_{}", PARAMETERS[0]));
        assert!(sum(at).abs() < 1e-4 * largest.abs(), "{at}: {} of {largest}", sum(at));
    }
}

/// A case with grains, runs on cheaper meshes, and specimens with known stiffness ratios.
#[test]
fn derivatives_of_corrected_runs_reach_the_posterior() {
    let dir = tempfile::tempdir().unwrap();
    let case = TINY
        .replace("spacing_mm = 1.5\n", "spacing_mm = 1.2\n")
        .replace("spacing_mm = 1.25\n", "scans = true\n")
        .replace(
            "[design]\nruns = 12",
            "[fidelity]\nlevels = [{ spacing_mm = 1.4, repeats = 3 }]\n[design]\nderivatives = true\nruns = 8",
        );
    std::fs::write(dir.path().join("tiny.toml"), &case).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "tiny.toml", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    let surrogate = std::fs::read_to_string(dir.path().join("results/surrogate.json")).unwrap();
    assert!(surrogate.contains("stiffness_ratio"));
    let (runs, orders) = (
        table(&dir.path().join("results/runs.csv")),
        table(&dir.path().join("results/surrogate_orders.csv")),
    );
    assert!(runs.iter().all(|row| number(row, "d_peak_force_N_d_matrix.young_mpa") > 0.0));
    // order 2 has 15 terms in four inputs, more than there are runs; derivatives determine the terms
    assert!(orders.iter().any(|row| row["order"] == "2"), "{orders:?}");
}

/// A test whose quantities have no derivatives is refused before the first run, with the name of the cause.
#[test]
fn friction_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let case = without_image()
        .replace("runs = 12", "runs = 12\nderivatives = true")
        .replace("steps = 44", "steps = 44\nplatens = \"unilateral\"\nfriction = 0.1");
    std::fs::write(dir.path().join("tiny.toml"), case).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "tiny.toml", "--out", "results"]);
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("design.derivatives") && err.contains("friction"), "{err}");
}
