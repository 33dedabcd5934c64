//! Fits every order and computes its errors. All orders share one QR factorisation.

use std::rc::Rc;

use faer::Mat;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::error::SurrogateError;
use crate::fit::design_matrix::{Equations, Regression};
use crate::fit::leave_out::Prefix;
use crate::fit::regression::NestedLeastSquares;
use crate::fit::scale_choice::ChosenScales;
use crate::fit::select::{Holdout, LeaveOneOutError, OrderReport, OrderRule, SplitError, Truth};
use crate::fit::weights::{WeightedFit, fit_weighted};

/// Fits and errors of all orders that were tried.
pub(crate) struct Orders {
    /// Errors of order 0, 1, ….
    pub(crate) reports: Vec<OrderReport>,
    /// Fits of all orders for which the number of runs is sufficient.
    pub(crate) fitted: Vec<Fitted>,
    /// Number of training rows of the split.
    pub(crate) train: usize,
    /// Weights of the rows of derivatives, one per input with derivatives.
    pub(crate) weights: Vec<f64>,
}

/// The fit of an order.
pub(crate) struct Fitted {
    pub(crate) fit: Rc<NestedLeastSquares>,
    pub(crate) prefix: Prefix,
    /// Multi-indices of the columns of `fit`; the terms of this order are the first `prefix.terms` columns.
    pub(crate) columns: Rc<Vec<Vec<u8>>>,
    /// Residuals of cross-validation (runs × outputs) for sparse terms, whose leave-one-out residuals would be too
    /// small; None if the fit has all terms.
    pub(crate) cross_validated: Option<Mat<f64>>,
}

/// Fits every order with all terms of the regression's truncation.
///
/// # Errors
/// The errors of [`Regression::equations`].
pub(crate) fn all_terms(
    regression: &Regression<'_>,
    scales: &ChosenScales,
    truth: &Truth<'_>,
    (rule, split): (OrderRule, &Holdout),
) -> Result<Orders, SurrogateError> {
    let equations = regression.equations(&scales.inputs, &scales.outputs)?;
    let counts = &regression.counts;
    let WeightedFit { fit, prefixes, weights } = fit_weighted(regression, &equations, truth, rule);
    let (train, splits) = split_errors(&equations, &weights, counts, truth, split);
    let report = |(order, &terms): (usize, &usize)| OrderReport {
        order,
        terms,
        loo: prefixes.get(order).and_then(|p| LeaveOneOutError::new(p, truth)),
        split: splits.get(order).cloned(),
    };
    let reports = counts.iter().enumerate().map(report).collect();
    let (fit, columns) = (Rc::new(fit), Rc::new(regression.columns.clone()));
    let fitted = |prefix| Fitted {
        fit: Rc::clone(&fit),
        prefix,
        columns: Rc::clone(&columns),
        cross_validated: None,
    };
    let fitted = prefixes.into_iter().map(fitted).collect();
    Ok(Orders { reports, fitted, train, weights })
}

/// Returns the number of training rows of the split, and the training and validation errors of each order whose
/// coefficients the training rows determine.
pub(crate) fn split_errors(
    equations: &Equations,
    weights: &[f64],
    counts: &[usize],
    truth: &Truth<'_>,
    split: &Holdout,
) -> (usize, Vec<SplitError>) {
    let n = equations.runs();
    let mut order: Vec<usize> = (0..n).collect();
    order.shuffle(&mut Xoshiro256PlusPlus::seed_from_u64(split.seed));
    let (train, validation) =
        order.split_at(((split.train_fraction * n as f64).round() as usize).clamp(1, n - 1));
    let error = |residuals: &Mat<f64>, chosen: &[usize]| {
        let y = Mat::from_fn(chosen.len(), truth.y.ncols(), |i, m| truth.y[(chosen[i], m)]);
        Truth { y: &y, ..*truth }.relative_squares(residuals)
    };

    let Equations { rows, targets, .. } = equations;
    let fit = equations.least_squares(train, weights);
    let sizes: Vec<usize> = counts.iter().copied().filter(|&terms| terms <= fit.rank()).collect();
    let errors = fit.sweep(&sizes).into_iter().map(|prefix| {
        let c = fit.coefficients(prefix.terms);
        let residuals = Mat::from_fn(validation.len(), targets.ncols(), |i, m| {
            let row = &rows[validation[i]];
            targets[(validation[i], m)] - (0..prefix.terms).map(|j| row[j] * c[(j, m)]).sum::<f64>()
        });
        SplitError {
            train: error(&prefix.value_residuals(), train),
            validation: error(&residuals, validation),
        }
    });
    (train.len(), errors.collect())
}
