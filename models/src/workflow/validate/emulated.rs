//! Predictions by the surrogate of the calibration, for held-out specimens of the calibrated test.

use nalgebra::DMatrix;

use super::super::WorkflowError;
use super::super::fitted::read_experiments;
use super::super::task::Task;
use super::super::uncertainty::SharedError;
use super::calibrated::Calibrated;
use super::held_out::HeldOut;
use super::predicted::{Predicted, Scatter};
use crate::budget::matrix;
use crate::case::ValidationCase;
use crate::fracture::column_means;

/// Number of posterior draws. The standard error of a predictive quantile is then a few per cent of the posterior standard
/// deviation.
const DRAWS: usize = 400;

/// Error δ that all specimens of a test share, given the specimens of the calibration.
///
/// The mean of N specimens is ȳ = f + δ + ē with δ ~ Normal(0, S) and ē ~ Normal(0, Σ/N). Given ȳ, δ is normal with the mean
/// K (ȳ − f) and the covariance S − K S, where K = S (S + Σ/N)⁻¹ (Kennedy & O'Hagan 2001, doi:10.1111/1467-9868.00294, for
/// errors of the model that are the same for all data).
struct SharedGiven {
    gain: DMatrix<f64>,
    covariance: DMatrix<f64>,
}

impl SharedGiven {
    /// `None` if S + Σ/N is not positive definite.
    fn new(shared: &DMatrix<f64>, scatter: &DMatrix<f64>, specimens: usize) -> Option<Self> {
        let total = shared + scatter / specimens as f64;
        let gain = total.cholesky()?.solve(shared).transpose();
        let covariance = shared - &gain * shared;
        Some(Self { gain, covariance })
    }
}

/// Predicts the quantities of the held-out specimens.
///
/// # Errors
/// Fails if a draw is outside the box of the surrogate, or if a result of the calibration cannot be read.
pub(super) fn predictions(
    task: &Task<'_>,
    entry: &ValidationCase,
    calibrated: &Calibrated,
    held_out: &HeldOut,
) -> Result<Vec<Predicted>, WorkflowError> {
    let inputs = &task.inputs;
    let fitted = &calibrated.fitted;
    let outputs = fitted.pce.outputs();
    let qois = read_experiments(inputs, outputs)?;
    let (means, specimens) = (column_means(&qois), qois.len());
    let shared_error = SharedError::of(fitted, &inputs.calibration().discrepancy, &means)?;
    let known_inputs = shared_error.evidence(qois, &fitted.known_stiffness).middle();
    let shared = match shared_error.total() {
        none if none.is_empty() => DMatrix::zeros(means.len(), means.len()),
        total => matrix(&total),
    };
    let draws = calibrated.thinned(DRAWS);
    // quantities relative to the means of the calibrated specimens, one row per draw
    let mut predicted: Vec<Vec<f64>> = Vec::new();
    let mut variances = vec![0.0; means.len()];
    for draw in &draws {
        let values = fitted.pce.value(&[&draw.theta[..], &known_inputs[..]].concat())?;
        let relative: Vec<f64> = values.iter().zip(&means).map(|(y, mean)| y / mean).collect();
        let Some(given) = SharedGiven::new(&shared, &matrix(&draw.scatter), specimens) else {
            let text = "the scatter of a posterior draw is not positive definite";
            return Err(WorkflowError::Unusable(text.to_owned()));
        };
        let gap = DMatrix::from_iterator(relative.len(), 1, relative.iter().map(|y| 1.0 - y));
        let error = &given.gain * gap;
        predicted.push(relative.iter().zip(error.iter()).map(|(y, e)| y + e).collect());
        for (m, variance) in variances.iter_mut().enumerate() {
            *variance += given.covariance[(m, m)].max(0.0) / draws.len() as f64;
        }
    }
    let scatter = Scatter {
        entry,
        calibrated: outputs,
        of_microstructures: None,
        calibrated_means: Some(&means),
    };
    let of_quantity = |quantity: &crate::qoi::Quantity| {
        let column = quantity.column();
        let Some(m) = scatter.index_of(&column) else {
            let text = format!("{column} is not a quantity of the surrogate");
            return Err(WorkflowError::Unusable(text));
        };
        let values: Vec<f64> = predicted.iter().map(|row| row[m] * means[m]).collect();
        let sds = scatter.sds(quantity, &draws, &values);
        Predicted::new(&column, values, sds, variances[m].sqrt() * means[m].abs())
    };
    held_out.quantities.iter().map(of_quantity).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with the closed form for a single quantity: the posterior mean of δ is the mean of its prior and of the
    /// observed gap, weighted by their precisions.
    #[test]
    fn the_shared_error_given_specimens_is_the_conjugate_normal() {
        let one = |x: f64| DMatrix::from_element(1, 1, x);
        let (s, scatter, n, gap) = (0.04, 0.18, 6, 0.3);
        let given = SharedGiven::new(&one(s), &one(scatter), n).unwrap();
        let precision = 1.0 / s + n as f64 / scatter;
        let mean = gap * n as f64 / scatter / precision;
        assert!((given.gain[(0, 0)] * gap - mean).abs() < 1e-12);
        assert!((given.covariance[(0, 0)] - 1.0 / precision).abs() < 1e-12);
        let none = SharedGiven::new(&one(0.0), &one(scatter), n).unwrap();
        assert_eq!((none.gain[(0, 0)], none.covariance[(0, 0)]), (0.0, 0.0));
        assert!(SharedGiven::new(&one(0.0), &one(0.0), n).is_none());
    }

    /// Two correlated quantities: K solves K (S + Σ/N) = S.
    #[test]
    fn the_gain_solves_its_equation() {
        let s = DMatrix::from_row_slice(2, 2, &[0.04, 0.01, 0.01, 0.02]);
        let scatter = DMatrix::from_row_slice(2, 2, &[0.09, -0.03, -0.03, 0.05]);
        let given = SharedGiven::new(&s, &scatter, 4).unwrap();
        let product = &given.gain * (&s + &scatter / 4.0);
        assert!((product - &s).norm() < 1e-14);
        assert!((&given.covariance - given.covariance.transpose()).norm() < 1e-14);
    }
}
