//! Parameters for which the data determine only a combination.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;

use super::order::quantile_of_sorted;
use crate::special::normal_upper_quantile;

/// Largest number of unknowns for which combinations are searched; for more unknowns, the computation of the
/// eigenvectors would take longer than the rest of a summary.
pub(crate) const MOST_COMBINED: usize = 200;
/// Posterior variance, relative to the prior variance, above which the data do not inform a direction in parameter
/// space. The limit is below 1 by the sampling error of a few hundred effective draws.
const UNINFORMED: f64 = 0.8;
/// Posterior variance, relative to the prior variance, below which the data inform a direction well. Between
/// [`INFORMED`] and [`UNINFORMED`], the data inform a direction weakly.
const INFORMED: f64 = 0.1;
/// Smallest absolute value of an off-diagonal entry of the projection matrix onto the uninformed directions at which
/// two parameters belong to one group. The limit is three times the sampling error of a thousand effective draws. If
/// the data determine only the sum of up to ten parameters, the entries are larger.
const TOGETHER: f64 = 0.1;
/// Correlation of a parameter outside the group with an uninformed direction of the group, above which that parameter
/// accounts for the direction.
const TAKEN_UP: f64 = 0.5;

/// A group of parameters for which the data determine only a combination.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Combination {
    /// Indices of the parameters, ascending.
    pub(crate) members: Vec<usize>,
    /// The signed posterior correlation of the two members that is largest in absolute value.
    pub(crate) correlation: f64,
}

/// Prior and posterior draws of one parameter.
pub(crate) struct BeforeAndAfter {
    pub(crate) prior: Vec<f64>,
    pub(crate) posterior: Vec<f64>,
}

/// Finds groups of parameters for which the data determine only a combination.
///
/// Each parameter is first transformed so that its prior is standard normal. This transformation needs no moments of
/// the prior, and it turns a constraint on a product of positive numbers into a constraint on a sum. An eigenvalue
/// near 1 of the transformed posterior covariance belongs to a direction that the data do not inform.
///
/// Three cases are not reported: single parameters that the data do not inform, groups whose prior already correlates
/// their members, and directions that correlate with a parameter outside the group. An example of the last case is a
/// hierarchical model, where the mean of the group accounts for the common part of the standardised effects.
pub(crate) fn combinations(columns: &[BeforeAndAfter]) -> Vec<Combination> {
    if columns.is_empty() || columns.len() > MOST_COMBINED {
        return Vec::new();
    }
    let scaled: Vec<[Vec<f64>; 2]> = columns.par_iter().map(BeforeAndAfter::scaled).collect();
    let prior = moments(&scaled.iter().map(|s| s[0].as_slice()).collect::<Vec<_>>());
    let posterior = moments(&scaled.iter().map(|s| s[1].as_slice()).collect::<Vec<_>>());

    let candidates: Vec<usize> =
        (0..columns.len()).filter(|&k| posterior[(k, k)] < UNINFORMED).collect();
    if candidates.len() < 2 {
        return Vec::new();
    }
    let covariance = posterior.select_rows(&candidates).select_columns(&candidates);
    let eigen = SymmetricEigen::new(covariance);
    let mut projection = DMatrix::<f64>::zeros(candidates.len(), candidates.len());
    for (value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value >= UNINFORMED {
            projection += direction * direction.transpose();
        }
    }
    let groups = connected(&projection);
    let groups = groups.into_iter().map(|group| group.iter().map(|&k| candidates[k]).collect());
    groups.filter_map(|members| judge(members, &prior, &posterior)).collect()
}

/// Returns `members` as a combination if the data inform some directions in the space of the `members` well and
/// all other directions not at all; otherwise returns `None`.
fn judge(
    members: Vec<usize>,
    prior: &DMatrix<f64>,
    posterior: &DMatrix<f64>,
) -> Option<Combination> {
    let part = |matrix: &DMatrix<f64>| matrix.select_rows(&members).select_columns(&members);
    let (before, after) = (part(prior), part(posterior));
    let eigen = SymmetricEigen::new(after.clone());
    let (mut informed, mut uninformed) = (false, false);
    for (&value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if value <= INFORMED {
            informed = true;
            continue;
        }
        let direction: DVector<f64> = direction.into_owned();
        let at_first = direction.dot(&(&before * &direction));
        if value < UNINFORMED * at_first.max(1.0)
            || is_taken_up(&members, &direction, value, posterior)
        {
            return None;
        }
        uninformed = true;
    }
    let correlation = |i: usize, j: usize| after[(i, j)] / (after[(i, i)] * after[(j, j)]).sqrt();
    let pairs = (0..members.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let largest = pairs
        .map(|(i, j)| correlation(i, j))
        .max_by(|a, b| a.abs().total_cmp(&b.abs()))
        .filter(|_| informed && uninformed)?;
    Some(Combination { members, correlation: largest })
}

/// Whether a parameter outside `members` is correlated with `direction` by more than [`TAKEN_UP`].
fn is_taken_up(
    members: &[usize],
    direction: &DVector<f64>,
    variance: f64,
    posterior: &DMatrix<f64>,
) -> bool {
    let mut others = (0..posterior.nrows()).filter(|k| !members.contains(k));
    others.any(|k| {
        let along: f64 = members.iter().zip(direction).map(|(&m, d)| d * posterior[(m, k)]).sum();
        along.abs() > TAKEN_UP * (variance * posterior[(k, k)]).sqrt()
    })
}

/// Connected components with more than one row, where entries above [`TOGETHER`] in absolute value link two rows.
fn connected(matrix: &DMatrix<f64>) -> Vec<Vec<usize>> {
    let size = matrix.nrows();
    let mut free = vec![true; size];
    let mut groups = Vec::new();
    for first in 0..size {
        let mut group = Vec::new();
        let mut pending = vec![first];
        while let Some(i) = pending.pop() {
            if std::mem::replace(&mut free[i], false) {
                group.push(i);
                pending.extend((0..size).filter(|&j| free[j] && matrix[(i, j)].abs() > TOGETHER));
            }
        }
        if group.len() > 1 {
            group.sort_unstable();
            groups.push(group);
        }
    }
    groups
}

impl BeforeAndAfter {
    /// Prior and posterior draws after the rank transformation that makes the prior standard normal.
    fn scaled(&self) -> [Vec<f64>; 2] {
        let mut sorted = self.prior.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        // each sorted prior draw gets its normal score; the scores of values between two draws are
        // interpolated linearly
        let n = sorted.len() as f64;
        let scores: Vec<f64> =
            (0..sorted.len()).map(|i| -normal_upper_quantile((i as f64 + 0.5) / n)).collect();
        let score = |x: f64| {
            let above = sorted.partition_point(|&draw| draw < x);
            if above == 0 || above == sorted.len() {
                return scores[above.min(sorted.len() - 1)];
            }
            let (low, high) = (sorted[above - 1], sorted[above]);
            let fraction = (x - low) / (high - low);
            quantile_of_sorted(&[scores[above - 1], scores[above]], fraction)
        };
        [&self.prior, &self.posterior].map(|draws| draws.iter().map(|&x| score(x)).collect())
    }
}

/// Covariance matrix of the draws of all parameters.
fn moments(draws: &[&[f64]]) -> DMatrix<f64> {
    let count = draws[0].len();
    let mut centred = DMatrix::from_fn(count, draws.len(), |row, column| draws[column][row]);
    for mut column in centred.column_iter_mut() {
        let centre = column.mean();
        column.add_scalar_mut(-centre);
    }
    centred.tr_mul(&centred) / (count as f64 - 1.0)
}

#[cfg(test)]
#[path = "../../tests/unit/diagnostics_combinations.rs"]
mod tests;
