//! Distribution of one specimen given the other specimens. The specimen is a new specimen or one of the tested
//! specimens.

use ppl::DomainError;
use ppl::prelude::*;

use super::contrasts::Group;
use super::specimens::{Expected, Kind, Specimens};

/// Distribution of a new specimen given the tested specimens. All specimens share the error δ. The inputs of the
/// new specimen are unknown if some tested specimens have unknown inputs; otherwise the new specimen has the mean
/// response of the tested specimens.
pub(super) fn new_specimen<R: Scalar>(
    specimens: &Specimens,
    expected: &Expected<R>,
    scatter: &DynCholeskyFactor<R>,
) -> Result<MvNormalCholesky<Vec<R>, DynCholeskyFactor<R>>, DomainError> {
    let kind = if expected.unknown.is_some() { Kind::Unknown } else { Kind::Known };
    let gaps: Vec<R> = specimens
        .totals
        .iter()
        .zip(specimens.mean_of_totals(expected))
        .map(|(&total, mean)| -(mean - total))
        .collect();
    let all: Vec<usize> = (0..specimens.shared.len()).collect();
    after(specimens, &specimens.sized_groups(), (kind, &all), expected, scatter)?
        .specimen(expected.mean_of(kind), &gaps)
}

/// Computes log p(y_k | y_−k, θ, Σ) of the recorded quantities y_k of each specimen k given the quantities y_−k of the
/// other specimens, with the shared errors integrated out. The covariance is the same for all specimens of a
/// group, and it is factorised only once per group.
///
/// # Errors
/// If a covariance is not positive definite, or the sizes of a mean and of the rows differ.
pub(super) fn ln_conditionals(
    specimens: &Specimens,
    expected: &Expected<f64>,
    scatter: &DynCholeskyFactor<f64>,
) -> Result<Vec<f64>, DomainError> {
    let count = |kind| specimens.is_known.iter().filter(|own| Kind::of(**own) == kind).count();
    let mut found = [Kind::Known, Kind::Unknown].map(|kind| vec![f64::NAN; count(kind)]);
    for (g, group) in specimens.groups.iter().enumerate() {
        let own = ln_conditionals_of(specimens, g, expected, scatter)?;
        for (&place, ln_density) in group.places.iter().zip(own) {
            found[group.kind as usize][place] = ln_density;
        }
    }
    let [mut known, mut unknown] = found.map(Vec::into_iter);
    let next = |is_known: &bool| if *is_known { known.next() } else { unknown.next() };
    Ok(specimens.is_known.iter().filter_map(next).collect())
}

/// Computes log p(y_k | y_−k, θ, Σ), see [`ln_conditionals`], for each specimen k of the group with index `own_group`.
fn ln_conditionals_of(
    specimens: &Specimens,
    own_group: usize,
    expected: &Expected<f64>,
    scatter: &DynCholeskyFactor<f64>,
) -> Result<Vec<f64>, DomainError> {
    let group = &specimens.groups[own_group];
    // `groups` lists the groups that contain specimens other than specimen k, with the number of these specimens;
    // `all_gaps` lists, for each of these groups, whether specimen k belongs to the group, and the total of all
    // specimens of the group minus the expected total
    let (mut groups, mut all_gaps) = (Vec::new(), Vec::new());
    for (g, other) in specimens.groups.iter().enumerate() {
        let n = other.len() - usize::from(g == own_group);
        if n > 0 {
            let mean = specimens.mean_of_total(g, other, expected);
            let gap: Vec<f64> = other.total.iter().zip(mean).map(|(y, mean)| y - mean).collect();
            groups.push((other, n));
            all_gaps.push((g == own_group, gap));
        }
    }
    let after = after(specimens, &groups, (group.kind, &group.recorded), expected, scatter)?;
    let ln_conditional = |(&place, row): (&usize, &Vec<f64>)| {
        let own = group.part(expected.own_mean(group.kind, place));
        let residual: Vec<f64> = row.iter().zip(&own).map(|(y, mean)| y - mean).collect();
        let gaps = groups.iter().zip(&all_gaps).flat_map(|(&(_, n), (is_own, gap))| {
            let gap = gap.iter().copied();
            match is_own {
                false => gap.collect::<Vec<f64>>(),
                true => {
                    let (all, root) = ((n as f64 + 1.0).sqrt(), (n as f64).sqrt());
                    gap.zip(&residual).map(|(gap, r)| (all * gap - r) / root).collect()
                }
            }
        });
        let gaps: Vec<f64> = gaps.collect();
        Ok(after.specimen(&own, &gaps)?.ln_density(row))
    };
    group.places.iter().zip(&group.rows).map(ln_conditional).collect()
}

/// Returns the distribution of one more specimen of a kind with the given recorded quantities, given the totals of groups
/// of the given sizes. V is the
/// covariance of the totals, and C is the covariance between the specimen and the totals. The distribution is N(m +
/// C V⁻¹ (totals − their means), Σ_k + S − C V⁻¹ Cᵀ). Here m is the expected response of the specimen, Σ_k is the
/// covariance of the specimen's own deviation, and S is the covariance that the specimen shares with other
/// specimens of its kind.
fn after<R: Scalar>(
    specimens: &Specimens,
    groups: &[(&Group, usize)],
    (kind, recorded): (Kind, &[usize]),
    expected: &Expected<R>,
    scatter: &DynCholeskyFactor<R>,
) -> Result<After<R>, DomainError> {
    let factor = specimens.factor_of(groups, expected, scatter)?;
    let column = |&i: &usize| {
        let entries = groups.iter().flat_map(|&(group, n)| {
            let (root, other) = ((n as f64).sqrt(), group.kind);
            let entry = move |&j: &usize| specimens.common(kind, other, expected, i, j) * root;
            group.recorded.iter().map(entry)
        });
        factor.solve_lower(&entries.collect::<Vec<R>>())
    };
    let columns: Vec<Vec<R>> = recorded.iter().map(column).collect::<Result<_, _>>()?;
    let scatter = scatter.covariance();
    let entry = |(&i, a): (&usize, &Vec<R>), (&j, b): (&usize, &Vec<R>)| {
        let alone = specimens.own(kind, expected, &scatter, i, j);
        alone + specimens.common(kind, kind, expected, i, j) - dot(a, b)
    };
    let pairs = || recorded.iter().zip(&columns);
    let covariance: Vec<Vec<R>> = pairs().map(|a| pairs().map(|b| entry(a, b)).collect()).collect();
    let own = DynCholeskyFactor::of_covariance(&covariance)?;
    Ok(After { factor, columns, own })
}

/// Distribution of a specimen given the totals of other specimens, as a function of the totals.
struct After<R: Scalar> {
    /// Cholesky factor L of V = L Lᵀ.
    factor: DynCholeskyFactor<R>,
    /// Columns of L⁻¹ Cᵀ.
    columns: Vec<Vec<R>>,
    /// Cholesky factor of the covariance of the specimen given the totals.
    own: DynCholeskyFactor<R>,
}

impl<R: Scalar> After<R> {
    /// Returns the distribution of a specimen for which the forward model predicts `mean`. The totals of the other
    /// specimens differ from their expected values by `gaps`.
    fn specimen(
        &self,
        mean: &[R],
        gaps: &[R],
    ) -> Result<MvNormalCholesky<Vec<R>, DynCholeskyFactor<R>>, DomainError> {
        let whitened = self.factor.solve_lower(gaps)?;
        let shifted: Vec<R> =
            mean.iter().zip(&self.columns).map(|(&m, column)| m + dot(column, &whitened)).collect();
        Ok(MvNormalCholesky(shifted, self.own.clone()))
    }
}

fn dot<R: Scalar>(a: &[R], b: &[R]) -> R {
    a.iter().zip(b).map(|(&a, &b)| a * b).sum()
}
