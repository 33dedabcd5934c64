//! `fit.csv`: misfit between the model at the posterior mode and the means of the specimens, and its standard
//! deviation.

use ppl::Posterior;
use surrogate::Dataset;

use super::WorkflowError;
use super::fitted::Fitted;
use super::specimen_stiffness::population;
use super::task::Task;
use super::uncertainty::{SharedError, mean_scatter};
use crate::fracture::{Evidence, column_means, relative_covariance};

/// Writes `fit.csv`. The standard deviation of the misfit in quantity m is √((Σ/n + S)_mm), where Σ is the covariance
/// between the specimens, n the number of specimens that have the quantity, and S the covariance of the errors that all
/// specimens share. The standard deviation for a
/// simulation also includes the scatter of microstructures, because a simulation uses a single microstructure.
///
/// # Errors
/// Fails if the posterior mode is outside the surrogate's box, or if a file cannot be read or written.
pub(super) fn write_fit(
    task: &Task<'_>,
    fitted: &Fitted,
    posterior: &Posterior,
    evidence: &Evidence,
    shared: &SharedError,
    map: &[f64],
) -> Result<(), WorkflowError> {
    let means = column_means(&evidence.qois);
    let (predicted, slopes) =
        fitted.pce.value_and_jacobian(&[map, &evidence.middle()[..]].concat())?;
    let of_specimens = mean_scatter(posterior, means.len());
    let of_all = shared.over(posterior, evidence)?;
    let of_microstructures = microstructures(task, fitted, &means, &slopes)?;
    let rows = (0..means.len()).map(|m| {
        let scatter = of_specimens.as_ref().map_or(0.0, |scatter| scatter[(m, m)]);
        let variance = scatter / evidence.specimens_with(m) as f64 + of_all[m][m];
        let percent = |variance: f64| 100.0 * variance.sqrt();
        let statistics = [
            means[m],
            predicted[m],
            100.0 * (predicted[m] / means[m] - 1.0),
            percent(variance),
            percent(variance + of_microstructures[m]),
        ];
        let name = [fitted.pce.outputs()[m].clone()];
        name.into_iter().chain(statistics.map(|x| x.to_string())).collect::<Vec<_>>()
    });
    let header = [
        "qoi",
        "experiment_mean",
        "map_surrogate",
        "percent_error",
        "sd_percent",
        "simulation_sd_percent",
    ];
    task.write_csv("fit.csv", header, rows.collect::<Vec<_>>())
}

/// Relative variance of each quantity between microstructures, estimated from the runs: the variance of the surrogate's
/// residuals, plus the contribution of the stiffness ratio if it is an input of the surrogate.
fn microstructures(
    task: &Task<'_>,
    fitted: &Fitted,
    means: &[f64],
    slopes: &[Vec<f64>],
) -> Result<Vec<f64>, WorkflowError> {
    if !fitted.made_on.shows_scatter() {
        return Ok(vec![0.0; means.len()]);
    }
    let scatter = match &fitted.specimens {
        Some(specimens) => specimens.between.scatter(means)?,
        None => fitted.report.scatter(means)?,
    };
    let scatter = relative_covariance(scatter, means);
    let sd_of_ratio = match fitted.known_stiffness.is_input() {
        true => {
            let runs = Dataset::read_csv(task.inputs.file("runs.csv")?)?;
            population(&runs, &[]).map_or(0.0, |population| population.sd()[0])
        }
        false => 0.0,
    };
    let variance = |m: usize| {
        let by_ratio = slopes[m].last().map_or(0.0, |slope| slope * sd_of_ratio / means[m]);
        scatter[m][m] + by_ratio * by_ratio
    };
    Ok((0..means.len()).map(variance).collect())
}
