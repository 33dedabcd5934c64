//! `uncertainty.csv`: shares of tests and of their errors in the posterior variance of each parameter.

use nalgebra::DMatrix;
use ppl::Univariate;

use super::evidence::TestEvidence;
use crate::budget::shares;
use crate::forward::uncertainty::{TestSources, sources_of_test};
use crate::fracture::{JointCalibration, calibration_of_draws};
use crate::pipeline::task::Task;
use crate::results_folder::error::WorkflowError;

/// Writes `uncertainty.csv`. Each source is named by its test and its kind, such as `fast specimens`. A parameter that
/// varies between tests has the source `between tests`: the variance of its values in the tests about their centre or trend.
///
/// # Errors
/// Fails if the draws do not suit a test, or the file cannot be written.
pub(super) fn write_uncertainty(
    task: &Task<'_>,
    tests: &[TestEvidence],
    joint: &JointCalibration,
) -> Result<(), WorkflowError> {
    let mut sources_by_test = Vec::new();
    for (test, draws) in tests.iter().zip(&joint.tests) {
        let single = calibration_of_draws(&test.fitted.pce, &test.priors, &test.evidence, draws)?;
        let part = sources_of_test(&test.fitted, &single.posterior, &test.evidence, &test.shared)?;
        let Some(part) = part else { return Ok(()) };
        sources_by_test.push(part);
    }
    let prior: Vec<f64> = joint.priors.iter().map(Univariate::variance).collect();
    let (jacobian, sources) = stacked(tests, joint, &sources_by_test);
    let (names, covariances): (Vec<String>, Vec<DMatrix<f64>>) = sources.into_iter().unzip();
    let Some(shares) = shares(&jacobian, &prior, &covariances) else { return Ok(()) };
    let rows = joint.names.iter().zip(&shares).flat_map(|(parameter, shares)| {
        let row = |(source, share): (&String, &f64)| {
            [parameter.clone(), source.clone(), share.to_string()]
        };
        names.iter().zip(shares).map(row).collect::<Vec<_>>()
    });
    task.write_csv("uncertainty.csv", ["parameter", "source", "share"], rows)
}

/// Name of a source of uncertainty, and its covariance.
type NamedMatrix = (String, DMatrix<f64>);

/// Derivatives and covariances of the quantities of all tests, test by test.
fn stacked(
    tests: &[TestEvidence],
    joint: &JointCalibration,
    sources_by_test: &[TestSources],
) -> (Vec<Vec<f64>>, Vec<NamedMatrix>) {
    let size = sources_by_test.iter().map(|part| part.jacobian.len()).sum();
    let mut jacobian: Vec<Vec<f64>> = Vec::with_capacity(size);
    let mut sources: Vec<(String, DMatrix<f64>)> = Vec::new();
    let mut between = DMatrix::zeros(size, size);
    for (k, (test, part)) in tests.iter().zip(sources_by_test).enumerate() {
        let (first, rows) = (jacobian.len(), part.jacobian.len());
        let within_all = |covariance: &DMatrix<f64>| {
            let mut whole = DMatrix::zeros(size, size);
            whole.view_mut((first, first), (rows, rows)).copy_from(covariance);
            whole
        };
        for (kind, covariance) in &part.sources {
            sources.push((format!("{} {kind}", test.name), within_all(covariance)));
        }
        for (input, &variance) in joint.variances_between[k].iter().enumerate() {
            if variance > 0.0 {
                let column = DMatrix::from_fn(rows, 1, |row, _| part.jacobian[row][input]);
                between += within_all(&(&column * column.transpose() * variance));
            }
        }
        jacobian.extend(part.jacobian.iter().map(|row| {
            let mut whole = vec![0.0; joint.names.len()];
            for (slope, parameters) in row.iter().zip(&joint.dependences[k]) {
                parameters.iter().for_each(|&(index, rate)| whole[index] += slope * rate);
            }
            whole
        }));
    }
    if between.iter().any(|entry| *entry != 0.0) {
        sources.push(("between tests".to_owned(), between));
    }
    (jacobian, sources)
}
