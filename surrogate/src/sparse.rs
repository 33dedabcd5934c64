//! The terms that matter: more to choose from than runs to fit them to.

use std::rc::Rc;

use faer::{Col, Mat, unzip, zip};
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::design_matrix::{Equations, Regression};
use crate::error::SurrogateError;
use crate::multi_index::Truncation;
use crate::orders::{Fitted, Orders, split_errors};
use crate::scale_choice::ChosenScales;
use crate::select::{Holdout, LeaveOneOutError, OrderReport, OrderRule, Truth, error};
use crate::weights::fit_weighted;

/// Exponents of the hyperbolic truncations below the one that is asked for: the smaller, the fewer
/// interactions are among the terms to choose from.
const EXPONENTS: [f64; 3] = [0.4, 0.6, 0.8];

/// Most terms to choose from: beyond, a fit takes minutes.
const MOST_CANDIDATES: usize = 6000;

/// Parts of the runs that are left out in turn.
const FOLDS: usize = 10;

/// Fewer rows than this for each term make no good fit.
const ROWS_PER_TERM: usize = 2;

/// What is left of a column's square beside those chosen before it, below which it is one of them.
const DEPENDENT: f64 = 1e-12;

/// An order with the terms of a truncation that matter.
struct Candidate {
    error: f64,
    loo: LeaveOneOutError,
    fitted: Fitted,
    equations: Equations,
}

/// The orders up to that of the regression, each with the terms that matter.
///
/// # Errors
/// As [`Regression::equations`].
pub(crate) fn sparse(
    regression: &Regression<'_>,
    scales: &ChosenScales,
    truth: &Truth<'_>,
    (rule, split): (OrderRule, &Holdout),
) -> Result<Orders, SurrogateError> {
    // weights of derivatives are those of the orders with all terms
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
            let found = candidate(&wider, &equations, truth, &weights, &folds);
            if let Some(found) = found
                && best.as_ref().is_none_or(|best| found.error < best.error)
            {
                best = Some(found);
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

/// Truncations from few interactions to those that are asked for.
fn truncations(asked: Truncation) -> impl Iterator<Item = Truncation> {
    let most = match asked {
        Truncation::TotalDegree => 1.0,
        Truncation::Hyperbolic { q } => q,
        // the others would not hold the limit
        Truncation::Limited { .. } => 0.0,
    };
    let fewer = EXPONENTS.into_iter().filter(move |q| *q < most);
    fewer.map(|q| Truncation::Hyperbolic { q }).chain([asked])
}

/// The number of terms that cross-validation finds best, in which each fold chooses its own, and as many
/// chosen by all runs.
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
    let (place, error) = errors.min_by(|a, b| a.1.total_cmp(&b.1))?;

    let all: Vec<usize> = (0..runs).collect();
    let path = forward(equations, &all, weights, place + 1);
    let equations = equations.with_columns(&path);
    let fit = equations.least_squares(&all, weights);
    let prefix = fit.sweep(&[path.len().min(fit.rank())]).pop()?;
    let plain = LeaveOneOutError::new(&prefix, truth)?.plain;
    let left_out = residuals.into_iter().nth(place)?;
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

/// Residuals (runs × outputs) of each run from the terms that the runs of other folds choose, for one term, two, …
fn cross_validate(equations: &Equations, weights: &[f64], folds: &[Vec<usize>]) -> Vec<Mat<f64>> {
    let runs = equations.runs();
    let mut all: Vec<Mat<f64>> = Vec::new();
    for (place, fold) in folds.iter().enumerate() {
        let others: Vec<usize> = (0..runs).filter(|run| !fold.contains(run)).collect();
        let most = others.len() * (1 + weights.len()) / ROWS_PER_TERM;
        let path = forward(equations, &others, weights, most.max(1));
        let chosen = equations.with_columns(&path);
        let fit = chosen.least_squares(&others, weights);
        let terms = path.len().min(fit.rank());
        if place == 0 {
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

/// Columns in the order in which they matter to the chosen runs, the constant first: each takes away the
/// most of what the columns before it leave of the targets, summed over them as fractions of their variances. Not
/// more than `most`.
fn forward(equations: &Equations, chosen: &[usize], weights: &[f64], most: usize) -> Vec<usize> {
    let (columns, mut left) = equations.weighted(chosen, weights);
    for (target, variance) in left.col_iter_mut().zip(&equations.variances()) {
        target.iter_mut().for_each(|y| *y /= variance.sqrt());
    }
    // of each column, less what lies along the directions taken: its square, its products with the targets
    let own: Vec<f64> = columns.col_iter().map(|c| c.squared_norm_l2()).collect();
    let mut square = own.clone();
    let mut products = columns.transpose() * &left;
    let mut directions: Vec<Col<f64>> = Vec::new();
    let mut path = vec![0];
    while let Some(&last) = path.last() {
        let mut direction = columns.col(last).to_owned();
        // twice is enough (Kahan)
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
            (square[j] > DEPENDENT * own[j]).then(|| (j, sum / square[j]))
        };
        let gains = (0..columns.ncols()).filter_map(gain);
        match gains.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((next, _)) if path.len() < most => path.push(next),
            _ => break,
        }
    }
    path
}

/// The runs in groups of the same size, at random.
fn folds(runs: usize, seed: u64) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..runs).collect();
    order.shuffle(&mut Xoshiro256PlusPlus::seed_from_u64(seed));
    let count = FOLDS.min(runs);
    (0..count).map(|fold| order.iter().copied().skip(fold).step_by(count).collect()).collect()
}
