//! A user's own program: `breccia` with one more quantity of interest, which is defined outside the workspace's crates.

use std::borrow::Cow;
use std::sync::atomic::AtomicBool;

use models::{CaseFile, PeakedCurve, Qoi, QoiError, Registry, Unit, Workflow};
use surrogate::Dataset;

/// Peak force divided by the displacement at peak.
#[derive(Debug)]
struct SecantStiffness;

impl Qoi for SecantStiffness {
    fn name(&self) -> Cow<'static, str> {
        "secant-stiffness".into()
    }

    fn column(&self) -> Cow<'static, str> {
        "secant_stiffness_N_per_mm".into()
    }

    fn description(&self) -> Cow<'static, str> {
        "secant stiffness".into()
    }

    fn unit(&self) -> Unit {
        Unit::N_PER_MM
    }

    fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
        Ok(curve.peak_force_n() / curve.peak_mm())
    }
}

/// Linear elements, 12 runs with derivatives, three virtual specimens.
const CASE: &str = r#"
[specimen]
radius_mm = 2.5
height_mm = 4.4
spacing_mm = 1.5
order = 1
[material.matrix]
young_mpa = 275.0
poisson = 0.25
toughness_n_per_mm = 0.0025
viscosity_mpa_s = 0.3
[phase_field]
length_mm = 0.06
[test]
displacement_mm = 0.22
steps = 44
stop_below_peak = 0.1
[qoi]
quantities = ["secant-stiffness", "displacement-at-peak"]
[prior]
matrix.young_mpa = [250.0, 300.0]
matrix.viscosity_mpa_s = [0.05, 0.55]
[design]
runs = 8
derivatives = true
[surrogate]
max_order = 2
[experiments.virtual]
specimens = 3
seed = 11
truth = { matrix.young_mpa = 275.0, matrix.viscosity_mpa_s = 0.3 }
[calibration]
chains = 2
warmup = 150
draws = 150
[confirm]
draws = 1
"#;

/// Every stage uses the quantity: it is a column of the tables and a row of the report. The derivatives of the runs are
/// those of viscous damage, for which the secant stiffness is proportional to Young's modulus and does not depend on the
/// viscosity; the toughness makes a difference of a few per cent.
#[test]
fn a_quantity_from_outside_is_calibrated() {
    assert!(Registry::standard().with_qoi(SecantStiffness).install());
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("case.toml");
    std::fs::write(&path, CASE).unwrap();
    let (case, out) = (CaseFile::read(&path).unwrap(), dir.path().join("out"));
    let interrupt = AtomicBool::new(false);
    Workflow::open(&case, &out, 2, &interrupt).unwrap().run_all().unwrap();
    let text = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    for file in ["experiments.csv", "summary.csv", "confirm.csv"] {
        assert!(text(file).contains("secant_stiffness_N_per_mm"), "{file}");
    }
    assert!(text("report.html").contains("secant stiffness (N/mm)"));
    let runs = Dataset::read_csv(out.join("runs.csv")).unwrap();
    for (i, (inputs, outputs)) in runs.rows().enumerate() {
        let [young, viscosity] = inputs[..] else { panic!("{inputs:?}") };
        let [by_young, by_viscosity] = runs.derivatives(i).unwrap()[..2] else { unreachable!() };
        let stiffness = outputs[0];
        assert!((by_young * young / stiffness - 1.0).abs() < 0.05, "{by_young}");
        assert!((by_viscosity * viscosity / stiffness).abs() < 0.05, "{by_viscosity}");
    }
}
