//! The report of a fit: errors of every order and of the surrogate.

use std::fmt;

use faer::Mat;
use serde::{Deserialize, Serialize};

use crate::dataset::check_count;
use crate::error::SurrogateError;
use crate::fit::select::{OrderReport, OrderRule, mean};
use crate::scale::Scale;

/// Errors of every order, the choice of the order, and errors of the surrogate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitReport {
    /// Number of rows.
    pub rows: usize,
    /// Number of rows in the training part of the split.
    pub train_rows: usize,
    /// The outputs' names.
    pub outputs: Vec<String>,
    /// Names of the inputs and outputs on a logarithmic scale.
    pub logarithmic: Vec<String>,
    /// Corrected leave-one-out error of the best order if all scales are linear, averaged over the outputs.
    /// None if the scales were not chosen automatically.
    pub linear_error: Option<f64>,
    /// Errors of every order that was tried.
    pub orders: Vec<OrderReport>,
    /// The rule that chose the order.
    pub rule: OrderRule,
    /// The chosen order.
    pub order: usize,
    /// The order with the least corrected leave-one-out error.
    pub order_by_loo: usize,
    /// The order that [`OrderRule::Split`] chooses, from the errors on training and validation rows.
    pub order_by_split: usize,
    /// Covariance (outputs × outputs) of the leave-one-out residuals at the chosen order, on the outputs'
    /// scales.
    pub(crate) loo_covariance: Vec<Vec<f64>>,
    /// Covariance RᵀR/(N − P) of the residuals R of the fit with N runs and P terms, on the outputs' scales. With
    /// derivatives, R contains only the residuals of the values, and N − P is replaced by the degrees of freedom of
    /// these residuals.
    pub(crate) residual_covariance: Vec<Vec<f64>>,
    /// Weights of the rows of derivatives in the fit, one per input; empty without derivatives. The weight of input j
    /// is σ_v/σ_j. σ_v is the standard deviation of the errors of the values. σ_j is the standard deviation of the
    /// errors of the derivatives with respect to coordinate j on [−1, 1].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub derivative_weights: Vec<f64>,
    /// Jackknife covariance of the error of the fit, averaged over the box, on the outputs' scales; None if no
    /// derivatives were fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) mean_covariance: Option<Vec<Vec<f64>>>,
    /// Leverage averaged over the box, for inputs that are uniform on their scales. The average is tr (ΨᵀΨ)⁻¹, where Ψ
    /// contains the values of the basis polynomials at the runs. See [`PceFit::leverage`](crate::PceFit::leverage).
    pub mean_leverage: f64,
    /// Largest leverage of any row; see [`PceFit::leverage`](crate::PceFit::leverage).
    pub largest_leverage: f64,
    /// Largest leverage at a corner of the box; None for more than 10 inputs, because the number of corners is
    /// 2^inputs.
    pub largest_corner_leverage: Option<f64>,
}

impl FitReport {
    /// The errors of the chosen order.
    pub fn chosen(&self) -> Option<&OrderReport> {
        self.orders.iter().find(|o| o.order == self.order)
    }

    /// Error of the surrogate as a prediction of a single run: covariance of the leave-one-out residuals (outputs ×
    /// outputs, in the outputs' units).
    ///
    /// For a deterministic model this is the lack of fit: the difference between model and polynomial. If the
    /// specimens differ between runs, this covariance also includes the scatter of the specimens; for the
    /// error of the mean response over specimens see [`Self::mean_error`].
    ///
    /// On a logarithmic scale residuals are relative: entry (j, k) of the covariance of the logarithms is multiplied by
    /// the output values `at[j]` and `at[k]`.
    ///
    /// # Errors
    /// If `at` does not have one value per output.
    pub fn lack_of_fit(&self, at: &[f64]) -> Result<Vec<Vec<f64>>, SurrogateError> {
        self.in_units(&self.loo_covariance, 1.0, at)
    }

    /// Scatter of the runs about the surrogate: s² = RᵀR/(N − P) (outputs × outputs, in the outputs' units), for the
    /// residuals R of N runs and P terms. The output values `at` are needed to convert from a logarithmic scale.
    ///
    /// If each run has a separate specimen, this covariance is the scatter between specimens at
    /// equal inputs.
    ///
    /// # Errors
    /// If `at` does not have one value per output.
    pub fn scatter(&self, at: &[f64]) -> Result<Vec<Vec<f64>>, SurrogateError> {
        self.in_units(&self.residual_covariance, 1.0, at)
    }

    /// Error of the surrogate as an estimate of the mean response over specimens, if each run has a separate
    /// specimen: s² times the mean leverage (outputs × outputs, in the outputs' units). The output values `at` are
    /// needed to convert from a logarithmic scale.
    ///
    /// This error estimate assumes that the residuals are scatter between specimens and not lack of fit of the
    /// polynomial. If derivatives were fitted too, the result is the jackknife covariance instead, because the errors
    /// within a run are correlated. The error at a single point is [`Self::scatter`] times
    /// [`PceFit::leverage`](crate::PceFit::leverage) at that point.
    ///
    /// # Errors
    /// If `at` does not have one value per output.
    pub fn mean_error(&self, at: &[f64]) -> Result<Vec<Vec<f64>>, SurrogateError> {
        match &self.mean_covariance {
            Some(covariance) => self.in_units(covariance, 1.0, at),
            None => self.in_units(&self.residual_covariance, self.mean_leverage, at),
        }
    }

    /// Converts a covariance on the outputs' scales, times `factor`, to the outputs' units at the values
    /// `at`.
    fn in_units(
        &self,
        covariance: &[Vec<f64>],
        factor: f64,
        at: &[f64],
    ) -> Result<Vec<Vec<f64>>, SurrogateError> {
        check_count("output values", self.outputs.len(), at.len())?;
        let slope = |(name, &y): (&String, &f64)| {
            let scale = if self.logarithmic.contains(name) { Scale::Log } else { Scale::Linear };
            scale.slope_at(y)
        };
        let slopes: Vec<f64> = self.outputs.iter().zip(at).map(slope).collect();
        let row = |(row, a): (&Vec<f64>, &f64)| {
            row.iter().zip(&slopes).map(|(c, b)| factor * a * b * c).collect()
        };
        Ok(covariance.iter().zip(&slopes).map(row).collect())
    }
}

impl fmt::Display for FitReport {
    /// Writes a table of the orders, with errors averaged over the outputs.
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
        )?;
        if !self.derivative_weights.is_empty() {
            let weights: Vec<String> =
                self.derivative_weights.iter().map(|w| format!("{w:.3}")).collect();
            let weights = weights.join(", ");
            writeln!(f, "with derivatives; their weights relative to values: {weights}")?;
        }
        if let (false, Some(linear)) = (self.logarithmic.is_empty(), self.linear_error) {
            let names = self.logarithmic.join(", ");
            writeln!(f, "logarithmic: {names}; without logarithms corrected LOO is {linear:.3e}")?;
        }
        Ok(())
    }
}

/// The covariance of the rows, with divisor n − 1.
pub(crate) fn covariance(rows: &Mat<f64>) -> Vec<Vec<f64>> {
    let n = rows.nrows();
    let means: Vec<f64> = rows.col_iter().map(|c| c.iter().sum::<f64>() / n as f64).collect();
    let centred = Mat::from_fn(n, rows.ncols(), |i, j| rows[(i, j)] - means[j]);
    mean_products(&centred, (n - 1) as f64)
}

/// Returns RᵀR/`divisor` for the matrix R = `rows`.
pub(crate) fn mean_products(rows: &Mat<f64>, divisor: f64) -> Vec<Vec<f64>> {
    let m = rows.ncols();
    let entry = |j: usize, k: usize| {
        (0..rows.nrows()).map(|i| rows[(i, j)] * rows[(i, k)]).sum::<f64>() / divisor
    };
    (0..m).map(|j| (0..m).map(|k| entry(j, k)).collect()).collect()
}
