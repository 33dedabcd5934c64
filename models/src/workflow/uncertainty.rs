//! What the posterior's width is made of, and the error that all specimens share.

use nalgebra::DMatrix;
use ppl::{Posterior, Summary};
use surrogate::CoefficientPosterior;

use super::WorkflowError;
use super::few_specimens::of_few;
use super::fidelity::{added, error_of_all};
use super::fitted::Fitted;
use super::made_on::MadeOn;
use super::specimen_stiffness::KnownStiffness;
use super::task::Task;
use crate::budget::{largest_part, matrix, shares};
use crate::case::DiscrepancyCase;
use crate::fracture::{Evidence, Population, column_means, relative_covariance, short_name};

/// The covariances (quantities × quantities, relative to the specimens' means) of the errors that all
/// specimens share.
pub(super) struct SharedError {
    surrogate: OfRuns,
    /// Of the mean response, where runs share a few specimens.
    specimens: Option<OfRuns>,
    /// Of the corrections from cheaper meshes, if there are any.
    mesh: Option<Vec<Vec<f64>>>,
    /// Of the model itself, as the case has it.
    discrepancy: Option<Vec<Vec<f64>>>,
}

/// An error of what is learnt from runs.
#[derive(Default)]
struct OfRuns {
    /// What is the same everywhere.
    constant: Option<Vec<Vec<f64>>>,
    /// What runs leave open, which depends on the parameters; and its mean over the box.
    open: Option<(CoefficientPosterior, Vec<Vec<f64>>)>,
}

impl SharedError {
    /// What all specimens share: the error of the surrogate, that of `[fidelity]`, and that of the model as
    /// `[calibration.discrepancy]` has it.
    ///
    /// Where each run had a packing of its own, the residuals of the surrogate are scatter between packings,
    /// which the specimens have too; what is shared is the error of the mean response, s² h(θ). On one specimen it is
    /// what the polynomial misses of its response. Where runs share a few specimens it is both, W + W h(θ) with W the
    /// scatter of runs on the same specimen, and beside it what so few specimens tell of the mean of all, B g(θ)
    /// ([`of_few`]).
    pub(super) fn of(
        fitted: &Fitted,
        discrepancy: &DiscrepancyCase,
        means: &[f64],
    ) -> Result<Self, WorkflowError> {
        let open = |open: CoefficientPosterior| -> Result<_, WorkflowError> {
            let mean = relative_covariance(open.mean_error(means)?, means);
            Ok(Some((open, mean)))
        };
        let (surrogate, specimens) = match (&fitted.specimens, &fitted.made_on) {
            (Some(specimens), _) => {
                let misses = relative_covariance(specimens.within.scatter(means)?, means);
                let within = open(specimens.within.clone())?;
                let of_few = OfRuns { constant: None, open: open(of_few(specimens))? };
                (OfRuns { constant: Some(misses), open: within }, Some(of_few))
            }
            (None, MadeOn::One) => {
                let misses = relative_covariance(fitted.report.lack_of_fit(means)?, means);
                (OfRuns { constant: Some(misses), open: None }, None)
            }
            (None, _) => {
                let mean = relative_covariance(fitted.report.mean_error(means)?, means);
                (OfRuns { constant: None, open: Some((fitted.open.clone(), mean)) }, None)
            }
        };
        let mesh = error_of_all(&fitted.corrections, &fitted.made_on)?;
        let discrepancy = discrepancy.covariance(&fitted.report.outputs);
        Ok(Self { surrogate, specimens, mesh, discrepancy })
    }

    fn of_runs(&self) -> impl Iterator<Item = &OfRuns> {
        [&self.surrogate].into_iter().chain(&self.specimens)
    }

    /// Their sum, that of the surrogate averaged over the box: where there is no posterior to average over.
    pub(super) fn total(&self) -> Vec<Vec<f64>> {
        let open = self.of_runs().filter_map(|part| part.open.as_ref().map(|(_, mean)| mean));
        sum(self.constants().chain(open))
    }

    /// Their sum, that of the surrogate averaged over the draws of a posterior.
    ///
    /// # Errors
    /// A draw outside the surrogate's box.
    pub(super) fn over(
        &self,
        posterior: &Posterior,
        evidence: &Evidence,
    ) -> Result<Vec<Vec<f64>>, WorkflowError> {
        let of_runs = self.of_runs().map(|part| part.over(posterior, evidence));
        let of_runs: Vec<Vec<Vec<f64>>> = of_runs.collect::<Result<_, _>>()?;
        let others = [&self.mesh, &self.discrepancy].into_iter().flatten();
        Ok(sum(of_runs.iter().chain(others)))
    }

    /// Those that do not depend on the parameters.
    fn constants(&self) -> impl Iterator<Item = &Vec<Vec<f64>>> {
        let others = [&self.mesh, &self.discrepancy].into_iter().flatten();
        self.of_runs().filter_map(|part| part.constant.as_ref()).chain(others)
    }

    /// Specimens `qois` with these errors, and what is known of their stiffness ratios.
    pub(super) fn evidence(&self, qois: Vec<Vec<f64>>, known: &KnownStiffness) -> Evidence {
        let size = qois.first().map_or(0, Vec::len);
        let zeros = vec![vec![0.0; size]; size];
        let shared = sum([&zeros].into_iter().chain(self.constants()));
        let open = self.of_runs().filter_map(|part| part.open.as_ref());
        let open = open.map(|(open, _)| open.clone()).collect();
        let population = known.population.clone();
        Evidence { qois, known: known.rows(), population, shared, open }
    }
}

impl OfRuns {
    /// Averaged over the draws of a posterior.
    fn over(
        &self,
        posterior: &Posterior,
        evidence: &Evidence,
    ) -> Result<Vec<Vec<f64>>, WorkflowError> {
        let Some((open, _)) = &self.open else { return Ok(sum(&self.constant)) };
        let known = evidence.middle();
        let draws = draws_of(posterior, "theta");
        let some = draws.iter().step_by(draws.len().div_ceil(MOST_DRAWS).max(1));
        let leverages: Vec<f64> = some
            .map(|theta| open.leverage(&[&theta[..], &known[..]].concat()))
            .collect::<Result<_, _>>()?;
        let mean = leverages.iter().sum::<f64>() / leverages.len().max(1) as f64;
        let means = column_means(&evidence.qois);
        let scatter = relative_covariance(open.scatter(&means)?, &means);
        let row = |row: Vec<f64>| row.into_iter().map(|s| s * mean).collect();
        let open: Vec<Vec<f64>> = scatter.into_iter().map(row).collect();
        Ok(sum(self.constant.iter().chain([&open])))
    }
}

/// The sum of matrices of one shape; without any, nothing.
fn sum<'a>(matrices: impl IntoIterator<Item = &'a Vec<Vec<f64>>>) -> Vec<Vec<f64>> {
    let mut all = matrices.into_iter();
    let first = all.next().cloned().unwrap_or_default();
    all.fold(first, |sum, more| added(&sum, more))
}

/// Draws over which an error is averaged.
const MOST_DRAWS: usize = 500;

/// Shares of the sources in the posterior variance of each parameter.
pub(super) struct Budget {
    pub(super) parameters: Vec<String>,
    pub(super) sources: Vec<&'static str>,
    /// Parameters × sources; those of a parameter sum to 1.
    pub(super) shares: Vec<Vec<f64>>,
    /// 1 − variance of the posterior over that of the prior, of each parameter.
    pub(super) contractions: Vec<f64>,
    /// Of surrogate and corrections together, quantities × quantities.
    of_runs: Vec<Vec<f64>>,
}

/// Parameters of less contraction are not identified.
const IDENTIFIED: f64 = 0.1;

/// The source whose share more runs make smaller.
pub(super) const OF_SURROGATE: &str = "surrogate";

/// Where the posterior's width comes from:
///
/// - surrogate: its error, which is shared, as it is where the posterior lives;
/// - mesh: the error of the correction from cheaper meshes. What the specimen's own mesh errs by is in no
///   interval: see `confirm.csv`;
/// - discrepancy: what the case says the model itself may be off by;
/// - geometry: the scatter of packings over n, where runs show it; what runs on few specimens leave open of the mean of
///   all; and what the stiffness of specimens without an image leaves open;
/// - specimens: the scatter between specimens less that of packings, over n.
///
/// None if the covariance of them all is not positive definite.
pub(super) fn budget(
    fitted: &Fitted,
    posterior: &Posterior,
    evidence: &Evidence,
    shared: &SharedError,
) -> Result<Option<Budget>, WorkflowError> {
    let means = column_means(&evidence.qois);
    let (unknown, groups) = (fitted.unknown(), groups(evidence));
    let draws = draws_of(posterior, "theta");
    let means_of_draws = column_means(&draws);
    let variance = |(i, mean): (usize, &f64)| {
        draws.iter().map(|draw| (draw[i] - mean).powi(2)).sum::<f64>() / draws.len() as f64
    };
    let variances: Vec<f64> = means_of_draws.iter().enumerate().map(variance).collect();
    let Some(scatter) = mean_scatter(posterior, means.len()) else { return Ok(None) };
    let of_surrogate = shared.surrogate.over(posterior, evidence)?;
    let of_runs = match &shared.mesh {
        Some(mesh) => added(&of_surrogate, mesh),
        None => of_surrogate.clone(),
    };
    // an error that all share, and one that each specimen has alone, of the means of both groups
    let shared_by_all = |part: &[Vec<f64>]| blocks(&groups, |_, _| matrix(part));
    let of_each = |part: &DMatrix<f64>| {
        let zero = DMatrix::zeros(means.len(), means.len());
        blocks(&groups, |g, h| if g == h { part / groups[g].size } else { zero.clone() })
    };
    let mut sources = vec![(OF_SURROGATE, shared_by_all(&of_surrogate))];
    sources.extend(shared.mesh.as_ref().map(|mesh| ("mesh", shared_by_all(mesh))));
    sources.extend(shared.discrepancy.as_ref().map(|model| ("discrepancy", shared_by_all(model))));
    let mut geometry: Option<DMatrix<f64>> = None;
    let mut own = scatter.clone();
    if fitted.made_on.shows_scatter() {
        let packings = match &fitted.specimens {
            Some(specimens) => specimens.between.scatter(&means)?,
            None => fitted.report.scatter(&means)?,
        };
        let packings = matrix(&relative_covariance(packings, &means));
        let packings = &packings * largest_part(&scatter, &packings);
        own -= &packings;
        geometry = Some(of_each(&packings));
    }
    if let Some(of_few) = &shared.specimens {
        let of_few = shared_by_all(&of_few.over(posterior, evidence)?);
        geometry = Some(geometry.map_or_else(|| of_few.clone(), |all| all + &of_few));
    }

    let mut jacobian: Vec<Vec<f64>> = Vec::new();
    for (g, group) in groups.iter().enumerate() {
        // what is known of specimens takes no part, and stands at its mean
        let place = [&means_of_draws[..], &group.inputs].concat();
        let (_, slopes) = fitted.pce.value_and_jacobian(&place)?;
        let relative = |(row, mean): (&Vec<f64>, &f64)| row.iter().map(|s| s / mean).collect();
        let slopes: Vec<Vec<f64>> = slopes.iter().zip(&means).map(relative).collect();
        jacobian.extend(slopes.iter().map(|row| row[..unknown.len()].to_vec()));
        if let Some(population) = group.population {
            // what a standard deviation of each unknown input does
            let column = |row: &Vec<f64>| {
                row[unknown.len()..]
                    .iter()
                    .zip(population.sd())
                    .map(|(slope, sd)| slope * sd)
                    .collect()
            };
            let columns = matrix(&slopes.iter().map(column).collect::<Vec<_>>());
            let between = &columns * columns.transpose();
            let spread = between * (group.size.recip() + population.count().recip());
            let zero = DMatrix::zeros(means.len(), means.len());
            let of_group =
                |a: usize, b: usize| if (a, b) == (g, g) { spread.clone() } else { zero.clone() };
            let own = blocks(&groups, of_group);
            geometry = Some(geometry.map_or_else(|| own.clone(), |all| all + &own));
        }
    }
    sources.extend(geometry.map(|geometry| ("geometry", geometry)));
    sources.push(("specimens", of_each(&own)));

    let prior: Vec<f64> =
        unknown.iter().map(|input| (input.upper - input.lower).powi(2) / 12.0).collect();
    let contractions =
        variances.iter().zip(&prior).map(|(after, prior)| 1.0 - after / prior).collect();
    let parameters = unknown.iter().map(|input| input.name.clone()).collect();
    let (sources, covariances): (Vec<&str>, Vec<DMatrix<f64>>) = sources.into_iter().unzip();
    Ok(shares(&jacobian, &prior, &covariances).map(|shares| Budget {
        parameters,
        sources,
        shares,
        contractions,
        of_runs,
    }))
}

impl Budget {
    /// The share of a source in the variance of each parameter.
    pub(super) fn of(&self, source: &str) -> Vec<f64> {
        let place = self.sources.iter().position(|own| *own == source);
        self.shares.iter().map(|shares| place.map_or(0.0, |place| shares[place])).collect()
    }

    /// The parameter with the largest share of the surrogate, and that share, among those that the data
    /// identify: of others the width is the prior's, whatever is known of the surrogate. If none is
    /// identified, it may be for want of a surrogate, and all count.
    pub(super) fn largest_share(&self) -> Option<(&str, f64)> {
        let all = || self.parameters.iter().zip(self.of(OF_SURROGATE)).zip(&self.contractions);
        let any = all().any(|(_, contraction)| *contraction >= IDENTIFIED);
        all()
            .filter(|(_, contraction)| !any || **contraction >= IDENTIFIED)
            .map(|((parameter, share), _)| (parameter.as_str(), share))
            .max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// `uncertainty.csv`.
    pub(super) fn write(&self, task: &Task<'_>) -> Result<(), WorkflowError> {
        let rows = self.parameters.iter().zip(&self.shares).flat_map(|(parameter, shares)| {
            let row = |(source, share): (&&str, &f64)| {
                [parameter.clone(), (*source).to_owned(), share.to_string()]
            };
            self.sources.iter().zip(shares).map(row).collect::<Vec<_>>()
        });
        task.write_csv("uncertainty.csv", ["parameter", "source", "share"], rows)
    }

    /// Whether the error of the runs widens the posterior: n S/Σ above 0.1 for some quantity, with S its
    /// variance, Σ that between n specimens, both relative.
    pub(super) fn warning(
        &self,
        summary: &Summary,
        quantities: &[String],
        specimens: usize,
    ) -> Option<String> {
        let worst = quantities
            .iter()
            .enumerate()
            .filter_map(|(m, name)| {
                let sd = summary.row(&format!("sd[{}]", short_name(name)))?.mean;
                Some((specimens as f64 * self.of_runs[m][m] / (sd * sd), name))
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        worst.filter(|(ratio, _)| *ratio > 0.1).map(|(ratio, name)| {
            format!(
                "The error of the forward model is not small against the scatter of the specimens: n S/Σ = \
                 {ratio:.2} for {name}. The intervals hold it: more runs in the design, a table [sequential], \
                 or more repeats in [fidelity], would make them narrower."
            )
        })
    }
}

/// Draws of a quantity, a row each.
pub(super) fn draws_of(posterior: &Posterior, name: &str) -> Vec<Vec<f64>> {
    let group = &posterior.posterior;
    let Some(values) = group.variables.iter().find(|v| v.name == name) else { return Vec::new() };
    let size = values.data.len() / (group.chains * group.draws).max(1);
    values.data.chunks(size.max(1)).map(<[f64]>::to_vec).collect()
}

/// Specimens that scatter alike.
struct Group<'a> {
    size: f64,
    /// The surrogate's last inputs of their mean.
    inputs: Vec<f64>,
    /// Where those are not known of each.
    population: Option<&'a Population>,
}

/// Specimens of which all is known, and the others.
fn groups(evidence: &Evidence) -> Vec<Group<'_>> {
    let known: Vec<Vec<f64>> = evidence.known.iter().flatten().cloned().collect();
    let unknown = evidence.known.len() - known.len();
    let all = evidence.qois.len();
    let population = evidence.population.as_ref().filter(|_| unknown > 0);
    let of_known =
        Group { size: (all - unknown) as f64, inputs: column_means(&known), population: None };
    let of_unknown = population.map(|population| Group {
        size: unknown as f64,
        inputs: population.mean().to_vec(),
        population: Some(population),
    });
    [Some(of_known), of_unknown].into_iter().flatten().filter(|group| group.size > 0.0).collect()
}

/// A matrix of the means of all groups, from a block for each pair of them.
fn blocks(groups: &[Group<'_>], block: impl Fn(usize, usize) -> DMatrix<f64>) -> DMatrix<f64> {
    let size = block(0, 0).nrows();
    let mut whole = DMatrix::zeros(size * groups.len(), size * groups.len());
    for g in 0..groups.len() {
        for h in 0..groups.len() {
            whole.view_mut((g * size, h * size), (size, size)).copy_from(&block(g, h));
        }
    }
    whole
}

/// The posterior mean of the covariance between specimens, diag(sd) R diag(sd).
pub(super) fn mean_scatter(posterior: &Posterior, size: usize) -> Option<DMatrix<f64>> {
    let group = &posterior.posterior;
    let of = |name: &str| group.variables.iter().find(|v| v.name == name).map(|v| &v.data);
    let (sd, corr) = (of("sd")?, of("corr")?);
    let draws = group.chains * group.draws;
    let mut mean = DMatrix::zeros(size, size);
    for (sd, corr) in sd.chunks(size).zip(corr.chunks(size * size)) {
        let factor = DMatrix::from_fn(size, size, |i, j| sd[i] * corr[i * size + j]);
        mean += &factor * factor.transpose() / draws as f64;
    }
    Some(mean)
}

#[cfg(test)]
mod tests;
