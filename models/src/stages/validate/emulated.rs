//! Predictions by the surrogate of the calibration, for held-out specimens of the calibrated test.

use nalgebra::DMatrix;

use super::calibrated::Calibrated;
use super::held_out::HeldOut;
use super::predicted::{Predicted, Scatter};
use crate::budget::matrix;
use crate::case::ValidationCase;
use crate::forward::fitted::read_experiments;
use crate::forward::uncertainty::SharedError;
use crate::fracture::column_means;
use crate::pipeline::task::Task;
use crate::results_folder::error::WorkflowError;

/// Number of posterior draws. The standard error of a predictive quantile is then a few per cent of the posterior standard
/// deviation.
const DRAWS: usize = 400;

/// Error δ that all specimens of a test share, given the specimens of the calibration.
///
/// The mean of N specimens is ȳ = f + δ + ē with δ ~ Normal(0, S) and ē ~ Normal(0, Σ/N). Given ȳ, δ is normal with the mean
/// K (ȳ − f) and the covariance S − K S, where K = S (S + Σ/N)⁻¹ (Kennedy & O'Hagan 2001, doi:10.1111/1467-9868.00294, for
/// errors of the model that are the same for all data).
///
/// If specimens lack quantities, let P = Σ_k Hᵀ Σ_k⁻¹ H and r = Σ_k Hᵀ Σ_k⁻¹ (y_k − H f), where H selects the recorded quantities
/// of specimen k and Σ_k is their covariance. Then δ has the covariance C = S (1 + P S)⁻¹ and the mean C r.
struct SharedGiven {
    mean: DMatrix<f64>,
    covariance: DMatrix<f64>,
}

impl SharedGiven {
    /// The error, given the quantities of the specimens minus their prediction f (`gaps`; NaN for a missing quantity).
    /// `None` if S + Σ/N or the covariance of the recorded quantities is not positive definite.
    fn new(shared: &DMatrix<f64>, scatter: &DMatrix<f64>, gaps: &[Vec<f64>]) -> Option<Self> {
        let size = shared.nrows();
        if gaps.iter().flatten().all(|gap| !gap.is_nan()) {
            let total = shared + scatter / gaps.len() as f64;
            let gain = total.cholesky()?.solve(shared).transpose();
            let gap = DMatrix::from_vec(size, 1, column_means(gaps));
            let covariance = shared - &gain * shared;
            return Some(Self { mean: gain * gap, covariance });
        }
        let (mut precision, mut weighted) = (DMatrix::zeros(size, size), DMatrix::zeros(size, 1));
        for row in gaps {
            let recorded: Vec<usize> = (0..size).filter(|&m| !row[m].is_nan()).collect();
            let part = scatter.select_rows(&recorded).select_columns(&recorded);
            let inverse = part.cholesky()?.inverse();
            for (a, &i) in recorded.iter().enumerate() {
                for (b, &j) in recorded.iter().enumerate() {
                    precision[(i, j)] += inverse[(a, b)];
                    weighted[(i, 0)] += inverse[(a, b)] * row[j];
                }
            }
        }
        let within = DMatrix::identity(size, size) + shared * precision;
        let covariance = within.lu().solve(shared)?;
        Some(Self { mean: &covariance * weighted, covariance })
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
    let means = column_means(&qois);
    let measured: Vec<Vec<f64>> =
        qois.iter().map(|row| row.iter().zip(&means).map(|(y, mean)| y / mean).collect()).collect();
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
        let gap = |row: &Vec<f64>| row.iter().zip(&relative).map(|(y, f)| y - f).collect();
        let gaps: Vec<Vec<f64>> = measured.iter().map(gap).collect();
        let Some(given) = SharedGiven::new(&shared, &matrix(&draw.scatter), &gaps) else {
            let text = "the scatter of a posterior draw is not positive definite";
            return Err(WorkflowError::Unusable(text.to_owned()));
        };
        predicted.push(relative.iter().zip(given.mean.iter()).map(|(y, e)| y + e).collect());
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
        let gaps = [0.1, 0.5, 0.4, 0.2, 0.25, 0.35].map(|gap| vec![gap]);
        let given = SharedGiven::new(&one(s), &one(scatter), &gaps).unwrap();
        let precision = 1.0 / s + n as f64 / scatter;
        let mean = gap * n as f64 / scatter / precision;
        assert!((given.mean[(0, 0)] - mean).abs() < 1e-12);
        assert!((given.covariance[(0, 0)] - 1.0 / precision).abs() < 1e-12);
        let none = SharedGiven::new(&one(0.0), &one(scatter), &gaps).unwrap();
        assert_eq!((none.mean[(0, 0)], none.covariance[(0, 0)]), (0.0, 0.0));
        assert!(SharedGiven::new(&one(0.0), &one(0.0), &gaps).is_none());
    }

    /// Specimens have two correlated quantities, of which one may be missing. The distribution of the shared error δ
    /// equals the conditional distribution from the joint normal distribution of δ and all recorded quantities.
    #[test]
    fn the_shared_error_is_that_of_the_joint_distribution() {
        let s = DMatrix::from_row_slice(2, 2, &[0.04, 0.01, 0.01, 0.02]);
        let scatter = DMatrix::from_row_slice(2, 2, &[0.09, -0.03, -0.03, 0.05]);
        let nan = f64::NAN;
        let complete = [vec![0.3, 0.1], vec![-0.2, 0.2], vec![0.1, -0.4]];
        let lacking = [vec![0.3, 0.1], vec![nan, 0.2], vec![0.1, nan], vec![-0.5, nan]];
        for gaps in [&complete[..], &lacking[..]] {
            let given = SharedGiven::new(&s, &scatter, gaps).unwrap();
            let places: Vec<(usize, usize)> = (0..gaps.len())
                .flat_map(|k| [(k, 0), (k, 1)])
                .filter(|&(k, m)| !gaps[k][m].is_nan())
                .collect();
            let size = places.len();
            let total = DMatrix::from_fn(size, size, |a, b| {
                let ((k, m), (l, n)) = (places[a], places[b]);
                s[(m, n)] + if k == l { scatter[(m, n)] } else { 0.0 }
            });
            let cross = DMatrix::from_fn(2, size, |i, a| s[(i, places[a].1)]);
            let y = DMatrix::from_fn(size, 1, |a, _| gaps[places[a].0][places[a].1]);
            let gain = &cross * total.try_inverse().unwrap();
            assert!((&given.mean - &gain * y).norm() < 1e-13);
            assert!((&given.covariance - (&s - gain * cross.transpose())).norm() < 1e-13);
        }
    }
}
