//! `fit.csv`: misfit between the model at the posterior mode and the means of the specimens, and its standard
//! deviation.

use ppl::Posterior;
use ppl::prelude::*;
use surrogate::Dataset;

use super::fitted::Fitted;
use super::specimen_stiffness::population;
use super::uncertainty::{SharedError, mean_scatter};
use crate::fracture::{Evidence, column_means, relative_covariance};
use crate::pipeline::task::Task;
use crate::results_folder::error::WorkflowError;

/// Writes `fit.csv`. The standard deviation of the misfit in quantity m is √((Σ/n + S)_mm), where Σ is the covariance
/// between the specimens, n the number of specimens that have the quantity, and S the covariance of the errors that all
/// specimens share. The standard deviation for a
/// simulation also includes the scatter of microstructures, because a simulation uses a single microstructure.
///
/// The posterior of Σ also includes the misfit itself, which widens Σ if there are few specimens. The last column is
/// therefore a bound of the misfit from the scatter of the sample alone: see [`sample_bound`].
///
/// # Errors
/// Fails if the posterior mode is outside the surrogate's box, or if a file cannot be read or written.
pub(crate) fn write_fit(
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
        let values: Vec<f64> = evidence.qois.iter().map(|row| row[m] / means[m]).collect();
        let bound = sample_bound(&values, of_all[m][m]).map(|bound| (100.0 * bound).to_string());
        let name = [fitted.pce.outputs()[m].clone()];
        let statistics = statistics.map(|x| x.to_string());
        name.into_iter().chain(statistics).chain([bound.unwrap_or_default()]).collect::<Vec<_>>()
    });
    let header = [
        "qoi",
        "experiment_mean",
        "map_surrogate",
        "percent_error",
        "sd_percent",
        "simulation_sd_percent",
        "sample_bound_percent",
    ];
    task.write_csv("fit.csv", header, rows.collect::<Vec<_>>())
}

/// Probability that the mean of a normal sample is beyond its bound.
const BEYOND: f64 = 0.01;
/// Smallest bound in standard errors, for large samples.
const DEVIATIONS: f64 = 3.0;

/// Bound of a relative misfit from the scatter of the sample: √((k s)²/n + 9 S), with the standard deviation s of the `n`
/// values, the variance S of the errors that all specimens share, and k = max(3, t). Student's t for n − 1 degrees of
/// freedom is exceeded with a probability of 1 %; k is 63.7, 9.9, 5.8, 4.6, 3.5 and 3 for n = 2, 3, 4, 5, 8 and 15 or more.
/// `None` for fewer than two values; NaN is a missing value.
fn sample_bound(values: &[f64], shared: f64) -> Option<f64> {
    let values: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
    let n = values.len() as f64;
    if values.len() < 2 {
        return None;
    }
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    let student = StudentT(n - 1.0, 0.0, 1.0).upper_quantile(0.5 * BEYOND);
    let deviations = student.max(DEVIATIONS);
    Some((deviations * deviations * variance / n + DEVIATIONS * DEVIATIONS * shared).sqrt())
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

#[cfg(test)]
mod tests {
    use super::sample_bound;

    /// n values at 1 ± a have the variance n a²/(n − 1). The quantiles are from a table of Student's t.
    #[test]
    fn the_bound_is_that_of_student_and_of_the_shared_error() {
        let sample = |pairs: usize| [0.98, 1.02].repeat(pairs);
        for (pairs, quantile) in [(1, 63.656_741), (2, 5.840_909), (4, 3.499_483), (50, 3.0)] {
            let n = 2.0 * pairs as f64;
            let standard_error = 0.02 / (n - 1.0).sqrt();
            let bound = sample_bound(&sample(pairs), 0.0).unwrap();
            assert!((bound / (quantile * standard_error) - 1.0).abs() < 1e-6, "{n}: {bound}");
            let with_shared = sample_bound(&sample(pairs), 0.01 * 0.01).unwrap();
            assert!((with_shared - bound.hypot(0.03)).abs() < 1e-12);
        }
        assert_eq!(sample_bound(&[1.0, f64::NAN], 0.0), None);
        let missing = [&sample(2)[..], &[f64::NAN]].concat();
        assert_eq!(sample_bound(&missing, 0.0), sample_bound(&sample(2), 0.0));
    }
}
