//! A program that a user writes: `breccia` with one more quantity of interest, parameter, stage and section of the report,
//! which are defined outside the crates of the workspace.

use std::borrow::Cow;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use models::{
    CaseFile, PeakedCurve, Qoi, QoiError, Registry, ReportSection, SimulationParts, Stage, Target,
    TargetError, Task, Unit, Workflow, WorkflowError,
};
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

/// Factor on Young's modulus of all regions.
#[derive(Debug)]
struct StiffnessFactor;

impl Target for StiffnessFactor {
    fn path(&self) -> Cow<'_, str> {
        "sample.stiffness_factor".into()
    }

    fn label(&self) -> Cow<'_, str> {
        "stiffness factor".into()
    }

    fn unit(&self) -> Cow<'_, str> {
        "1".into()
    }

    fn range(&self) -> [f64; 2] {
        [0.0, f64::INFINITY]
    }

    fn set(&self, parts: &mut SimulationParts, value: f64) -> Result<(), TargetError> {
        let moduli = parts.material.values_mut().filter_map(|m| m.young_mpa.as_mut());
        moduli.for_each(|young_mpa| *young_mpa *= value);
        Ok(())
    }

    fn usual_scatter(&self) -> f64 {
        0.03
    }
}

/// Stage that writes the smallest and the largest draw of the viscosity.
fn extremes(task: &Task<'_>) -> Result<String, WorkflowError> {
    let draws = task.text("posterior.csv")?;
    let column = draws.lines().next().unwrap_or_default().split(',');
    let column = column.into_iter().position(|name| name == "matrix.viscosity_mpa_s").unwrap();
    let values = draws.lines().skip(1).map(|row| row.split(',').nth(column).unwrap());
    let values: Vec<f64> = values.map(|cell| cell.parse().unwrap()).collect();
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    let most = values.iter().copied().fold(0.0, f64::max);
    if most > 2.0 * least {
        task.warn("The largest viscosity is more than twice the smallest.");
    }
    let row = [least.to_string(), most.to_string()];
    task.write_csv("extremes.csv", ["least", "most"], [row])?;
    Ok(format!("viscosity between {least:.3} and {most:.3} MPa s"))
}

/// Section of the report with the content of `extremes.csv`.
fn extremes_section(task: &Task<'_>) -> Result<Option<String>, WorkflowError> {
    let table = task.text("extremes.csv")?;
    let row = table.lines().nth(1).unwrap_or_default();
    Ok(Some(format!("<p>Least and largest draw of the viscosity: {row} MPa s.</p>")))
}

fn extremes_stage() -> Stage {
    Stage::new("extremes", "Find the extreme draws: extremes.csv", &["extremes.csv"], extremes)
}

/// Case with linear elements, 12 runs with derivatives, and three virtual specimens.
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
sample.stiffness_factor = { distribution = "lognormal", median = 1.0, factor = 1.05, range = [0.9, 1.1] }
matrix.viscosity_mpa_s = [0.05, 0.55]
[design]
sample = "prior"
runs = 8
derivatives = true
[surrogate]
max_order = 2
[experiments.virtual]
specimens = 3
seed = 11
truth = { sample.stiffness_factor = 1.0, matrix.viscosity_mpa_s = 0.3 }
[calibration]
chains = 2
warmup = 150
draws = 150
[confirm]
draws = 1
"#;

/// Variance of exp(−½ (ln x/ln 1.05)²)/x on 0.9 < x < 1.1, by sums over a grid.
fn prior_variance() -> f64 {
    let (mut mass, mut first, mut second) = (0.0, 0.0, 0.0);
    for i in 0..2000 {
        let x = 0.9 + 1e-4 * (f64::from(i) + 0.5);
        let p = (-0.5 * (x.ln() / 1.05f64.ln()).powi(2)).exp() / x;
        (mass, first, second) = (mass + p, first + p * x, second + p * x * x);
    }
    second / mass - (first / mass).powi(2)
}

#[test]
#[should_panic(expected = "a product of the stage \"calibrate\"")]
fn a_stage_with_the_product_of_another_stage_is_refused() {
    let stage = Stage::new("extremes", "Find the extreme draws", &["summary.csv"], extremes);
    let _ = Registry::standard().with_stage(stage);
}

#[test]
#[should_panic(expected = "has the name")]
fn a_stage_with_the_name_of_another_stage_is_refused() {
    let _ = Registry::standard().with_stage(extremes_stage()).with_stage(extremes_stage());
}

/// Every stage uses the quantity and the parameter: both are columns of the tables and rows of the report. The
/// derivatives of the runs agree with viscous damage, for which the secant stiffness is proportional to Young's modulus
/// and does not depend on the viscosity. The toughness changes the derivatives by a few per cent.
#[test]
fn extensions_from_outside_are_part_of_the_program() {
    let registry = Registry::standard().with_qoi(SecantStiffness).with_target(StiffnessFactor);
    let section = ReportSection::new("Extreme draws", extremes_section);
    assert!(registry.with_stage(extremes_stage()).with_section(section).install());
    for (from, to, parts) in [
        ("stiffness_factor = {", "stifness_factor = {", ["stifness_factor", "stiffness_factor"]),
        ("range = [0.9", "range = [-0.9", ["sample.stiffness_factor", "at least 0"]),
    ] {
        let wrong = CaseFile::parse(&CASE.replacen(from, to, 1), Path::new("case.toml"));
        let message = wrong.unwrap_err().to_string();
        assert!(parts.iter().all(|part| message.contains(part)), "{message}");
    }
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
    let report = text("report.html");
    for part in ["secant stiffness (N/mm)", "stiffness factor", "lognormal, 0.9 … 1.1"] {
        assert!(report.contains(part), "{part}");
    }
    the_stage_and_the_section_are_there(&case, &out);
    let summary = text("summary.csv");
    let header: Vec<&str> = summary.lines().next().unwrap().split(',').collect();
    let row = summary.lines().find(|line| line.starts_with("sample.stiffness_factor,")).unwrap();
    let row: Vec<&str> = row.split(',').collect();
    let number = |name: &str| -> f64 {
        row[header.iter().position(|own| *own == name).unwrap()].parse().unwrap()
    };
    // relative to the variance of the lognormal prior; a uniform prior on this range has 1.7 times this variance
    let contraction = 1.0 - number("sd").powi(2) / prior_variance();
    assert!((number("contraction") - contraction).abs() < 0.05, "{row:?}, not {contraction}");
    let runs = Dataset::read_csv(out.join("runs.csv")).unwrap();
    for (i, (inputs, outputs)) in runs.rows().enumerate() {
        let [viscosity, factor] = inputs[..] else { panic!("{inputs:?}") };
        let [by_viscosity, by_factor] = runs.derivatives(i).unwrap()[..2] else { unreachable!() };
        let stiffness = outputs[0];
        assert!((by_factor * factor / stiffness - 1.0).abs() < 0.05, "{by_factor}");
        assert!((by_viscosity * viscosity / stiffness).abs() < 0.05, "{by_viscosity}");
    }
}

/// The stage writes its product and warning, the report has the section, and the stage runs again after a change of a file
/// that it has read.
fn the_stage_and_the_section_are_there(case: &CaseFile, out: &Path) {
    let text = |name: &str| std::fs::read_to_string(out.join(name)).unwrap();
    let table = text("extremes.csv");
    let row: Vec<f64> =
        table.lines().nth(1).unwrap().split(',').map(|cell| cell.parse().unwrap()).collect();
    assert!(0.05 <= row[0] && row[0] < row[1] && row[1] <= 0.55, "{row:?}");
    let report = text("report.html");
    for part in ["<h2>Extreme draws</h2>", table.lines().nth(1).unwrap()] {
        assert!(report.contains(part), "{part}");
    }
    let warning = "The largest viscosity is more than twice the smallest.";
    assert_eq!(text("warnings.txt").contains(warning), row[1] > 2.0 * row[0]);
    let stage = Stage::named("extremes").unwrap();
    let interrupt = AtomicBool::new(false);
    let due = || Workflow::open(case, out, 2, &interrupt).unwrap().due(stage);
    assert_eq!(due(), None);
    let draws = text("posterior.csv");
    let shortened = draws.trim_end().rsplit_once('\n').unwrap().0;
    std::fs::write(out.join("posterior.csv"), shortened).unwrap();
    assert!(due().is_some_and(|reason| reason.contains("posterior.csv")));
    std::fs::write(out.join("posterior.csv"), draws).unwrap();
    assert_eq!(due(), None);
}
