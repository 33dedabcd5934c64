//! How the order was chosen and how good the surrogate is.

use std::fmt;

use faer::Mat;
use serde::{Deserialize, Serialize};

use crate::dataset::check_count;
use crate::error::SurrogateError;
use crate::scale::Scale;
use crate::select::{OrderReport, OrderRule, mean};

/// How the order was chosen and how good the surrogate is.
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
    /// Where the scales were chosen: the corrected leave-one-out error, averaged over the outputs, of
    /// the best order with all scales linear.
    pub linear_error: Option<f64>,
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
    /// Covariance (outputs × outputs) of the leave-one-out residuals at the chosen order, on the outputs'
    /// scales.
    pub(crate) loo_covariance: Vec<Vec<f64>>,
    /// RᵀR/(N − P) of the residuals of the fit, on the outputs' scales; with derivatives N − P stands for
    /// the degrees of freedom that the terms leave to the values.
    pub(crate) residual_covariance: Vec<Vec<f64>>,
    /// Where derivatives were fitted too: of each input, the weight of a row of derivatives by its coordinate
    /// on [−1, 1], which is the standard deviation of the values' errors per that of these derivatives'.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub derivative_weights: Vec<f64>,
    /// Where derivatives were fitted too: the covariance of the fit, averaged over the box, on the outputs'
    /// scales.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) mean_covariance: Option<Vec<Vec<f64>>>,
    /// Mean leverage over the box, tr (ΨᵀΨ)⁻¹: inputs uniform on their scales.
    pub mean_leverage: f64,
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

    /// The error of the surrogate of a deterministic model: covariance (outputs × outputs, in their
    /// units) of the leave-one-out residuals, where the outputs are `at`.
    ///
    /// Whoever runs the model again finds it off by this much from the surrogate, because the polynomial
    /// does not match the model. For runs of specimens that differ, it holds their scatter too: see
    /// [`Self::mean_error`].
    ///
    /// On a logarithmic scale residuals are relative, so that the covariance is that of the logarithms
    /// times `at[j] * at[k]`.
    ///
    /// # Errors
    /// Another number of values than of outputs.
    pub fn lack_of_fit(&self, at: &[f64]) -> Result<Vec<Vec<f64>>, SurrogateError> {
        self.in_units(&self.loo_covariance, 1.0, at)
    }

    /// The scatter of the runs about the surrogate: s² = RᵀR/(N − P) (outputs × outputs, in their
    /// units), where the outputs are `at`.
    ///
    /// If each run had a specimen of its own, this is the scatter between specimens at equal inputs.
    ///
    /// # Errors
    /// As [`Self::lack_of_fit`].
    pub fn scatter(&self, at: &[f64]) -> Result<Vec<Vec<f64>>, SurrogateError> {
        self.in_units(&self.residual_covariance, 1.0, at)
    }

    /// The error of the surrogate as the mean response of specimens that differ from run to run:
    /// s² times the mean leverage (outputs × outputs, in their units), where the outputs are `at`.
    ///
    /// Right where the residuals are scatter between specimens and not a polynomial's failure to follow
    /// the model. Where derivatives were fitted too, it is the jackknife's: what leaving out each run changes,
    /// since the errors of a run's value and derivatives hang together. At a place of its own the error is [`Self::scatter`] times
    /// [`PceFit::leverage`](crate::PceFit::leverage) there.
    ///
    /// # Errors
    /// As [`Self::lack_of_fit`].
    pub fn mean_error(&self, at: &[f64]) -> Result<Vec<Vec<f64>>, SurrogateError> {
        match &self.mean_covariance {
            Some(covariance) => self.in_units(covariance, 1.0, at),
            None => self.in_units(&self.residual_covariance, self.mean_leverage, at),
        }
    }

    /// A covariance on the outputs' scales, times a factor, by the derivatives of the outputs there.
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
        )?;
        if !self.derivative_weights.is_empty() {
            let weights: Vec<String> =
                self.derivative_weights.iter().map(|w| format!("{w:.3}")).collect();
            let weights = weights.join(", ");
            writeln!(f, "with derivatives, weighted {weights} against values")?;
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

/// RᵀR over a divisor.
pub(crate) fn mean_products(rows: &Mat<f64>, divisor: f64) -> Vec<Vec<f64>> {
    let m = rows.ncols();
    let entry = |j: usize, k: usize| {
        (0..rows.nrows()).map(|i| rows[(i, j)] * rows[(i, k)]).sum::<f64>() / divisor
    };
    (0..m).map(|j| (0..m).map(|k| entry(j, k)).collect()).collect()
}
