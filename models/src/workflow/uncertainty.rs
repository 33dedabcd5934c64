//! What the posterior's width is made of, and the error that all specimens share.

use nalgebra::DMatrix;
use ppl::{Posterior, Summary};
use surrogate::{Dataset, DynPce, FitReport};

use super::WorkflowError;
use super::fidelity::{added, error_of_all};
use super::inputs::Inputs;
use super::packings::has_packing_per_run;
use super::task::Task;
use crate::budget::{largest_part, matrix, shares};
use crate::fracture::{Evidence, column_means, relative_covariance, short_name};

/// The covariances (quantities × quantities, relative to the specimens' means) of the errors that all
/// specimens share.
pub(super) struct SharedError {
    /// Of the surrogate.
    surrogate: Vec<Vec<f64>>,
    /// Of the corrections from cheaper meshes, if there are any.
    mesh: Option<Vec<Vec<f64>>>,
    /// Of the model itself, as the case has it.
    discrepancy: Option<Vec<Vec<f64>>>,
}

impl SharedError {
    /// From the errors of a surrogate and of the corrections of its runs.
    pub(super) fn of(
        surrogate: &FitReport,
        corrections: &[FitReport],
        discrepancy: Option<Vec<Vec<f64>>>,
        packing_per_run: bool,
        means: &[f64],
    ) -> Result<Self, WorkflowError> {
        let covariance = match packing_per_run {
            true => surrogate.mean_error(means)?,
            false => surrogate.lack_of_fit(means)?,
        };
        let mesh = error_of_all(corrections, packing_per_run)?;
        Ok(Self { surrogate: relative_covariance(covariance, means), mesh, discrepancy })
    }

    /// Their sum: the errors are of different runs, and what the model is off by is of none.
    pub(super) fn total(&self) -> Vec<Vec<f64>> {
        let of_runs = self.of_runs();
        self.discrepancy.as_ref().map_or_else(|| of_runs.clone(), |model| added(&of_runs, model))
    }

    /// That of surrogate and corrections, which more runs make smaller.
    pub(super) fn of_runs(&self) -> Vec<Vec<f64>> {
        let surrogate = self.surrogate.clone();
        self.mesh.as_ref().map_or(surrogate, |mesh| added(&self.surrogate, mesh))
    }
}

/// What all specimens share: the error of the surrogate, that of `[fidelity]`, and that of the model as
/// `[calibration.discrepancy]` has it.
///
/// Where each run had a packing of its own, the residuals of the surrogate are scatter between packings,
/// which the specimens have too; what is shared is the error of the mean response. Else it is what the
/// polynomial misses of the one specimen's response.
pub(super) fn shared_error(
    inputs: &Inputs<'_>,
    means: &[f64],
) -> Result<SharedError, WorkflowError> {
    let report: FitReport = inputs.json("surrogate_error.json")?;
    let runs = Dataset::read_csv(inputs.file("runs.csv")?)?;
    let corrections = match inputs.file_if_there("fidelity.json") {
        Some(_) => inputs.json::<Vec<FitReport>>("fidelity.json")?,
        None => Vec::new(),
    };
    let discrepancy = inputs.calibration().discrepancy.covariance(&report.outputs);
    SharedError::of(&report, &corrections, discrepancy, has_packing_per_run(&runs), means)
}

/// Whether the shared error widens the posterior: n S/Σ above 0.1 for some quantity, with S its
/// variance, Σ that between n specimens, both relative.
pub(super) fn shared_error_warning(
    summary: &Summary,
    quantities: &[String],
    specimens: usize,
    shared: &[Vec<f64>],
) -> Option<String> {
    let worst = quantities
        .iter()
        .enumerate()
        .filter_map(|(m, name)| {
            let sd = summary.row(&format!("sd[{}]", short_name(name)))?.mean;
            Some((specimens as f64 * shared[m][m] / (sd * sd), name))
        })
        .max_by(|a, b| a.0.total_cmp(&b.0));
    worst.filter(|(ratio, _)| *ratio > 0.1).map(|(ratio, name)| {
        format!(
            "The error of the forward model is not small against the scatter of the specimens: n S/Σ = \
             {ratio:.2} for {name}. The intervals hold it: more runs in the design, or more repeats in \
             [fidelity], would make them narrower."
        )
    })
}

/// `uncertainty.csv`: the shares of the posterior variance of each parameter by source.
///
/// - specimens: the scatter between specimens less that of packings, over n;
/// - geometry: the scatter of packings over n, where each run had one of its own;
/// - surrogate: its error, which is shared;
/// - discrepancy: what the case says the model itself may be off by;
/// - mesh: the error of the correction from cheaper meshes. What the specimen's own mesh errs by is in no
///   interval: see `confirm.csv`.
pub(super) fn write_uncertainty(
    task: &Task<'_>,
    pce: &DynPce,
    posterior: &Posterior,
    summary: &Summary,
    evidence: &Evidence,
    shared: SharedError,
) -> Result<(), WorkflowError> {
    let (n, means) = (evidence.qois.len() as f64, column_means(&evidence.qois));
    // what is known of the specimens takes no part, and stands at its mean
    let known = column_means(&evidence.known);
    let unknown = &pce.inputs()[..pce.inputs().len() - known.len()];
    let mean_of = |name: &str| summary.row(name).map(|row| row.mean);
    let place: Option<Vec<f64>> = unknown.iter().map(|input| mean_of(&input.name)).collect();
    let (Some(place), Some(scatter)) = (place, mean_scatter(posterior, means.len())) else {
        return Ok(());
    };
    let mut sources = vec![("surrogate", matrix(&shared.surrogate))];
    sources.extend(shared.mesh.as_ref().map(|mesh| ("mesh", matrix(mesh))));
    sources.extend(shared.discrepancy.as_ref().map(|model| ("discrepancy", matrix(model))));
    let mut own = scatter.clone();
    if has_packing_per_run(&Dataset::read_csv(task.inputs.file("runs.csv")?)?) {
        let report: FitReport = task.inputs.json("surrogate_error.json")?;
        let packings = matrix(&relative_covariance(report.scatter(&means)?, &means));
        let packings = &packings * largest_part(&scatter, &packings);
        own -= &packings;
        sources.push(("geometry", packings / n));
    }
    sources.push(("specimens", own / n));

    let (_, jacobian) = pce.value_and_jacobian(&[place, known].concat())?;
    let jacobian: Vec<Vec<f64>> = jacobian
        .iter()
        .zip(&means)
        .map(|(row, mean)| row[..unknown.len()].iter().map(|slope| slope / mean).collect())
        .collect();
    let prior: Vec<f64> =
        unknown.iter().map(|input| (input.upper - input.lower).powi(2) / 12.0).collect();
    let (names, covariances): (Vec<&str>, Vec<DMatrix<f64>>) = sources.into_iter().unzip();
    let Some(shares) = shares(&jacobian, &prior, &covariances) else { return Ok(()) };
    let rows = unknown.iter().zip(&shares).flat_map(|(input, shares)| {
        let row = |(source, share): (&&str, &f64)| {
            [input.name.clone(), (*source).to_owned(), share.to_string()]
        };
        names.iter().zip(shares).map(row).collect::<Vec<_>>()
    });
    task.write_csv("uncertainty.csv", ["parameter", "source", "share"], rows)
}

/// The posterior mean of the covariance between specimens, diag(sd) R diag(sd).
fn mean_scatter(posterior: &Posterior, size: usize) -> Option<DMatrix<f64>> {
    let group = &posterior.posterior;
    let of = |name: &str| group.variables.iter().find(|v| v.name == name).map(|v| &v.data);
    let (sd, corr) = (of("sd")?, of("corr")?);
    let draws = group.chains * group.draws;
    let mut mean = DMatrix::zeros(size, size);
    for (sd, corr) in sd.chunks(size).zip(corr.chunks(size * size)) {
        let factor = DMatrix::from_fn(size, size, |i, j| sd[i] * corr[i * size + j]);
        mean += &factor * factor.transpose() / draws as f64;
    }
    Some(mean)
}
