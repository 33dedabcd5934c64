//! What the posterior's width is made of, and the error that all specimens share.

use nalgebra::DMatrix;
use ppl::{Posterior, Summary};
use surrogate::{Dataset, DynPce, FitReport};

use super::WorkflowError;
use super::inputs::Inputs;
use super::packings::has_packing_per_run;
use super::task::Task;
use crate::budget::{largest_part, matrix, shares};
use crate::fracture::{column_means, short_name};

/// The covariance of the surrogate's error, which all specimens share, relative to their means.
///
/// Where each run had a packing of its own, the residuals of the surrogate are scatter between packings,
/// which the specimens have too; what is shared is the error of the mean response. Else it is what the
/// polynomial misses of the one specimen's response.
pub(super) fn shared_error(
    inputs: &Inputs<'_>,
    means: &[f64],
) -> Result<Vec<Vec<f64>>, WorkflowError> {
    let report: FitReport = inputs.json("surrogate_error.json")?;
    let runs = Dataset::read_csv(inputs.file("runs.csv")?)?;
    let covariance = match has_packing_per_run(&runs) {
        true => report.mean_error(means)?,
        false => report.lack_of_fit(means)?,
    };
    let row =
        |(row, a): (&Vec<f64>, &f64)| row.iter().zip(means).map(|(c, b)| c / (a * b)).collect();
    Ok(covariance.iter().zip(means).map(row).collect())
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
            "The surrogate's error is not small against the scatter of the specimens: n S/Σ = {ratio:.2} \
             for {name}. The intervals hold it: more runs in the design would make them narrower."
        )
    })
}

/// `uncertainty.csv`: the shares of the posterior variance of each parameter by source. The mesh has none,
/// since no interval holds its error: see `confirm.csv`.
///
/// - specimens: the scatter between specimens less that of packings, over n;
/// - geometry: the scatter of packings over n, where each run had one of its own;
/// - surrogate: the error that is shared.
pub(super) fn write_uncertainty(
    task: &Task<'_>,
    pce: &DynPce,
    posterior: &Posterior,
    summary: &Summary,
    specimens: &[Vec<f64>],
    shared: Vec<Vec<f64>>,
) -> Result<(), WorkflowError> {
    let (n, means) = (specimens.len() as f64, column_means(specimens));
    let mean_of = |name: &str| summary.row(name).map(|row| row.mean);
    let place: Option<Vec<f64>> = pce.inputs().iter().map(|input| mean_of(&input.name)).collect();
    let (Some(place), Some(scatter)) = (place, mean_scatter(posterior, means.len())) else {
        return Ok(());
    };
    let relative = |rows: Vec<Vec<f64>>| -> DMatrix<f64> {
        DMatrix::from_fn(means.len(), means.len(), |i, j| rows[i][j] / (means[i] * means[j]))
    };
    let mut sources = vec![("surrogate", matrix(&shared))];
    let mut own = scatter.clone();
    if has_packing_per_run(&Dataset::read_csv(task.inputs.file("runs.csv")?)?) {
        let report: FitReport = task.inputs.json("surrogate_error.json")?;
        let packings = relative(report.scatter(&means)?);
        let packings = &packings * largest_part(&scatter, &packings);
        own -= &packings;
        sources.push(("geometry", packings / n));
    }
    sources.push(("specimens", own / n));

    let (_, jacobian) = pce.value_and_jacobian(&place)?;
    let jacobian: Vec<Vec<f64>> = jacobian
        .iter()
        .zip(&means)
        .map(|(row, mean)| row.iter().map(|slope| slope / mean).collect())
        .collect();
    let prior: Vec<f64> =
        pce.inputs().iter().map(|input| (input.upper - input.lower).powi(2) / 12.0).collect();
    let (names, covariances): (Vec<&str>, Vec<DMatrix<f64>>) = sources.into_iter().unzip();
    let Some(shares) = shares(&jacobian, &prior, &covariances) else { return Ok(()) };
    let rows = pce.inputs().iter().zip(&shares).flat_map(|(input, shares)| {
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
