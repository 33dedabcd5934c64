//! The surrogate that is fitted to the runs, and its error.

use surrogate::{
    CoefficientPosterior, Dataset, DynPce, FitOptions, FitReport, GroupedRuns, Input, PceFit,
    SurrogateError, Truncation,
};

use super::specimen_stiffness::{KnownStiffness, knowing_stiffness, of_specimens};
use crate::case::SurrogateCase;
use crate::error::InputError;
use crate::experiments::specimen_quantities::read_cell;
use crate::fracture::relative_covariance;
use crate::pipeline::inputs::Inputs;
use crate::qoi::Quantity;
use crate::results_folder::error::WorkflowError;
use crate::runs::made_on::MadeOn;
use crate::table::{CsvTable, TableRow};

/// Column of `runs.csv` with the number of the batch that was placed in the region of the posterior; empty for runs of
/// the design.
pub(crate) const BATCH: &str = "batch";

/// Minimum number of runs in batches for an estimate of the surrogate's error in the region of the posterior.
const LEAST_LOCAL: usize = 8;

/// A surrogate, and the contributions to its error that a calibration includes.
pub(crate) struct Fitted {
    pub(crate) pce: DynPce,
    pub(crate) report: FitReport,
    /// Posterior of the coefficients: the error from the finite number of runs.
    pub(crate) coefficients: CoefficientPosterior,
    /// Specimens of the runs.
    pub(crate) made_on: MadeOn,
    /// Error of the fit, separated into scatter within and between specimens; `None` unless runs share specimens.
    pub(crate) specimens: Option<GroupedRuns>,
    /// Fit reports of the corrections from cheaper meshes.
    pub(crate) corrections: Vec<FitReport>,
    /// Stiffness ratios of the specimens; empty if the ratio is not an input of the surrogate.
    pub(crate) known_stiffness: KnownStiffness,
}

impl Fitted {
    /// Fits the surrogate to the runs. The stiffness ratio of the packing is an additional input if the ratio is known
    /// for all or some of the `specimens`.
    ///
    /// All runs have equal weight. Weights that correct for the density of the runs would minimise the mean error
    /// over the prior box. However, the error should be small in the region of the posterior, where the batches have
    /// added runs. If each run has its own packing, weights would also increase the variance. The lack of fit is
    /// estimated from the runs of batches, once there are enough such runs, because the estimate should be valid in
    /// the region of the posterior: the corners of the box would dominate an estimate from all runs.
    ///
    /// # Errors
    /// The errors of [`DynPce::fit`].
    pub(crate) fn of(
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
        let PceFit { pce, coefficients, .. } = fit;
        let known_stiffness = KnownStiffness::of(&pce, runs, specimens);
        Ok(Self {
            pce,
            report,
            coefficients,
            made_on,
            specimens: groups,
            corrections,
            known_stiffness,
        })
    }

    /// Reads the results of the stages `ensemble` and `surrogate`.
    ///
    /// # Errors
    /// Fails if a file is missing or cannot be read.
    pub(crate) fn read(inputs: &Inputs<'_>) -> Result<Self, WorkflowError> {
        // read this file first: if it is missing, the error names the stage `surrogate`
        let pce: DynPce = inputs.json("surrogate.json")?;
        let runs = Dataset::read_csv(inputs.file("runs.csv")?)?;
        let known_stiffness = KnownStiffness::of(&pce, &runs, &of_specimens(inputs)?);
        let made_on = MadeOn::of(&runs);
        Ok(Self {
            pce,
            known_stiffness,
            specimens: match made_on.several() {
                Some(_) => Some(inputs.json("surrogate_specimens.json")?),
                None => None,
            },
            made_on,
            report: inputs.json("surrogate_error.json")?,
            coefficients: inputs.json("surrogate_uncertainty.json")?,
            corrections: match inputs.file_if_there("fidelity.json") {
                Some(_) => inputs.json("fidelity.json")?,
                None => Vec::new(),
            },
        })
    }

    /// Covariance (quantities × quantities, relative to `means`) between the microstructures of the runs; `None` if all runs use the
    /// same specimen.
    ///
    /// # Errors
    /// Fails if `means` has another length than the outputs of the surrogate.
    pub(crate) fn between_microstructures(
        &self,
        means: &[f64],
    ) -> Result<Option<Vec<Vec<f64>>>, WorkflowError> {
        if !self.made_on.shows_scatter() {
            return Ok(None);
        }
        let scatter = match &self.specimens {
            Some(specimens) => specimens.between.scatter(means)?,
            // each run has its own microstructure, so that the residuals are scatter between microstructures
            None => self.report.scatter(means)?,
        };
        Ok(Some(relative_covariance(scatter, means)))
    }

    /// Inputs of the surrogate that are calibrated.
    pub(crate) fn unknown(&self) -> &[Input] {
        &self.pce.inputs()[..self.pce.inputs().len() - usize::from(self.known_stiffness.is_input())]
    }
}

/// Fit options of the case.
fn fit_options(case: &SurrogateCase) -> FitOptions {
    let SurrogateCase { max_order, rule, terms } = *case;
    FitOptions { max_order, rule, terms, ..FitOptions::default() }
}

/// Fit options for runs with the specimens `made_on`. `with_stiffness` are the runs with the stiffness ratio as their
/// last input. If runs share specimens, the ratio has only a few values. The fit is then linear in the ratio, on the
/// scale of the fit: quantities are proportional to powers of the ratio, and each further term would cost one degree of
/// freedom in the estimate of the scatter between specimens.
pub(crate) fn options_on(
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

/// Separates the error of a fit into scatter within and between specimens; `None` unless runs share specimens.
///
/// # Errors
/// The errors of [`GroupedRuns::of`].
pub(crate) fn of_specimens_of_runs(
    fit: &PceFit,
    runs: &Dataset,
    made_on: &MadeOn,
) -> Result<Option<GroupedRuns>, SurrogateError> {
    match made_on {
        MadeOn::Several(groups) => GroupedRuns::of(fit, runs, groups).map(Some),
        _ => Ok(None),
    }
}

/// Reads columns of `experiments.csv`; one row per specimen. An empty cell, whose quantity the specimen lacks, is NaN.
pub(crate) fn read_experiments(
    inputs: &Inputs<'_>,
    columns: &[impl AsRef<str>],
) -> Result<Vec<Vec<f64>>, WorkflowError> {
    let path = inputs.file("experiments.csv")?;
    let columns: Vec<&str> = columns.iter().map(AsRef::as_ref).collect();
    let table = CsvTable::read(&path, &columns)?;
    let cell = |row: &TableRow<'_>, column: &str| {
        // a quantity that is not computed from curves may have any sign
        let quantity = Quantity::of_column(column);
        read_cell(row, column, quantity.is_some_and(|quantity| quantity.is_positive()))
    };
    let row = |row: TableRow| columns.iter().map(|column| cell(&row, column)).collect();
    Ok(table.rows().map(row).collect::<Result<_, InputError>>()?)
}
