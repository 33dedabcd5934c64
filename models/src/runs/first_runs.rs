//! Comparison of the specimens with the first runs of an ensemble. A unit that is wrong by a factor of 4 or more is
//! thus reported after the first runs, and not after hundreds of runs.

use std::path::Path;

use fem::{RunInput, RunRecord};

use crate::case::{BoundsCase, QoiComparison};
use crate::error::InputError;
use crate::experiments::closed_form::ClosedForm;
use crate::experiments::experiment_inputs;
use crate::experiments::specimen_quantities::read_cell;
use crate::fracture::column_means;
use crate::pipeline::gate::unit_rank;
use crate::pipeline::task::Task;
use crate::prior::PriorBounds;
use crate::progress::say;
use crate::qoi::{Quantity, Unit};
use crate::results_folder::error::WorkflowError;
use crate::results_folder::files::SPECIMENS;
use crate::simulation::run_values::quantities;
use crate::simulation::setup::Setup;
use crate::table::{CsvTable, TableRow};

/// Tolerance factor: the expected range over the prior box is widened by this factor in both directions.
const FACTOR: f64 = 2.0;
/// If the ratio measured/expected differs from the ratio of two units by less than this factor, the error message names
/// the likely unit.
const NEAR: f64 = 1.4;

/// Size of the simulated specimen.
#[derive(Clone, Copy)]
pub(crate) struct SpecimenSize {
    pub(crate) height_mm: f64,
    pub(crate) radius_mm: f64,
}

/// Stops an ensemble if the specimens are far from its first runs. Does nothing if the stage `experiments` has not been
/// run or the specimens are virtual, and skips quantities without a closed form for their change over the prior box.
///
/// # Errors
/// The error names the table of specimens, the quantity, its expected range and the likely unit.
pub(crate) fn check_first_runs(
    task: &Task<'_>,
    setup: &Setup<'_>,
    size: SpecimenSize,
    records: &[RunRecord],
) -> Result<(), WorkflowError> {
    let qoi = task.inputs.qoi();
    let prior = task.inputs.whole_prior();
    let Some(prior) =
        prior.filter(|_| experiment_inputs::are_specimens_virtual(&task.inputs).is_ok_and(|v| !v))
    else {
        return Ok(());
    };
    // read the file without recording it as an input of the stage: the runs do not depend on it
    let Some(means) = means_of(&task.path("experiments.csv"), qoi) else { return Ok(()) };
    let usable = records.iter().find_map(|run| Some((run, quantities(run, qoi).ok()?)));
    let Some((run, simulated)) = usable else { return Ok(()) };
    let expected = Expected { setup, bounds: &prior.bounds(), size, run_inputs: &run.inputs };
    let mut compared: Vec<(&Quantity, f64, f64)> = qoi
        .quantities
        .iter()
        .zip(means.iter().zip(simulated))
        .map(|(quantity, (&mean, simulated))| (quantity, mean, simulated))
        .collect();
    compared.sort_by_key(|(quantity, ..)| unit_rank(quantity.unit()));
    for (quantity, mean, simulated) in compared {
        let Some([low, high]) = expected.range(quantity, simulated) else { continue };
        if (low / FACTOR..=high * FACTOR).contains(&mean) {
            continue;
        }
        let column = quantity.column();
        let problem = format!(
            "is far from the range of the runs: the first run has {simulated:.4}, and {low:.4} to {high:.4} are expected over \
             the box of [prior]"
        );
        let cause = cause(quantity.unit(), mean / (low * high).sqrt(), size)
            .unwrap_or("Check the units of curves, sizes and [material], and the box of [prior].");
        if task.accept_out_of_range {
            say("note", &format!("the mean of {column}, {mean:.4}, {problem}. {cause}"));
            continue;
        }
        let help = format!("{cause} With --accept-out-of-range the program continues.");
        let location = format!("mean of {column} over the specimens");
        let error =
            InputError::new(&task.path(SPECIMENS), location, format!("{mean:.4}"), problem, help);
        return Err(error.into());
    }
    Ok(())
}

/// Reads the means of the quantities over the specimens; `None` if there is no table with these quantities.
fn means_of(file: &Path, qoi: &QoiComparison) -> Option<Vec<f64>> {
    let columns: Vec<String> = qoi.quantities.iter().map(|q| q.column().into_owned()).collect();
    let columns: Vec<&str> = columns.iter().map(String::as_str).collect();
    let table = CsvTable::read(file, &columns).ok()?;
    let row_values = |row: TableRow<'_>| -> Option<Vec<f64>> {
        columns.iter().map(|column| read_cell(&row, column, false).ok()).collect()
    };
    let rows: Option<Vec<Vec<f64>>> = table.rows().map(row_values).collect();
    rows.filter(|rows| !rows.is_empty()).map(|rows| column_means(&rows))
}

/// Expected range of a quantity over the prior box, extrapolated from one run. The run gives the magnitude, and the
/// closed form gives the relative change over the box.
struct Expected<'a> {
    setup: &'a Setup<'a>,
    bounds: &'a BoundsCase,
    size: SpecimenSize,
    run_inputs: &'a [f64],
}

impl Expected<'_> {
    fn range(&self, quantity: &Quantity, simulated: f64) -> Option<[f64; 2]> {
        let SpecimenSize { height_mm, radius_mm } = self.size;
        let at_run: BoundsCase = self
            .bounds
            .parameters()
            .cloned()
            .zip(self.run_inputs.iter().map(|&value| PriorBounds([value; 2])))
            .collect();
        let range = |bounds: &BoundsCase| {
            ClosedForm::of(self.setup, bounds)?.range(&**quantity, height_mm, radius_mm)
        };
        let ([low, high], [at_run, _]) = (range(self.bounds)?, range(&at_run)?);
        let scaled = [low, high].map(|end| simulated * end / at_run);
        scaled.iter().all(|end| end.is_finite() && *end > 0.0).then_some(scaled)
    }
}

/// Returns a question about the unit that explains the ratio measured/expected; `None` if no unit explains the ratio.
fn cause(unit: Unit, ratio: f64, size: SpecimenSize) -> Option<&'static str> {
    let area_mm2 = std::f64::consts::PI * size.radius_mm.powi(2);
    let of_force = [
        (1e-3, "Is the force in kN? Write force_unit = \"kN\" under [experiments.read]."),
        (
            1.0 / 9.806_65,
            "Is the force in kgf? Write force_unit = \"kgf\" under [experiments.read].",
        ),
        (
            1.0 / 4.448_222,
            "Is the force in lbf? Write force_unit = \"lbf\" under [experiments.read].",
        ),
        (
            1.0 / area_mm2,
            "Is it a stress in MPa? Write force_unit = \"MPa\" under [experiments.read].",
        ),
        (1e3, "Is the force in mN? Write force_unit = \"mN\" under [experiments.read]."),
    ];
    let of_displacement = [
        (
            1e-3,
            "Is the displacement in m? Write displacement_unit = \"m\" under [experiments.read].",
        ),
        (
            1e3,
            "Is the displacement in µm? Write displacement_unit = \"µm\" under [experiments.read].",
        ),
        (
            1.0 / size.height_mm,
            "Is it a strain? Write displacement_unit = \"1\" under [experiments.read].",
        ),
        (
            100.0 / size.height_mm,
            "Is it a strain in %? Write displacement_unit = \"%\" under [experiments.read].",
        ),
        (
            1.0 / 25.4,
            "Is the displacement in inches? Write displacement_unit = \"in\" under [experiments.read].",
        ),
    ];
    let units: &[(f64, &'static str)] = match unit {
        Unit::N => &of_force,
        Unit::MM => &of_displacement,
        _ => return None,
    };
    let distance = |unit: f64| (ratio / unit).ln().abs();
    let (unit, cause) = units.iter().min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)))?;
    (distance(*unit) < NEAR.ln()).then_some(*cause)
}

/// Returns the runs that are computed before all other runs: one per thread.
pub(crate) fn first_of<'r>(task: &Task<'_>, runs: &'r [RunInput]) -> &'r [RunInput] {
    &runs[..task.threads.clamp(1, runs.len().max(1)).min(runs.len())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_recognised_by_their_ratio() {
        let size = SpecimenSize { height_mm: 4.4, radius_mm: 2.5 };
        let force = |ratio: f64| cause(Unit::N, ratio, size);
        for (ratio, unit) in [(0.0011, "kN"), (0.1, "kgf"), (0.22, "lbf"), (0.052, "MPa")] {
            let named = force(ratio).unwrap();
            assert!(named.contains(&format!("\"{unit}\"")), "{ratio}: {named}");
        }
        assert_eq!(force(0.45), None);
        let displacement = |ratio: f64| cause(Unit::MM, ratio, size);
        for (ratio, unit) in [(0.23, "\"1\""), (22.0, "%"), (0.04, "in"), (950.0, "µm")] {
            let named = displacement(ratio).unwrap();
            assert!(named.contains(unit), "{ratio}: {named}");
        }
        assert_eq!(cause(Unit::N_PER_MM, 0.1, size), None);
    }
}
