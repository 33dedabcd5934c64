//! Errors of a forward model that all specimens share.

/// A covariance (quantities × quantities) relative to the quantities' means.
pub(crate) fn relative(covariance: Vec<Vec<f64>>, means: &[f64]) -> Vec<Vec<f64>> {
    let row =
        |(row, a): (Vec<f64>, &f64)| row.iter().zip(means).map(|(c, b)| c / (a * b)).collect();
    covariance.into_iter().zip(means).map(row).collect()
}
