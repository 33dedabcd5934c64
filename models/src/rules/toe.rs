//! Rule: displacements must not include a toe.

use fem::read_curve;

use super::rule::{Rule, Warning, qualified};
use crate::case::Toe;
use crate::curve_check::InspectedCurve;
use crate::experiment::TestCurve;
use crate::experiments::experiment_inputs;
use crate::pipeline::inputs::Inputs;
use crate::qoi::Qois;
use crate::report::Qualifier;
use crate::results_folder::error::WorkflowError;
use crate::simulation::recorded::recorded;
use crate::table::CsvTable;

/// Length of a toe below which it is negligible, % of the displacement at peak.
const NEGLIGIBLE: f64 = 2.0;

/// Rule on the toes of the measured curves. The rule applies if the displacement at peak is a compared quantity. Otherwise
/// only the stage `experiments` warns of the toe, and the verdict is not qualified.
///
/// The toe is found by extrapolation of the slope to zero force. A curve that is bent from its start, for example because the
/// material relaxes, has such a toe without a soft start, but then the simulated curve has it, too. The rule therefore
/// compares the toes with the toe of the simulation at the mode.
pub(super) const RULE: Rule = Rule { reads: &["experiments", "confirm"], check };

fn check(inputs: &Inputs<'_>) -> Result<Vec<Warning>, WorkflowError> {
    let Some(checks) = inputs.file_if_there("curve_checks.csv") else { return Ok(Vec::new()) };
    let checks = CsvTable::read(&checks, &["id", "finding", "value"])?;
    let peaks = inputs.file("experiments.csv")?;
    let peaks = CsvTable::read(&peaks, &["id"])?;
    // the table has this column only if the quantity is compared
    if !peaks.has_column("displacement_at_peak_mm") {
        return Ok(Vec::new());
    }
    let simulated = simulated_percent(inputs)?;
    if experiment_inputs::toe(inputs) == Toe::Correct {
        return Ok(warned_of_correction(simulated));
    }
    let mut percents = Vec::new();
    for row in checks.rows().filter(|row| row.text("finding") == "toe") {
        let specimen = peaks.named("id", row.text("id"))?;
        if specimen.text("displacement_at_peak_mm").is_empty() {
            continue;
        }
        let peak_mm = specimen.number("displacement_at_peak_mm")?;
        percents.push(100.0 * row.number("value")? / peak_mm - simulated);
    }
    Ok(warned(&percents))
}

/// The toe of the simulation at the mode, % of its displacement at peak; 0 if there is no such simulation, or if its curve has
/// no peak.
fn simulated_percent(inputs: &Inputs<'_>) -> Result<f64, WorkflowError> {
    let Some(file) = inputs.file_if_there("curves/map.csv") else { return Ok(0.0) };
    let curve = recorded(&read_curve(&file)?);
    let loading = match curve.first_loading() {
        Some(readings) => curve.picked(&readings),
        None => curve,
    };
    Ok(toe_percent(&loading, inputs.qoi().slope_fraction))
}

fn toe_percent(loading: &TestCurve, slope_fraction: f64) -> f64 {
    let peak = Qois::of(loading, slope_fraction).map(|qois| qois.displacement_at_peak_mm);
    let toe_mm = InspectedCurve::of(loading, slope_fraction).toe_mm;
    peak.map_or(0.0, |peak_mm| 100.0 * toe_mm / peak_mm)
}

/// Returns the warning about toes. `percents` are the lengths of the toes of all specimens that have a toe, less the toe of the
/// simulation, in % of the displacement at peak.
fn warned(percents: &[f64]) -> Vec<Warning> {
    let large: Vec<f64> = percents.iter().copied().filter(|p| p.abs() > NEGLIGIBLE).collect();
    let Some(largest) = large.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())) else {
        return Vec::new();
    };
    let count = large.len();
    let law = match largest < 0.0 {
        true => {
            " A negative toe is a curve that is bent more than the simulation at its start: first check whether the \
             material of the case must relax or yield (viscoelastic, plastic)."
        }
        false => "",
    };
    let text = format!(
        "The displacements of {count} specimens include a toe of up to {largest:.1} % of the displacement at peak, which \
         the simulation at the MAP does not have: the parameters are biased by it. Write toe = \"correct\" under \
         [experiments].{law}"
    );
    qualified(Qualifier::Toe, text)
}

/// Returns the warning about a correction that subtracts more than a soft start. `simulated` is the toe of the simulation in %
/// of the displacement at peak.
fn warned_of_correction(simulated: f64) -> Vec<Warning> {
    if simulated.abs() <= NEGLIGIBLE {
        return Vec::new();
    }
    let text = format!(
        "The displacements are corrected for a toe that is not a soft start: the curve of the simulation at the MAP is bent \
         from its start, and the same extrapolation finds a toe of {simulated:.1} % of the displacement at peak. The parameters \
         are biased by this difference. Write toe = \"report\" under [experiments], and subtract soft starts in the curves."
    );
    qualified(Qualifier::Toe, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_toe_counts_above_two_percent() {
        assert!(warned(&[]).is_empty() && warned(&[1.99, -1.99]).is_empty());
        let [warning] = &warned(&[1.0, 2.01, 13.9])[..] else { panic!("one warning") };
        assert_eq!(warning.qualifier, Some(Qualifier::Toe));
        assert!(warning.text.contains("2 specimens") && warning.text.contains("13.9 %"));
        assert!(!warning.text.contains("relax"), "{}", warning.text);
        let [warning] = &warned(&[-2.01])[..] else { panic!("one warning") };
        assert!(warning.text.contains("-2.0 %") && warning.text.contains("relax"));
    }

    #[test]
    fn a_correction_counts_if_the_simulation_has_a_toe() {
        assert!(warned_of_correction(1.99).is_empty() && warned_of_correction(-1.99).is_empty());
        let [warning] = &warned_of_correction(-3.1)[..] else { panic!("one warning") };
        assert!(warning.text.contains("-3.1 %") && warning.text.contains("\"report\""));
    }

    /// The curve of viscous damage has no toe. The same curve with a force that decays as a relaxing material does has a
    /// negative toe without any soft start; a real soft start is the difference to this value.
    #[test]
    fn a_curve_bent_from_its_start_has_the_same_toe_in_test_and_simulation() {
        let curve = |relaxed: f64, soft_mm: f64| {
            let u: Vec<f64> = (0..=220).map(|i| 0.001 * f64::from(i)).collect();
            let force = |u: &f64| {
                let v = (u - soft_mm).max(0.0);
                let x = v / 0.12;
                150.0
                    * x
                    * ((1.0 - x.powi(3)) / 3.0).exp()
                    * (1.0 - relaxed * (1.0 - (-v / 0.02).exp()))
            };
            let force_n = u.iter().map(force).collect();
            toe_percent(&TestCurve::new(u, force_n), 0.3)
        };
        assert!(curve(0.0, 0.0).abs() < 0.3, "{}", curve(0.0, 0.0));
        let relaxing = curve(0.3, 0.0);
        assert!(relaxing < -NEGLIGIBLE, "{relaxing}");
        let soft = curve(0.3, 0.01) - relaxing;
        assert!((5.0..10.0).contains(&soft), "{soft}");
    }
}
