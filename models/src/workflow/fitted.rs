//! What the runs have taught: the surrogate, and what is known of its error.

use surrogate::{
    CoefficientPosterior, Dataset, DynPce, FitOptions, FitReport, Input, PceFit, SurrogateError,
};

use super::WorkflowError;
use super::inputs::Inputs;
use super::packings::has_packing_per_run;
use super::stiffness::STIFFNESS_RATIO;
use crate::case::SurrogateCase;
use crate::error::InputError;
use crate::table::{CsvTable, TableRow};

/// The column of `runs.csv` with the number of the batch that was placed where the posterior lives; empty for
/// runs of the design.
pub(super) const BATCH: &str = "batch";

/// Fewest runs of such batches that show what a surrogate misses there.
const LEAST_LOCAL: usize = 8;

/// A surrogate with what a calibration takes of its error.
pub(super) struct Fitted {
    pub(super) pce: DynPce,
    pub(super) report: FitReport,
    /// What the runs leave open of its coefficients.
    pub(super) open: CoefficientPosterior,
    /// Whether each run had a packing of its own.
    pub(super) packing_per_run: bool,
    /// How well the corrections from cheaper meshes are known.
    pub(super) corrections: Vec<FitReport>,
}

impl Fitted {
    /// Fits the runs, with the stiffness ratio of each packing as one more input where `known` has those of
    /// the specimens.
    ///
    /// Runs count alike, wherever they lie. Weights would make up for a density that is not uniform if the
    /// mean error over the box were to be small; what is to be small is the error where the posterior
    /// lives, which is where more of them are. Where each run has a packing of its own, weights would lose
    /// besides. What a surrogate misses of one specimen is therefore asked of the runs that were placed there,
    /// once there are some: all runs together would answer for the corners of the box.
    ///
    /// # Errors
    /// As [`DynPce::fit`].
    pub(super) fn of(
        runs: &Dataset,
        known: Option<&[f64]>,
        case: &SurrogateCase,
        corrections: Vec<FitReport>,
    ) -> Result<Self, SurrogateError> {
        let with_stiffness = known.map(|known| with_stiffness_ratio(runs, known)).transpose()?;
        let with_stiffness = with_stiffness.flatten();
        let options = FitOptions {
            max_order: case.max_order,
            rule: case.rule,
            terms: case.terms,
            ..FitOptions::default()
        };
        let fit = DynPce::fit(with_stiffness.as_ref().unwrap_or(runs), &options)?;
        let packing_per_run = has_packing_per_run(runs);
        let placed = |&i: &usize| runs.note(i, BATCH).is_some_and(|batch| !batch.is_empty());
        let placed: Vec<usize> = (0..runs.len()).filter(placed).collect();
        let report = match placed.len() >= LEAST_LOCAL {
            true => fit.about(&placed)?,
            false => fit.report.clone(),
        };
        let PceFit { pce, coefficients: open, .. } = fit;
        Ok(Self { pce, report, open, packing_per_run, corrections })
    }

    /// As the stages `ensemble` and `surrogate` left it.
    ///
    /// # Errors
    /// Their files, where they cannot be read.
    pub(super) fn read(inputs: &Inputs<'_>) -> Result<Self, WorkflowError> {
        let runs = Dataset::read_csv(inputs.file("runs.csv")?)?;
        Ok(Self {
            pce: inputs.json("surrogate.json")?,
            report: inputs.json("surrogate_error.json")?,
            open: inputs.json("surrogate_uncertainty.json")?,
            packing_per_run: has_packing_per_run(&runs),
            corrections: match inputs.file_if_there("fidelity.json") {
                Some(_) => inputs.json("fidelity.json")?,
                None => Vec::new(),
            },
        })
    }

    /// How many of its inputs, the last ones, are known of each specimen.
    pub(super) fn known_inputs(&self) -> usize {
        usize::from(self.pce.inputs().last().is_some_and(|input| input.name == STIFFNESS_RATIO))
    }

    /// What is to be found.
    pub(super) fn unknown(&self) -> &[Input] {
        &self.pce.inputs()[..self.pce.inputs().len() - self.known_inputs()]
    }
}

/// Columns of `experiments.csv`, one row a specimen.
pub(super) fn read_experiments(
    inputs: &Inputs<'_>,
    columns: &[impl AsRef<str>],
) -> Result<Vec<Vec<f64>>, WorkflowError> {
    let path = inputs.file("experiments.csv")?;
    let columns: Vec<&str> = columns.iter().map(AsRef::as_ref).collect();
    let table = CsvTable::read(&path, &columns)?;
    let row = |row: TableRow| columns.iter().map(|column| row.positive(column)).collect();
    Ok(table.rows().map(row).collect::<Result<_, InputError>>()?)
}

/// What is known of each specimen of the inputs of a surrogate, a row each; none if nothing is.
pub(super) fn known_inputs(
    inputs: &Inputs<'_>,
    fitted: &Fitted,
) -> Result<Vec<Vec<f64>>, WorkflowError> {
    match fitted.known_inputs() {
        0 => Ok(Vec::new()),
        _ => read_experiments(inputs, &[STIFFNESS_RATIO]),
    }
}

/// The stiffness ratios of the specimens, if that of each is known.
pub(super) fn known_of_specimens(inputs: &Inputs<'_>) -> Result<Option<Vec<f64>>, WorkflowError> {
    let path = inputs.file("experiments.csv")?;
    let table = CsvTable::read(&path, &["id"])?;
    if table.rows().any(|row| row.text(STIFFNESS_RATIO).is_empty()) {
        return Ok(None);
    }
    let ratios = table.rows().map(|row| row.positive(STIFFNESS_RATIO));
    Ok(Some(ratios.collect::<Result<_, InputError>>()?))
}

/// The runs with the stiffness ratio of the packing of each as one more input, over the range of runs
/// and specimens; none if a run has none.
pub(super) fn with_stiffness_ratio(
    runs: &Dataset,
    specimens: &[f64],
) -> Result<Option<Dataset>, SurrogateError> {
    let ratio = |i: usize| runs.note(i, STIFFNESS_RATIO)?.parse::<f64>().ok();
    let Some(ratios) = (0..runs.len()).map(ratio).collect::<Option<Vec<f64>>>() else {
        return Ok(None);
    };
    let all = || ratios.iter().chain(specimens).copied();
    let (low, high) =
        (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    let mut inputs = runs.inputs().to_vec();
    inputs.push(Input::new(STIFFNESS_RATIO, low, high)?);
    // derivatives, where there are some, are those at a given ratio
    let differentiated = runs.inputs_with_derivatives();
    let mut data = Dataset::new(inputs, runs.outputs().to_vec(), runs.provenance())?
        .with_derivatives_in(differentiated)?;
    for (i, ((x, y), ratio)) in runs.rows().zip(&ratios).enumerate() {
        let x = [x, &[*ratio]].concat();
        match runs.derivatives(i) {
            None => data.push(&x, y)?,
            Some(slopes) => {
                let jacobian: Vec<&[f64]> = slopes.chunks(differentiated).collect();
                data.push_differentiated(&x, y, &jacobian, &[])?;
            }
        }
    }
    Ok(Some(data))
}
