//! How much a derivative counts against a value.
//!
//! Values scatter about a polynomial by σ_v, derivatives by the j-th coordinate by σ_j. The best linear
//! fit weights rows by 1/σ, and only the ratios σ_v/σ_j matter. They are estimated from the residuals,
//! each sum of squares over the degrees of freedom that the terms leave to its rows, and the fit is
//! repeated until they settle (Förstner's estimate of variance components, Z. Vermessungswesen 104 (1979)
//! 149; at rest it is the restricted maximum likelihood).
//!
//! No fixed ratio would do. Of what a smooth model has beyond order p, the derivative is larger than the
//! value, like p^(3/2), and a weight of 0.3 suits order 3; but if each run has a packing of its own, values
//! scatter by per cents where logarithmic derivatives hardly do, and then it is the derivatives that know
//! the response: with 3 and 1 %, 30 runs and order 3, the weight of 0.3 leaves twice to six times the
//! squared error of the estimated ones. Ratios for each input cost nothing and serve inputs that matter
//! little, whose derivatives are known best.

use crate::design_matrix::{Equations, Regression};
use crate::leave_out::{Prefix, row_of};
use crate::regression::NestedLeastSquares;
use crate::select::{LeaveOneOutError, OrderRule, ROUNDING, Truth, error};

/// Rounds of fit and estimate; ratios that moved by less than [`SETTLED`] are at rest.
const ROUNDS: usize = 10;
const SETTLED: f64 = 0.05;

/// Weights beyond these would cost digits: rows that count so little, or so much, are as good as absent
/// or exact.
const RANGE: std::ops::RangeInclusive<f64> = 1e-3..=1e3;

/// All orders fitted to all runs.
pub(crate) struct WeightedFit {
    pub(crate) fit: NestedLeastSquares,
    /// Of the orders that the runs determine.
    pub(crate) prefixes: Vec<Prefix>,
    /// σ_v/σ_j of each input's coordinate on [−1, 1]; empty without derivatives.
    pub(crate) weights: Vec<f64>,
}

/// Fits with weights that suit the order which the rule asks for, or else that of the least corrected
/// leave-one-out error.
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

/// The ratios that the residuals of a fit tell: squares averaged over the outputs as fractions of their
/// variances, so that outputs without error do not decide.
fn estimate(prefix: &Prefix, variances: &[f64], weights: &[f64]) -> Vec<f64> {
    let (runs, block) = (prefix.runs, weights.len() + 1);
    let spread = |place: usize, weight: f64| {
        let square = |run: usize| -> f64 {
            let row = row_of(runs, block, run, place);
            let of = |(m, variance): (usize, &f64)| prefix.residuals[(row, m)].powi(2) / variance;
            variances.iter().enumerate().map(of).sum()
        };
        let freedom = runs as f64 - prefix.leverage_at(place);
        let sum: f64 = (0..runs).map(square).sum();
        sum / freedom / variances.len() as f64 / (weight * weight) + ROUNDING
    };
    let value = spread(block - 1, 1.0);
    let ratio = |(j, &weight): (usize, &f64)| limited((value / spread(j, weight)).sqrt(), weight);
    weights.iter().enumerate().map(ratio).collect()
}

/// The weight within the range; the one before where rows without freedom tell none.
fn limited(weight: f64, before: f64) -> f64 {
    if weight.is_finite() { weight.clamp(*RANGE.start(), *RANGE.end()) } else { before }
}
