//! One specimen as others tell of it: a new one, or each of those that there are.

use ppl::DomainError;
use ppl::prelude::*;

use super::specimens::{Expected, Kind, Specimens, scaled};

impl Specimens {
    /// A new specimen, which shares δ with those seen: one like the known ones, and one of which nothing is
    /// known if there are such.
    pub(super) fn new_specimen<R: Scalar>(
        &self,
        expected: &Expected<R>,
        scatter: &DynCholeskyFactor<R>,
    ) -> Result<MvNormalCholesky<Vec<R>, DynCholeskyFactor<R>>, DomainError> {
        let kind = if expected.unknown.is_some() { Kind::Unknown } else { Kind::Known };
        let gaps: Vec<R> = self
            .totals
            .iter()
            .zip(self.mean_of_totals(expected))
            .map(|(&total, mean)| -(mean - total))
            .collect();
        self.after(&self.groups(), kind, expected, scatter)?.specimen(expected.mean_of(kind), &gaps)
    }

    /// log p(y_k | y_−k, θ, Σ) of each specimen k given the others, with all that they share integrated out;
    /// the covariance is the same for all of a group, so that n of them cost little more than one.
    ///
    /// # Errors
    /// A covariance that is not positive definite, or a mean of another size.
    pub(super) fn ln_conditionals(
        &self,
        expected: &Expected<f64>,
        scatter: &DynCholeskyFactor<f64>,
    ) -> Result<Vec<f64>, DomainError> {
        let mut found = [Vec::new(), Vec::new()];
        for (kind, _) in self.groups() {
            found[kind as usize] = self.ln_conditionals_of(kind, expected, scatter)?;
        }
        let [mut known, mut unknown] = found.map(Vec::into_iter);
        let next = |is_known: &bool| if *is_known { known.next() } else { unknown.next() };
        Ok(self.is_known.iter().filter_map(next).collect())
    }

    /// Those of a group.
    fn ln_conditionals_of(
        &self,
        kind: Kind,
        expected: &Expected<f64>,
        scatter: &DynCholeskyFactor<f64>,
    ) -> Result<Vec<f64>, DomainError> {
        // without one of its own
        let others = |(group, n): (Kind, usize)| (group, n - usize::from(group == kind));
        let groups: Vec<(Kind, usize)> =
            self.groups().into_iter().map(others).filter(|(_, n)| *n > 0).collect();
        let after = self.after(&groups, kind, expected, scatter)?;
        let of = |(place, row): (usize, &Vec<f64>)| {
            let own = expected.own_mean(kind, place);
            let residual: Vec<f64> = row.iter().zip(own).map(|(y, mean)| y - mean).collect();
            let gaps = groups.iter().flat_map(|&(group, n)| {
                let total = &self.group(group).total;
                let mean = scaled(expected.mean_of(group), self.group(group).len());
                let whole = total.iter().zip(mean).map(|(total, mean)| total - mean);
                match group == kind {
                    false => whole.collect::<Vec<f64>>(),
                    true => {
                        let (all, root) = ((n as f64 + 1.0).sqrt(), (n as f64).sqrt());
                        whole.zip(&residual).map(|(gap, r)| (all * gap - r) / root).collect()
                    }
                }
            });
            let gaps: Vec<f64> = gaps.collect();
            Ok(after.specimen(own, &gaps)?.ln_density(row))
        };
        self.group(kind).rows.iter().enumerate().map(of).collect()
    }

    /// What groups of these sizes tell of one more specimen of a kind: with V the covariance of their totals
    /// and C that of the specimen with them, it is N(m + C V⁻¹ (totals − their means), Σ_k + S − C V⁻¹ Cᵀ).
    fn after<R: Scalar>(
        &self,
        groups: &[(Kind, usize)],
        kind: Kind,
        expected: &Expected<R>,
        scatter: &DynCholeskyFactor<R>,
    ) -> Result<After<R>, DomainError> {
        let factor = self.factor_of(groups, expected, scatter)?;
        let size = self.shared.len();
        let column = |i: usize| {
            let entries = groups.iter().flat_map(|&(group, n)| {
                let root = (n as f64).sqrt();
                (0..size).map(move |j| self.common(kind, group, expected, i, j) * root)
            });
            factor.solve_lower(&entries.collect::<Vec<R>>())
        };
        let columns: Vec<Vec<R>> = (0..size).map(column).collect::<Result<_, _>>()?;
        let scatter = scatter.covariance();
        let entry = |i: usize, j: usize| {
            let alone = self.own(kind, expected, &scatter, i, j);
            alone + self.common(kind, kind, expected, i, j) - dot(&columns[i], &columns[j])
        };
        let covariance: Vec<Vec<R>> =
            (0..size).map(|i| (0..size).map(|j| entry(i, j)).collect()).collect();
        let own = DynCholeskyFactor::of_covariance(&covariance)?;
        Ok(After { factor, columns, own })
    }
}

/// The distribution of a specimen after others, but for their totals.
struct After<R: Scalar> {
    /// L of L Lᵀ = V.
    factor: DynCholeskyFactor<R>,
    /// L⁻¹ Cᵀ.
    columns: Vec<Vec<R>>,
    /// The factor of its own covariance.
    own: DynCholeskyFactor<R>,
}

impl<R: Scalar> After<R> {
    /// One more specimen where the forward model says `mean` and the others' totals are off by `gaps`.
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
