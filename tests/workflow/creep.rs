//! A creep test at a prescribed force, calibrated from noisy curves.

use super::{breccia, number, table};

/// Linear elements, 16 runs, four virtual specimens. The noise of the force is 2 % of the largest force.
const CASE: &str = r#"
[specimen]
radius_mm = 2.5
height_mm = 4.4
spacing_mm = 1.5
order = 1
[material.matrix]
law = "hencky"
young_mpa = 275.0
poisson = 0.25
viscoelastic.moduli = "instantaneous"
viscoelastic.shear = [{ fraction = 0.4, time_s = 0.5 }]
[test]
program = [
  { time_s = 0.1, force_n = 40.0, steps = 10 },
  { time_s = 2.1, force_n = 40.0, steps = 24 },
  { time_s = 2.2, force_n = 4.0, steps = 6 },
]
[qoi]
quantities = ["displacement-at-0.1-s", "creep-displacement"]
[prior]
matrix.young_mpa = [220.0, 340.0]
matrix.viscoelastic.shear.0.fraction = [0.2, 0.6]
[design]
runs = 16
[surrogate]
max_order = 3
[experiments.virtual]
specimens = 4
seed = 5
truth = { matrix.young_mpa = 275.0, matrix.viscoelastic.shear.0.fraction = 0.4 }
scatter = { matrix.young_mpa = 0.02 }
noise = { force_n = 0.8, displacement_mm = 0.0001 }
[calibration]
chains = 2
warmup = 200
draws = 300
[confirm]
draws = 1
"#;

/// Displacement divided by the elastic displacement after a ramp of 0.1 s and until 2.1 s, of a bar at small strain with
/// the Poisson's ratio 0.25 and G(t) = G₀ (1 − γ + γ e^(−t/τ)). The compliance of the bar is 1/(9 K) + J(t)/3 with
/// G₀ J(t) = 1 + γ/(1 − γ) (1 − e^(−(1 − γ) t/τ)).
fn closed_form(fraction: f64) -> [f64; 2] {
    let (poisson, tau_s, ramp_s) = (0.25, 0.5, 0.1);
    let gain = fraction / (1.0 - fraction);
    let retardation_s = tau_s / (1.0 - fraction);
    // with E = 1: 1/(9 K) and 1/(3 G₀)
    let (bulk, shear) = ((1.0 - 2.0 * poisson) / 3.0, 2.0 * (1.0 + poisson) / 3.0);
    // integral of the compliance from 0 to t, which is the response to a force that increases at a unit rate
    let ramp = |t: f64| {
        let delayed = t - retardation_s * (1.0 - (-t / retardation_s).exp());
        (bulk + shear) * t + shear * gain * delayed
    };
    [ramp_s, 2.1].map(|t| (ramp(t) - ramp(t - ramp_s)) / ramp_s)
}

#[test]
fn a_creep_test_is_calibrated_from_noisy_curves() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("case.toml"), CASE).unwrap();
    let (code, out, err) = breccia(dir.path(), &["check", "case.toml"]);
    assert_eq!(code, Some(0), "{out}{err}");
    let (code, _, err) = breccia(dir.path(), &["run", "case.toml", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    let results = dir.path().join("results");

    for row in table(&results.join("runs.csv")) {
        let [at_ramp, at_end] = closed_form(number(&row, "matrix.viscoelastic.shear.0.fraction"));
        let exact = at_end / at_ramp - 1.0;
        let found =
            number(&row, "creep_displacement_mm") / number(&row, "displacement_at_0.1_s_mm");
        // the largest strain is 1 %
        assert!((found / exact - 1.0).abs() < 0.03, "{found} {exact} {row:?}");
    }

    // each noisy curve has its hold
    let specimens = table(&results.join("experiments.csv"));
    let truths = table(&results.join("experiments/truth.csv"));
    assert_eq!(specimens.len(), 4);
    let [at_ramp, at_end] = closed_form(0.4);
    let elastic_mm = 40.0 * 4.4 / (std::f64::consts::PI * 2.5 * 2.5);
    for (specimen, truth) in specimens.iter().zip(&truths) {
        let exact = elastic_mm * (at_end - at_ramp) / number(truth, "matrix.young_mpa");
        let found = number(specimen, "creep_displacement_mm");
        // the cross-section of the mesh is smaller than the circle
        assert!((found / exact - 1.0).abs() < 0.2, "{found} {exact}");
    }

    let summary = table(&results.join("summary.csv"));
    for (parameter, truth, most_sd) in
        [("matrix.young_mpa", 275.0, 15.0), ("matrix.viscoelastic.shear.0.fraction", 0.4, 0.05)]
    {
        let row = summary.iter().find(|row| row["parameter"] == parameter).unwrap();
        let (mean, sd) = (number(row, "mean"), number(row, "sd"));
        assert!(sd < most_sd && (mean - truth).abs() < 4.0 * sd, "{parameter}: {mean} ± {sd}");
    }
}
