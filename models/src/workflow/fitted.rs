//! What the runs have taught: the surrogate, and what is known of its error.

use surrogate::{
    CoefficientPosterior, Dataset, DynPce, FitOptions, FitReport, GroupedRuns, Input, PceFit,
    SurrogateError, Truncation,
};

use super::WorkflowError;
use super::inputs::Inputs;
use super::made_on::MadeOn;
use super::specimen_stiffness::{KnownStiffness, knowing_stiffness, of_specimens};
use crate::case::SurrogateCase;
use crate::error::InputError;
use crate::qoi::Quantity;
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
    /// What the runs were made on.
    pub(super) made_on: MadeOn,
    /// Where runs share specimens: what runs leave open, and what so few specimens do.
    pub(super) specimens: Option<GroupedRuns>,
    /// How well the corrections from cheaper meshes are known.
    pub(super) corrections: Vec<FitReport>,
    /// What is known of the specimens' stiffness ratios, if it takes them.
    pub(super) known: KnownStiffness,
}

impl Fitted {
    /// Fits the runs, with the stiffness ratio of each packing as one more input where it is known of
    /// `specimens`, or of some of them.
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
        specimens: &[Option<f64>],
        case: &SurrogateCase,
        corrections: Vec<FitReport>,
    ) -> Result<Self, SurrogateError> {
        let with_stiffness = knowing_stiffness(runs, specimens)?;
        let made_on = MadeOn::of(runs);
        let options = options_on(case, &made_on, with_stiffness.as_ref());
        let fitted_to = with_stiffness.as_ref().unwrap_or(runs);
        let fit = DynPce::fit(fitted_to, &options)?;
        let groups = of_specimens_of_runs(&fit, fitted_to, &made_on)?;
        let placed = |&i: &usize| runs.note(i, BATCH).is_some_and(|batch| !batch.is_empty());
        let placed: Vec<usize> = (0..runs.len()).filter(placed).collect();
        let report = match placed.len() >= LEAST_LOCAL {
            true => fit.about(&placed)?,
            false => fit.report.clone(),
        };
        let PceFit { pce, coefficients: open, .. } = fit;
        let known = KnownStiffness::of(&pce, runs, specimens);
        Ok(Self { pce, report, open, made_on, specimens: groups, corrections, known })
    }

    /// As the stages `ensemble` and `surrogate` left it.
    ///
    /// # Errors
    /// Their files, where they cannot be read.
    pub(super) fn read(inputs: &Inputs<'_>) -> Result<Self, WorkflowError> {
        // the stage before it is the one to be named where there is none
        let pce: DynPce = inputs.json("surrogate.json")?;
        let runs = Dataset::read_csv(inputs.file("runs.csv")?)?;
        let known = KnownStiffness::of(&pce, &runs, &of_specimens(inputs)?);
        let made_on = MadeOn::of(&runs);
        Ok(Self {
            pce,
            known,
            specimens: match made_on.several() {
                Some(_) => Some(inputs.json("surrogate_specimens.json")?),
                None => None,
            },
            made_on,
            report: inputs.json("surrogate_error.json")?,
            open: inputs.json("surrogate_uncertainty.json")?,
            corrections: match inputs.file_if_there("fidelity.json") {
                Some(_) => inputs.json("fidelity.json")?,
                None => Vec::new(),
            },
        })
    }

    /// What is to be found.
    pub(super) fn unknown(&self) -> &[Input] {
        &self.pce.inputs()[..self.pce.inputs().len() - usize::from(self.known.is_input())]
    }
}

/// How the case wants surrogates to be fitted.
fn fit_options(case: &SurrogateCase) -> FitOptions {
    let SurrogateCase { max_order, rule, terms } = *case;
    FitOptions { max_order, rule, terms, ..FitOptions::default() }
}

/// The same for runs that are made on some specimens; those `with_stiffness` have the ratio of each as their last
/// input. Where runs share specimens that takes few values, and is taken to be linear on its scale: quantities go with
/// powers of the ratio, and each further term would take one specimen more from what shows their scatter.
pub(super) fn options_on(
    case: &SurrogateCase,
    made_on: &MadeOn,
    with_stiffness: Option<&Dataset>,
) -> FitOptions {
    let options = fit_options(case);
    match (made_on.several(), with_stiffness) {
        (Some(_), Some(runs)) => {
            let truncation = Truncation::Limited { input: runs.inputs().len() - 1, order: 1 };
            FitOptions { truncation, ..options }
        }
        _ => options,
    }
}

/// What runs leave open, and what their specimens do, where runs share these.
///
/// # Errors
/// As [`GroupedRuns::of`].
pub(super) fn of_specimens_of_runs(
    fit: &PceFit,
    runs: &Dataset,
    made_on: &MadeOn,
) -> Result<Option<GroupedRuns>, SurrogateError> {
    match made_on {
        MadeOn::Several(groups) => GroupedRuns::of(fit, runs, groups).map(Some),
        _ => Ok(None),
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
    let cell = |row: &TableRow, column: &str| match Quantity::of_column(column) {
        // it is below zero where the force falls
        Some(Quantity::PostPeakSlope) => row.number(column),
        _ => row.positive(column),
    };
    let row = |row: TableRow| columns.iter().map(|column| cell(&row, column)).collect();
    Ok(table.rows().map(row).collect::<Result<_, InputError>>()?)
}
