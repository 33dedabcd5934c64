//! Parameters of which the data determine only a combination.

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use rayon::prelude::*;

use super::order::quantile_of_sorted;
use crate::special::normal_upper_quantile;

/// More unknowns are not looked at: the eigenvectors would take longer than the rest of a summary.
pub(crate) const MOST_COMBINED: usize = 200;
/// The variance that is left of the prior's, 1, along a direction that the data do not see: less the
/// scatter of a few hundred effective draws.
const UNSEEN: f64 = 0.8;
/// The variance that is left of the prior's along a direction that they do see. Combinations in
/// between are weakly informed, and no more.
const SEEN: f64 = 0.1;
/// Two parameters belong together if their part in the unseen directions is above this, three times
/// the scatter of a thousand effective draws; up to ten in one sum have it.
const TOGETHER: f64 = 0.1;
/// A direction is taken up by another parameter if they have this correlation.
const TAKEN_UP: f64 = 0.5;

/// Parameters of which the data determine only a combination.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Combination {
    /// Which of them, ascending.
    pub(crate) members: Vec<usize>,
    /// The largest correlation between two of them, in absolute value, with its sign.
    pub(crate) correlation: f64,
}

/// Draws of one parameter.
pub(crate) struct BeforeAndAfter {
    pub(crate) prior: Vec<f64>,
    pub(crate) posterior: Vec<f64>,
}

/// Sets of parameters that the data tell only together.
///
/// Every parameter is first put on the scale on which its prior is standard normal. That needs no
/// moments, and what the data say of a product of positive numbers is then about a sum. In the
/// covariance of the posterior on this scale, an eigenvalue near 1 belongs to a direction that the
/// data do not see.
///
/// What is no matter of a combination is left out: parameters that are unseen by themselves, groups
/// that their prior already ties together, and a direction that a third parameter takes up, as the
/// common part of the standardised effects of a hierarchy is taken up by its mean.
pub(crate) fn combinations(columns: &[BeforeAndAfter]) -> Vec<Combination> {
    if columns.is_empty() || columns.len() > MOST_COMBINED {
        return Vec::new();
    }
    let scaled: Vec<[Vec<f64>; 2]> = columns.par_iter().map(BeforeAndAfter::scaled).collect();
    let prior = moments(&scaled.iter().map(|s| s[0].as_slice()).collect::<Vec<_>>());
    let posterior = moments(&scaled.iter().map(|s| s[1].as_slice()).collect::<Vec<_>>());

    let candidates: Vec<usize> =
        (0..columns.len()).filter(|&k| posterior[(k, k)] < UNSEEN).collect();
    if candidates.len() < 2 {
        return Vec::new();
    }
    let own = posterior.select_rows(&candidates).select_columns(&candidates);
    let eigen = SymmetricEigen::new(own);
    let mut unseen = DMatrix::<f64>::zeros(candidates.len(), candidates.len());
    for (value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if *value >= UNSEEN {
            unseen += direction * direction.transpose();
        }
    }
    let groups = connected(&unseen);
    let groups = groups.into_iter().map(|group| group.iter().map(|&k| candidates[k]).collect());
    groups.filter_map(|members| judge(members, &prior, &posterior)).collect()
}

/// Whether the data see some directions of these parameters well and others not at all.
fn judge(
    members: Vec<usize>,
    prior: &DMatrix<f64>,
    posterior: &DMatrix<f64>,
) -> Option<Combination> {
    let part = |of: &DMatrix<f64>| of.select_rows(&members).select_columns(&members);
    let (before, after) = (part(prior), part(posterior));
    let eigen = SymmetricEigen::new(after.clone());
    let (mut seen, mut unseen) = (false, false);
    for (&value, direction) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
        if value <= SEEN {
            seen = true;
            continue;
        }
        let direction: DVector<f64> = direction.into_owned();
        let at_first = direction.dot(&(&before * &direction));
        if value < UNSEEN * at_first.max(1.0) || is_taken_up(&members, &direction, value, posterior)
        {
            return None;
        }
        unseen = true;
    }
    let correlation = |i: usize, j: usize| after[(i, j)] / (after[(i, i)] * after[(j, j)]).sqrt();
    let pairs = (0..members.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let largest = pairs
        .map(|(i, j)| correlation(i, j))
        .max_by(|a, b| a.abs().total_cmp(&b.abs()))
        .filter(|_| seen && unseen)?;
    Some(Combination { members, correlation: largest })
}

/// Whether another parameter goes along with this direction.
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

/// The parts of more than one row that hang together by large entries.
fn connected(matrix: &DMatrix<f64>) -> Vec<Vec<usize>> {
    let size = matrix.nrows();
    let mut free = vec![true; size];
    let mut groups = Vec::new();
    for first in 0..size {
        let mut group = Vec::new();
        let mut open = vec![first];
        while let Some(i) = open.pop() {
            if std::mem::replace(&mut free[i], false) {
                group.push(i);
                open.extend((0..size).filter(|&j| free[j] && matrix[(i, j)].abs() > TOGETHER));
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
    /// Prior and posterior on the scale on which the prior is standard normal, by its ranks.
    fn scaled(&self) -> [Vec<f64>; 2] {
        let mut sorted = self.prior.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        // a table of scores over the ranks of the prior's draws, linear in between
        let n = sorted.len() as f64;
        let scores: Vec<f64> =
            (0..sorted.len()).map(|i| -normal_upper_quantile((i as f64 + 0.5) / n)).collect();
        let score = |x: f64| {
            let above = sorted.partition_point(|&own| own < x);
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

/// The covariance matrix of draws.
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
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// Columns with standard normal priors, and posterior draws made of standard normal noise.
    fn columns(
        count: usize,
        noise: usize,
        posterior: fn(&[f64]) -> Vec<f64>,
    ) -> Vec<BeforeAndAfter> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(count as u64);
        let mut normals =
            |n: usize| -> Vec<f64> { (0..n).map(|_| rng.sample(StandardNormal)).collect() };
        let priors: Vec<Vec<f64>> = (0..count).map(|_| normals(2000)).collect();
        let draws: Vec<Vec<f64>> = (0..2000).map(|_| posterior(&normals(noise))).collect();
        let column = |k: usize| draws.iter().map(|d| d[k]).collect();
        let prior = priors.into_iter().enumerate();
        prior.map(|(k, prior)| BeforeAndAfter { prior, posterior: column(k) }).collect()
    }

    fn members(columns: &[BeforeAndAfter]) -> Vec<Vec<usize>> {
        combinations(columns).into_iter().map(|found| found.members).collect()
    }

    /// a + b and c + d + e are known, each alone is not; f is known.
    #[test]
    fn sums_are_told_apart() {
        let found = columns(6, 4, |z| {
            let pair = z[0] / 2_f64.sqrt();
            // the plane c + d + e = 0 with the prior's variance
            let (u, v) = (z[1] / 2_f64.sqrt(), z[2] / 6_f64.sqrt());
            vec![pair, 0.02 * z[3] - pair, u + v, v - u, -2.0 * v, 0.05 * z[3]]
        });
        assert_eq!(members(&found), [vec![0, 1], vec![2, 3, 4]]);
        assert!((combinations(&found)[0].correlation + 1.0).abs() < 0.01);
    }

    /// Of no column, one that is seen, and one that is not, nothing is left to combine.
    #[test]
    fn one_parameter_is_no_combination() {
        assert_eq!(members(&[]), Vec::<Vec<usize>>::new());
        assert_eq!(members(&columns(1, 1, |z| vec![0.1 * z[0]])), Vec::<Vec<usize>>::new());
        assert_eq!(members(&columns(1, 1, |z| vec![2.0 * z[0]])), Vec::<Vec<usize>>::new());
    }

    /// Correlated but well known; unknown but not correlated; half known.
    #[test]
    fn correlation_alone_is_no_lack_of_data() {
        let known = columns(2, 2, |z| vec![0.3 * z[0], 0.3 * z[0] + 0.01 * z[1]]);
        assert_eq!(members(&known), Vec::<Vec<usize>>::new());
        let unknown = columns(2, 2, |z| z.to_vec());
        assert_eq!(members(&unknown), Vec::<Vec<usize>>::new());
        let half = columns(2, 2, |z| vec![0.7 * (z[0] + 0.7 * z[1]), 0.7 * (0.7 * z[1] - z[0])]);
        assert_eq!(members(&half), Vec::<Vec<usize>>::new());
    }

    /// A third parameter that goes along is the common part of a hierarchy's effects.
    #[test]
    fn what_another_parameter_takes_up_is_left_out() {
        let found = columns(3, 3, |z| {
            let common = z[0] / 2_f64.sqrt();
            vec![common, common + 0.02 * z[1], 0.05 * z[2] - 0.1 * common]
        });
        assert_eq!(members(&found), Vec::<Vec<usize>>::new());
    }
}
