//! Errors of each order, and the rules that choose an order.

use faer::Mat;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::SurrogateError;
use crate::fit::leave_out::Prefix;
use crate::scale::Scale;

/// Rule that chooses the order of an expansion. Errors are averaged over the outputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum OrderRule {
    /// The order with the least corrected leave-one-out error.
    #[default]
    CorrectedLoo,
    /// The lowest order whose validation error exceeds the smallest validation error by at most a
    /// tolerance, see [`Holdout`].
    Split,
    /// The given order.
    Fixed(usize),
}

/// A random split of the rows into training and validation rows.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Holdout {
    /// Fraction of the rows used for training.
    pub train_fraction: f64,
    /// Tolerance of the validation error, as a fraction: the split chooses the lowest order whose validation error is
    /// at most (1 + tolerance) times the smallest validation error of any order.
    pub tolerance: f64,
    /// Seed of the random split.
    pub seed: u64,
}

impl Default for Holdout {
    /// Default split: 70 % of the rows for training, 5 % tolerance, seed 0.
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

/// Leave-one-out errors of one order, one per output, as fractions of the output's variance. The errors are in the unit
/// of the output, even if the output is on a logarithmic scale.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeaveOneOutError {
    /// The error mean ((y_i − f_i)/(1 − h_i))² / mean (y_i − ȳ)² over the runs i, with the output y_i, its mean ȳ, the
    /// fit f_i and the leverage h_i. With derivatives, the value and the derivatives of run i are left out together.
    pub plain: Vec<f64>,
    /// The plain error times Chapelle's correction N/(N − P) · (1 + tr (ΨᵀΨ)⁻¹) for N runs, P terms and the basis
    /// matrix Ψ. The correction is a penalty for few rows per term (Chapelle, Vapnik & Bengio 2002; Blatman & Sudret
    /// 2011, doi:10.1016/j.jcp.2010.12.021). For an expansion with [sparse terms](crate::Terms::Sparse), this is the
    /// error of cross-validation instead.
    pub corrected: Vec<f64>,
}

impl LeaveOneOutError {
    /// Computes the errors of a fit. None if a single run alone determines a coefficient.
    pub(crate) fn new(prefix: &Prefix, truth: &Truth<'_>) -> Option<Self> {
        let plain = truth.relative_squares(&prefix.loo_residuals()?);
        let corrected = plain.iter().map(|e| e * prefix.correction()).collect();
        Some(Self { plain, corrected })
    }
}

/// Errors of one order that was fitted to the training rows, one per output. The errors are mean squared errors as
/// fractions of the output's variance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SplitError {
    /// Error on the training rows.
    pub train: Vec<f64>,
    /// Error on the validation rows.
    pub validation: Vec<f64>,
}

/// Errors of one order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OrderReport {
    /// Order of the expansion.
    pub order: usize,
    /// Number of terms of an expansion of this order.
    pub terms: usize,
    /// Leave-one-out error. None if some coefficients are undetermined when a single run is left out.
    pub loo: Option<LeaveOneOutError>,
    /// Training and validation errors. None if the training rows do not determine the coefficients of the order.
    pub split: Option<SplitError>,
}

/// Returns the order with the least corrected leave-one-out error; None if no order can be estimated.
pub(crate) fn by_loo(orders: &[OrderReport]) -> Option<usize> {
    let errors = orders.iter().filter_map(|o| Some((o.order, error(&o.loo.as_ref()?.corrected))));
    Some(errors.min_by(|a, b| a.1.total_cmp(&b.1))?.0)
}

/// Returns the lowest order whose validation error exceeds the smallest validation error by at most
/// the tolerance.
pub(crate) fn by_split(orders: &[OrderReport], tolerance: f64) -> Option<usize> {
    let errors: Vec<_> = orders
        .iter()
        .filter(|o| o.loo.is_some())
        .filter_map(|o| Some((o.order, error(&o.split.as_ref()?.validation))))
        .collect();
    let least = errors.iter().map(|e| e.1).min_by(f64::total_cmp)?;
    errors.iter().find(|e| e.1 <= (1.0 + tolerance) * least).map(|e| e.0)
}

/// The mean error over the outputs, at least [`ROUNDING`]: orders whose error is only rounding error are
/// equally good.
pub(crate) fn error(fractions: &[f64]) -> f64 {
    mean(fractions).max(ROUNDING)
}

/// Squared relative error below which an error consists only of rounding errors.
pub(crate) const ROUNDING: f64 = 1e-24;

pub(crate) fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

/// Data to which a fit is compared: values, scales and variances of the outputs.
pub(crate) struct Truth<'a> {
    /// Values of the outputs in their units, rows × outputs.
    pub(crate) y: &'a Mat<f64>,
    pub(crate) scales: &'a [Scale],
    pub(crate) variance: &'a [f64],
}

impl Truth<'_> {
    /// Converts residuals to the outputs' units and returns their mean squares, as fractions of the outputs'
    /// variances. `residuals` are on the outputs' linear or logarithmic scales, rows × outputs.
    pub(crate) fn relative_squares(&self, residuals: &Mat<f64>) -> Vec<f64> {
        let n = residuals.nrows();
        let square =
            |i: usize, m: usize| self.scales[m].residual(self.y[(i, m)], residuals[(i, m)]).powi(2);
        let relative =
            |m: usize| (0..n).map(|i| square(i, m)).sum::<f64>() / n as f64 / self.variance[m];
        (0..self.variance.len()).map(relative).collect()
    }
}
