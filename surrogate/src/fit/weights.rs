//! Weights of derivatives relative to values in the least squares problem.
//!
//! Values scatter about the polynomial with the standard deviation σ_v, derivatives with respect to the j-th
//! coordinate with the standard deviation σ_j. The best linear fit weights rows by 1/σ, so that only the ratios
//! σ_v/σ_j matter. Each variance is estimated as the sum of squared residuals divided by the degrees of freedom of
//! its rows, and the fit is repeated until the ratios converge (Förstner's estimate of variance components, Z.
//! Vermessungswesen 104 (1979) 149). The converged estimate is the restricted maximum likelihood estimate.
//!
//! No fixed ratio is good for all models. For a smooth deterministic model, the truncation error at order p is larger
//! for the derivative than for the value, by a factor that grows like p^(3/2); a weight of 0.3 is suitable for order
//! 3. If each run is on a different random specimen, values may scatter by several percent and logarithmic
//! derivatives much less, so that the derivatives determine most of the fit. Example: with 3 % scatter of values, 1 %
//! scatter of derivatives, 30 runs and order 3, the weight 0.3 gives two to six times the squared error of the
//! estimated weights. A separate ratio for each input causes no additional cost. Separate ratios improve the fit for
//! inputs with little influence, whose derivatives scatter least.

use crate::fit::design_matrix::{Equations, Regression};
use crate::fit::leave_out::{Prefix, row_of};
use crate::fit::regression::NestedLeastSquares;
use crate::fit::select::{LeaveOneOutError, OrderRule, ROUNDING, Truth, error};

/// Largest number of rounds; each round fits the expansion and estimates the weights.
const ROUNDS: usize = 10;
/// Ratios that change by less than this fraction have converged.
const SETTLED: f64 = 0.05;

/// Range of weights. Weights outside this range would cause rounding errors, and rows with such weights have
/// practically no influence or are fitted exactly.
const RANGE: std::ops::RangeInclusive<f64> = 1e-3..=1e3;

/// The fits of all orders to all runs.
pub(crate) struct WeightedFit {
    pub(crate) fit: NestedLeastSquares,
    /// Fits of all orders for which the number of runs is sufficient.
    pub(crate) prefixes: Vec<Prefix>,
    /// Weight σ_v/σ_j of the derivatives with respect to the coordinate of each input j on [−1, 1]: standard deviation
    /// of the errors of the values, divided by the standard deviation of the errors of the derivatives. Empty without
    /// derivatives.
    pub(crate) weights: Vec<f64>,
}

/// Fits all orders and estimates the weights of derivatives. The weights are estimated from the residuals of the
/// order that `rule` fixes, or otherwise of the order with the least corrected leave-one-out error.
pub(crate) fn fit_weighted(
    regression: &Regression<'_>,
    equations: &Equations,
    truth: &Truth<'_>,
    rule: OrderRule,
) -> WeightedFit {
    let all: Vec<usize> = (0..equations.runs()).collect();
    let variances = equations.variances();
    let first = equations.values_per_slope(&variances);
    let mut weights: Vec<f64> = first.into_iter().map(|weight| limited(weight, 1.0)).collect();
    for round in 1.. {
        let fit = equations.least_squares(&all, &weights);
        let prefixes = fit.sweep(&regression.sizes(&fit));
        let next = match best(&prefixes, truth, rule) {
            Some(prefix) if !weights.is_empty() && round < ROUNDS => {
                estimate(prefix, &variances, &weights)
            }
            _ => weights.clone(),
        };
        let moved = |(a, b): (&f64, &f64)| (a / b).ln().abs() > SETTLED;
        if !next.iter().zip(&weights).any(moved) {
            return WeightedFit { fit, prefixes, weights };
        }
        weights = next;
    }
    unreachable!("the last round keeps its weights")
}

fn best<'a>(prefixes: &'a [Prefix], truth: &Truth<'_>, rule: OrderRule) -> Option<&'a Prefix> {
    if let OrderRule::Fixed(order) = rule {
        return prefixes.get(order);
    }
    let errors = prefixes.iter().filter_map(|prefix| {
        Some((prefix, error(&LeaveOneOutError::new(prefix, truth)?.corrected)))
    });
    Some(errors.min_by(|a, b| a.1.total_cmp(&b.1))?.0)
}

/// Estimates the weights σ_v/σ_j (see [`WeightedFit::weights`]) from the residuals of a fit. Squared residuals are
/// averaged over the outputs as fractions of the outputs' variances, so that outputs which the polynomial fits exactly
/// have no influence.
fn estimate(prefix: &Prefix, variances: &[f64], weights: &[f64]) -> Vec<f64> {
    let (runs, block) = (prefix.runs, weights.len() + 1);
    let spread = |row_in_block: usize, weight: f64| {
        let square = |run: usize| -> f64 {
            let row = row_of(runs, block, run, row_in_block);
            let relative =
                |(m, variance): (usize, &f64)| prefix.residuals[(row, m)].powi(2) / variance;
            variances.iter().enumerate().map(relative).sum()
        };
        let freedom = runs as f64 - prefix.leverage_at(row_in_block);
        let sum: f64 = (0..runs).map(square).sum();
        sum / freedom / variances.len() as f64 / (weight * weight) + ROUNDING
    };
    let value = spread(block - 1, 1.0);
    let ratio = |(j, &weight): (usize, &f64)| limited((value / spread(j, weight)).sqrt(), weight);
    weights.iter().enumerate().map(ratio).collect()
}

/// Clamps a weight to [`RANGE`]. Returns `before` if the weight is not finite, as for rows without degrees of
/// freedom.
fn limited(weight: f64, before: f64) -> f64 {
    if weight.is_finite() { weight.clamp(*RANGE.start(), *RANGE.end()) } else { before }
}
