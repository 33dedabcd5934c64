//! How good each order is, and which one to take.

use std::fmt;

use faer::Mat;
use serde::{Deserialize, Serialize};

use crate::error::SurrogateError;
use crate::regression::Prefix;

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

/// Leave-one-out errors of one order, per output, as fractions of the output's variance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeaveOneOutError {
    /// mean ((y_i − f_i)/(1 − h_i))² / mean (y_i − ȳ)².
    pub plain: Vec<f64>,
    /// The same times N/(N−P) · (1 + tr (ΨᵀΨ)⁻¹), which charges for few rows per term
    /// (Chapelle, Vapnik & Bengio 2002; Blatman & Sudret 2011, doi:10.1016/j.jcp.2010.12.021).
    pub corrected: Vec<f64>,
}

impl LeaveOneOutError {
    /// None where some row alone determines a coefficient.
    pub(crate) fn new(prefix: &Prefix, variance: &[f64]) -> Option<Self> {
        let plain = relative_squares(&prefix.loo_residuals()?, variance);
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

/// How the order was chosen and how good the surrogate is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitReport {
    /// Number of rows.
    pub rows: usize,
    /// Number of rows in the training part of the split.
    pub train_rows: usize,
    /// The outputs' names.
    pub outputs: Vec<String>,
    /// Errors of every order that was looked at.
    pub orders: Vec<OrderReport>,
    /// The rule that chose.
    pub rule: OrderRule,
    /// The order chosen.
    pub order: usize,
    /// The order that the corrected leave-one-out error chooses.
    pub order_by_loo: usize,
    /// The order that the split chooses.
    pub order_by_split: usize,
    /// Covariance (outputs × outputs) of the leave-one-out residuals at the chosen order, in the
    /// outputs' units: the surrogate's error for a calibration.
    pub loo_covariance: Vec<Vec<f64>>,
    /// Largest leverage h(x) = ψ(x)ᵀ(ΨᵀΨ)⁻¹ψ(x) of a row.
    pub largest_leverage: f64,
    /// Largest leverage of a corner of the box; None above 10 inputs, which have too many corners.
    pub largest_corner_leverage: Option<f64>,
}

impl FitReport {
    /// The entry of the chosen order.
    pub fn chosen(&self) -> Option<&OrderReport> {
        self.orders.iter().find(|o| o.order == self.order)
    }
}

impl fmt::Display for FitReport {
    /// A table of the orders, errors averaged over the outputs.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "order  terms        LOO  corrected      train  validation")?;
        for o in &self.orders {
            write!(f, "{:5}  {:5}", o.order, o.terms)?;
            match &o.loo {
                Some(loo) => {
                    write!(f, "  {:9.3e}  {:9.3e}", mean(&loo.plain), mean(&loo.corrected))?
                }
                None => write!(f, "  not estimable with {} rows", self.rows)?,
            }
            match &o.split {
                Some(s) => writeln!(f, "  {:9.3e}   {:9.3e}", mean(&s.train), mean(&s.validation))?,
                None if o.loo.is_some() => {
                    writeln!(f, "  not estimable with {} training rows", self.train_rows)?;
                }
                None => writeln!(f)?,
            }
        }
        let rule = match self.rule {
            OrderRule::CorrectedLoo => "corrected leave-one-out",
            OrderRule::Split => "training and validation",
            OrderRule::Fixed(_) => "request",
        };
        writeln!(
            f,
            "order {} by {rule} (leave-one-out: {}, training and validation: {}); errors are fractions of the variance",
            self.order, self.order_by_loo, self.order_by_split
        )
    }
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
fn error(fractions: &[f64]) -> f64 {
    mean(fractions).max(1e-24)
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len() as f64
}

/// Mean squares of the columns as fractions of the variances.
pub(crate) fn relative_squares(residuals: &Mat<f64>, variance: &[f64]) -> Vec<f64> {
    let n = residuals.nrows() as f64;
    variance
        .iter()
        .enumerate()
        .map(|(m, v)| residuals.col(m).iter().map(|r| r * r).sum::<f64>() / n / v)
        .collect()
}

/// The covariance of the rows, with divisor n − 1.
pub(crate) fn covariance(rows: &Mat<f64>) -> Vec<Vec<f64>> {
    let (n, m) = rows.shape();
    let means: Vec<f64> = (0..m).map(|j| rows.col(j).iter().sum::<f64>() / n as f64).collect();
    let entry = |j: usize, k: usize| {
        (0..n).map(|i| (rows[(i, j)] - means[j]) * (rows[(i, k)] - means[k])).sum::<f64>()
            / (n - 1) as f64
    };
    (0..m).map(|j| (0..m).map(|k| entry(j, k)).collect()).collect()
}
