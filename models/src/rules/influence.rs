//! Rule: no single specimen may decide the result.

use super::rule::{Rule, Warning};
use crate::pipeline::inputs::Inputs;
use crate::report::MOST_SHIFT;
use crate::results_folder::error::WorkflowError;
use crate::table::CsvTable;

/// Rule on the shift of the parameters if a specimen is left out of the calibration.
pub(super) const RULE: Rule =
    Rule { reads: &["calibrate"], check: |inputs| Ok(warned(&shifts(inputs)?)) };

/// Shift of the posterior mean of a parameter if one specimen is left out.
#[derive(Clone, Debug)]
struct Shift {
    specimen: String,
    parameter: String,
    /// Shift in posterior standard deviations.
    sd: f64,
}

/// Whether leaving out a specimen shifts a parameter by more than its posterior standard deviation.
fn is_decisive(shift_sd: f64) -> bool {
    shift_sd.abs() > MOST_SHIFT
}

fn shifts(inputs: &Inputs<'_>) -> Result<Vec<Shift>, WorkflowError> {
    // the file is missing if no specimen can be left out; the stage `calibrate` then issues a warning
    if inputs.file_if_there("influence.csv").is_none() {
        return Ok(Vec::new());
    }
    let path = inputs.file("influence.csv")?;
    let table = CsvTable::read(&path, &["specimen", "parameter", "shift_sd"])?;
    let mut shifts = Vec::new();
    for row in table.rows() {
        let [specimen, parameter] = ["specimen", "parameter"].map(|c| row.text(c).to_owned());
        shifts.push(Shift { specimen, parameter, sd: row.number("shift_sd")? });
    }
    Ok(shifts)
}

/// One warning for each decisive specimen.
fn warned(shifts: &[Shift]) -> Vec<Warning> {
    let mut specimens: Vec<&str> = Vec::new();
    let decisive: Vec<&Shift> = shifts.iter().filter(|shift| is_decisive(shift.sd)).collect();
    for shift in &decisive {
        if !specimens.contains(&shift.specimen.as_str()) {
            specimens.push(&shift.specimen);
        }
    }
    let warning = |specimen: &str| {
        let of_specimen = decisive.iter().filter(|shift| shift.specimen == specimen);
        let words: Vec<String> = of_specimen
            .map(|shift| format!("{} shifts by {:+.1}", shift.parameter, shift.sd))
            .collect();
        Warning {
            text: format!(
                "Specimen {specimen} decides the result: without it, {} posterior standard deviations. Check its \
                 curve, its preparation and its test.",
                words.join(", ")
            ),
            qualifier: None,
        }
    };
    specimens.into_iter().map(warning).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shift(specimen: &str, parameter: &str, sd: f64) -> Shift {
        Shift { specimen: specimen.into(), parameter: parameter.into(), sd }
    }

    #[test]
    fn a_specimen_is_named_from_one_standard_deviation_on() {
        assert!(!is_decisive(0.99) && !is_decisive(-0.99));
        assert!(is_decisive(1.01) && is_decisive(-1.01));
        let warnings = warned(&[
            shift("S-01", "matrix.young_mpa", 0.4),
            shift("S-02", "matrix.young_mpa", -1.3),
            shift("S-02", "matrix.viscosity_mpa_s", 1.2),
            shift("S-03", "matrix.viscosity_mpa_s", 0.99),
        ]);
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        let words = "without it, matrix.young_mpa shifts by -1.3, matrix.viscosity_mpa_s shifts by +1.2 posterior";
        assert!(
            warnings[0].text.starts_with("Specimen S-02") && warnings[0].text.contains(words),
            "{warnings:?}"
        );
        assert_eq!(warnings[0].qualifier, None);
    }
}
