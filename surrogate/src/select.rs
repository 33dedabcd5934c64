//! How good each order is, and which one to take.

use faer::Mat;
use serde::{Deserialize, Serialize};

use crate::error::SurrogateError;
use crate::leave_out::Prefix;
use crate::scale::Scale;

/// How the order of an expansion is chosen. Errors are averaged over the outputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OrderRule {
    /// The least corrected leave-one-out error.
    #[default]
    CorrectedLoo,
    /// The smallest order whose validation error is within a tolerance of the least: see [`Holdout`].
    Split,
    /// This order.
    Fixed(usize),
}

/// Random rows for training, the others for validation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Holdout {
    /// Fraction of the rows used for training.
    pub train_fraction: f64,
    /// An order is good enough if its validation error exceeds the least by at most this fraction of it.
    pub tolerance: f64,
    /// Seed of the random choice of rows.
    pub seed: u64,
}

impl Default for Holdout {
    /// 70 % for training, 5 % tolerance, seed 0.
    fn default() -> Self {
        Self { train_fraction: 0.7, tolerance: 0.05, seed: 0 }
    }
}

impl Holdout {
    pub(crate) fn check(&self) -> Result<(), SurrogateError> {
        let refuse = |option, value: f64, allowed: &str| {
            Err(SurrogateError::Option {
                option,
                value: value.to_string(),
                allowed: allowed.to_owned(),
            })
        };
        if !(self.train_fraction > 0.0 && self.train_fraction < 1.0) {
            return refuse("train_fraction", self.train_fraction, "between 0 and 1");
        }
        if !(self.tolerance >= 0.0 && self.tolerance.is_finite()) {
            return refuse("tolerance of the split", self.tolerance, "0 or more");
        }
        Ok(())
    }
}

/// Leave-one-out errors of one order, per output, as fractions of the output's variance. They are errors
/// of the output itself, whatever its scale.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeaveOneOutError {
    /// mean ((y_i − f_i)/(1 − h_i))² / mean (y_i − ȳ)²; with derivatives, the run's are left out too.
    pub plain: Vec<f64>,
    /// The same times N/(N−P) · (1 + tr (ΨᵀΨ)⁻¹), which charges for few rows per term
    /// (Chapelle, Vapnik & Bengio 2002; Blatman & Sudret 2011, doi:10.1016/j.jcp.2010.12.021). Of an
    /// expansion with [the terms that matter](crate::Terms::Sparse): the error of cross-validation.
    pub corrected: Vec<f64>,
}

impl LeaveOneOutError {
    /// None where some run alone determines a coefficient.
    pub(crate) fn new(prefix: &Prefix, truth: &Truth<'_>) -> Option<Self> {
        let plain = truth.relative_squares(&prefix.loo_residuals()?);
        let corrected = plain.iter().map(|e| e * prefix.correction()).collect();
        Some(Self { plain, corrected })
    }
}

/// Errors of one order fitted to the training rows, per output: mean squares as fractions of the output's variance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SplitError {
    /// On the rows fitted to.
    pub train: Vec<f64>,
    /// On the other rows.
    pub validation: Vec<f64>,
}

/// What is known of one order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrderReport {
    /// The order.
    pub order: usize,
    /// Its number of terms.
    pub terms: usize,
    /// None: not estimable from all rows but one.
    pub loo: Option<LeaveOneOutError>,
    /// None: not estimable from the training rows.
    pub split: Option<SplitError>,
}

/// The least corrected leave-one-out error.
pub(crate) fn by_loo(orders: &[OrderReport]) -> Option<usize> {
    let errors = orders.iter().filter_map(|o| Some((o.order, error(&o.loo.as_ref()?.corrected))));
    Some(errors.min_by(|a, b| a.1.total_cmp(&b.1))?.0)
}

/// The smallest order within the tolerance of the least validation error.
pub(crate) fn by_split(orders: &[OrderReport], tolerance: f64) -> Option<usize> {
    let errors: Vec<_> = orders
        .iter()
        .filter(|o| o.loo.is_some())
        .filter_map(|o| Some((o.order, error(&o.split.as_ref()?.validation))))
        .collect();
    let least = errors.iter().map(|e| e.1).min_by(f64::total_cmp)?;
    errors.iter().find(|e| e.1 <= (1.0 + tolerance) * least).map(|e| e.0)
}

/// The mean over the outputs; below the floor an error is rounding, and orders tie.
pub(crate) fn error(fractions: &[f64]) -> f64 {
    mean(fractions).max(ROUNDING)
}

/// A squared relative error that is rounding.
pub(crate) const ROUNDING: f64 = 1e-24;

pub(crate) fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

/// What residuals are measured by: the outputs' numbers, scales and variances.
pub(crate) struct Truth<'a> {
    /// rows × outputs, in their own units
    pub(crate) y: &'a Mat<f64>,
    pub(crate) scales: &'a [Scale],
    pub(crate) variance: &'a [f64],
}

impl Truth<'_> {
    /// Mean squares, in the outputs' own units, of residuals on their scales, as fractions of the variances.
    pub(crate) fn relative_squares(&self, residuals: &Mat<f64>) -> Vec<f64> {
        let n = residuals.nrows();
        let square =
            |i: usize, m: usize| self.scales[m].residual(self.y[(i, m)], residuals[(i, m)]).powi(2);
        let of = |m: usize| (0..n).map(|i| square(i, m)).sum::<f64>() / n as f64 / self.variance[m];
        (0..self.variance.len()).map(of).collect()
    }
}
