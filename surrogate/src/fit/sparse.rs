//! Sparse expansions: the selection of a subset of candidate terms. There can be more candidates than runs.

use std::rc::Rc;

use faer::{Col, Mat, unzip, zip};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::error::SurrogateError;
use crate::fit::design_matrix::{Equations, Regression};
use crate::fit::orders::{Fitted, Orders, split_errors};
use crate::fit::scale_choice::ChosenScales;
use crate::fit::select::{Holdout, LeaveOneOutError, OrderReport, OrderRule, Truth, error};
use crate::fit::weights::fit_weighted;
use crate::multi_index::Truncation;

/// Exponents q of the hyperbolic truncations that are tried in addition to the requested truncation. A
/// smaller exponent gives fewer candidate terms with interactions of inputs.
const EXPONENTS: [f64; 3] = [0.4, 0.6, 0.8];

/// Largest number of candidate terms; with more candidates, a fit would take minutes.
const MOST_CANDIDATES: usize = 6000;

/// Number of folds of the cross-validation.
const FOLDS: usize = 10;

/// Smallest number of least squares rows per term of a sparse fit.
const ROWS_PER_TERM: usize = 2;

/// Relative squared norm below which a column is linearly dependent on the chosen columns: after subtraction of its
/// projection onto the chosen columns, less than this fraction of its squared norm remains.
const DEPENDENT: f64 = 1e-12;

/// The best sparse fit of one order for one truncation.
struct Candidate {
    error: f64,
    loo: LeaveOneOutError,
    fitted: Fitted,
    equations: Equations,
}

/// Fits every order of the regression with its best sparse subset of terms.
///
/// # Errors
/// The errors of [`Regression::equations`].
pub(crate) fn sparse(
    regression: &Regression<'_>,
    scales: &ChosenScales,
    truth: &Truth<'_>,
    (rule, split): (OrderRule, &Holdout),
) -> Result<Orders, SurrogateError> {
    // the weights of derivatives come from the fits with all terms
    let dense = regression.equations(&scales.inputs, &scales.outputs)?;
    let weights = fit_weighted(regression, &dense, truth, rule).weights;
    let folds = folds(dense.runs(), split.seed);
    let mut orders =
        Orders { reports: Vec::new(), fitted: Vec::new(), train: 0, weights: weights.clone() };
    for order in 0..regression.counts.len() {
        let mut best: Option<Candidate> = None;
        let mut before = None;
        for truncation in truncations(regression.truncation) {
            let wider = regression.with_order(truncation, order, MOST_CANDIDATES);
            let Some(wider) = wider.filter(|w| before != Some(w.columns.len())) else { continue };
            before = Some(wider.columns.len());
            let equations = wider.equations(&scales.inputs, &scales.outputs)?;
            let next = candidate(&wider, &equations, truth, &weights, &folds);
            if let Some(next) = next
                && best.as_ref().is_none_or(|best| next.error < best.error)
            {
                best = Some(next);
            }
        }
        let Some(Candidate { loo, fitted, equations, .. }) = best else { break };
        let terms = fitted.prefix.terms;
        let (train, splits) = split_errors(&equations, &weights, &[terms], truth, split);
        let split = splits.into_iter().next();
        orders.reports.push(OrderReport { order, terms, loo: Some(loo), split });
        orders.fitted.push(fitted);
        orders.train = train;
    }
    Ok(orders)
}

/// Returns the truncations to try, from the truncation with the fewest interaction terms to the requested truncation.
fn truncations(requested: Truncation) -> impl Iterator<Item = Truncation> {
    let most = match requested {
        Truncation::TotalDegree => 1.0,
        Truncation::Hyperbolic { q } => q,
        // no hyperbolic truncation is tried, because its terms can exceed the limited degree of the input
        Truncation::Limited { .. } => 0.0,
    };
    let fewer = EXPONENTS.into_iter().filter(move |q| *q < most);
    fewer.map(|q| Truncation::Hyperbolic { q }).chain([requested])
}

/// Finds the sparse fit whose number of terms has the least cross-validation error. During cross-validation, the
/// terms are selected separately for each fold. The final fit has the same number of terms, which are selected with
/// all runs.
fn candidate(
    regression: &Regression<'_>,
    equations: &Equations,
    truth: &Truth<'_>,
    weights: &[f64],
    folds: &[Vec<usize>],
) -> Option<Candidate> {
    let runs = equations.runs();
    let residuals = cross_validate(equations, weights, folds);
    let errors = residuals.iter().map(|r| error(&truth.relative_squares(r))).enumerate();
    let (index, error) = errors.min_by(|a, b| a.1.total_cmp(&b.1))?;

    let all: Vec<usize> = (0..runs).collect();
    let path = forward(equations, &all, weights, index + 1);
    let equations = equations.with_columns(&path);
    let fit = equations.least_squares(&all, weights);
    let prefix = fit.sweep(&[path.len().min(fit.rank())]).pop()?;
    let plain = LeaveOneOutError::new(&prefix, truth)?.plain;
    let left_out = residuals.into_iter().nth(index)?;
    let loo = LeaveOneOutError { plain, corrected: truth.relative_squares(&left_out) };
    let columns = path.iter().map(|&j| regression.columns[j].clone()).collect();
    let fitted = Fitted {
        fit: Rc::new(fit),
        prefix,
        columns: Rc::new(columns),
        cross_validated: Some(left_out),
    };
    Some(Candidate { error, loo, fitted, equations })
}

/// Returns the cross-validation residuals (runs × outputs) of the fits with one term, two terms, …. For each fold,
/// the terms are selected with the runs of the other folds and fitted to these runs.
fn cross_validate(equations: &Equations, weights: &[f64], folds: &[Vec<usize>]) -> Vec<Mat<f64>> {
    let runs = equations.runs();
    let mut all: Vec<Mat<f64>> = Vec::new();
    for (fold_index, fold) in folds.iter().enumerate() {
        let others: Vec<usize> = (0..runs).filter(|run| !fold.contains(run)).collect();
        let most = others.len() * (1 + weights.len()) / ROWS_PER_TERM;
        let path = forward(equations, &others, weights, most.max(1));
        let chosen = equations.with_columns(&path);
        let fit = chosen.least_squares(&others, weights);
        let terms = path.len().min(fit.rank());
        if fold_index == 0 {
            all = vec![equations.targets.get(..runs, ..).to_owned(); terms];
        }
        all.truncate(terms);
        for (terms, residuals) in (1..).zip(&mut all) {
            let c = fit.coefficients(terms);
            for &run in fold {
                for m in 0..c.ncols() {
                    let row = chosen.rows[run].iter().zip(c.col(m).iter());
                    residuals[(run, m)] -= row.map(|(psi, c)| psi * c).sum::<f64>();
                }
            }
        }
    }
    all
}

/// Forward selection of columns by orthogonal least squares on the rows of the chosen runs. Returns at most `most`
/// columns in order of selection. The first column is the constant; each further column is the column that reduces
/// the residuals of the targets most. Squared residuals are summed over the targets, as fractions of the targets'
/// variances.
fn forward(equations: &Equations, chosen: &[usize], weights: &[f64], most: usize) -> Vec<usize> {
    let (columns, mut left) = equations.weighted(chosen, weights);
    for (target, variance) in left.col_iter_mut().zip(&equations.variances()) {
        target.iter_mut().for_each(|y| *y /= variance.sqrt());
    }
    // for each column, after subtraction of its projection onto the chosen columns: its squared norm (`square`), and
    // its products with the targets (`products`)
    let squared_norms: Vec<f64> = columns.col_iter().map(|c| c.squared_norm_l2()).collect();
    let mut square = squared_norms.clone();
    let mut products = columns.transpose() * &left;
    let mut directions: Vec<Col<f64>> = Vec::new();
    let mut path = vec![0];
    while let Some(&last) = path.last() {
        let mut direction = columns.col(last).to_owned();
        // one repetition makes the directions orthogonal to working precision (Kahan's "twice is enough")
        for before in directions.iter().chain(&directions) {
            let along = before.transpose() * &direction;
            zip!(&mut direction, before).for_each(|unzip!(x, b)| *x -= along * b);
        }
        let norm = direction.norm_l2();
        direction.iter_mut().for_each(|x| *x /= norm);
        let taken: Vec<f64> = left.col_iter().map(|y| direction.transpose() * y).collect();
        for (target, taken) in left.col_iter_mut().zip(&taken) {
            zip!(target, &direction).for_each(|unzip!(y, d)| *y -= taken * d);
        }
        for j in 0..columns.ncols() {
            let along = columns.col(j).transpose() * &direction;
            square[j] -= along * along;
            taken.iter().enumerate().for_each(|(m, taken)| products[(j, m)] -= along * taken);
        }
        square[last] = 0.0;
        directions.push(direction);
        let gain = |j: usize| {
            let sum: f64 = (0..taken.len()).map(|m| products[(j, m)].powi(2)).sum();
            (square[j] > DEPENDENT * squared_norms[j]).then(|| (j, sum / square[j]))
        };
        let gains = (0..columns.ncols()).filter_map(gain);
        match gains.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((next, _)) if path.len() < most => path.push(next),
            _ => break,
        }
    }
    path
}

/// Divides the runs into random groups whose sizes differ by at most one.
fn folds(runs: usize, seed: u64) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..runs).collect();
    order.shuffle(&mut Xoshiro256PlusPlus::seed_from_u64(seed));
    let count = FOLDS.min(runs);
    (0..count).map(|fold| order.iter().copied().skip(fold).step_by(count).collect()).collect()
}
