//! Contributions to the width of the posterior, and the errors that all specimens share.

use nalgebra::DMatrix;
use ppl::{Posterior, Summary, Univariate};
use surrogate::CoefficientPosterior;

use super::fitted::Fitted;
use super::specimen_stiffness::KnownStiffness;
use crate::budget::{largest_part, matrix, shares};
use crate::case::DiscrepancyCase;
use crate::experiments::few_specimens::of_few;
use crate::fracture::{Evidence, Population, column_means, relative_covariance, short_name};
use crate::pipeline::task::Task;
use crate::prior::Prior;
use crate::results_folder::error::WorkflowError;
use crate::runs::fidelity::{added, error_of_all};
use crate::runs::made_on::MadeOn;

/// Covariances of the errors that all specimens share (quantities × quantities, relative to the specimens' means).
pub(crate) struct SharedError {
    surrogate: OfRuns,
    /// Error of the mean response, if the runs share a few specimens.
    specimens: Option<OfRuns>,
    /// Covariance of the error of the corrections from cheaper meshes, if there are corrections.
    mesh: Option<Vec<Vec<f64>>>,
    /// Covariance of the error of the model itself, as specified in the case.
    discrepancy: Option<Vec<Vec<f64>>>,
}

/// Error of a forward model that is estimated from runs: a constant part and a part that depends on the parameters.
#[derive(Default)]
struct OfRuns {
    /// Covariance of the constant part.
    constant: Option<Vec<Vec<f64>>>,
    /// The part that depends on the parameters, and its covariance averaged over the box.
    varying: Option<(CoefficientPosterior, Vec<Vec<f64>>)>,
}

impl SharedError {
    /// Collects the errors that all specimens share: the errors of the surrogate and of `[fidelity]`, and the error of
    /// the model as specified in `[calibration.discrepancy]`.
    ///
    /// The error of the surrogate depends on the specimens of the runs:
    /// - Each run has a separate packing: the residuals with variance s² are scatter between packings, which the
    ///   specimens have too. The shared error is the error of the mean response, s² h(θ), where h is the leverage of
    ///   the fit.
    /// - All runs use the same specimen: the shared error is the lack of fit of the polynomial.
    /// - The runs share a few specimens: the shared error is W + W h(θ) + B g(θ). W is the scatter of runs on the same
    ///   specimen. B g(θ) is the error of a mean response estimated from few specimens ([`of_few`]).
    pub(crate) fn of(
        fitted: &Fitted,
        discrepancy: &DiscrepancyCase,
        means: &[f64],
    ) -> Result<Self, WorkflowError> {
        let with_error = |with_error: CoefficientPosterior| -> Result<_, WorkflowError> {
            let mean = relative_covariance(with_error.mean_error(means)?, means);
            Ok(Some((with_error, mean)))
        };
        let (surrogate, specimens) = match (&fitted.specimens, &fitted.made_on) {
            (Some(specimens), _) => {
                let misses = relative_covariance(specimens.within.scatter(means)?, means);
                let within = with_error(specimens.within.clone())?;
                let of_few = OfRuns { constant: None, varying: with_error(of_few(specimens))? };
                (OfRuns { constant: Some(misses), varying: within }, Some(of_few))
            }
            (None, MadeOn::One) => {
                let misses = relative_covariance(fitted.report.lack_of_fit(means)?, means);
                (OfRuns { constant: Some(misses), varying: None }, None)
            }
            (None, _) => {
                let mean = relative_covariance(fitted.report.mean_error(means)?, means);
                (
                    OfRuns { constant: None, varying: Some((fitted.coefficients.clone(), mean)) },
                    None,
                )
            }
        };
        let mesh = error_of_all(&fitted.corrections, &fitted.made_on)?;
        let discrepancy = discrepancy.covariance(&fitted.report.outputs);
        Ok(Self { surrogate, specimens, mesh, discrepancy })
    }

    fn of_runs(&self) -> impl Iterator<Item = &OfRuns> {
        [&self.surrogate].into_iter().chain(&self.specimens)
    }

    /// Sum of the covariances of all errors, with the parameter-dependent parts averaged over the box. Used if there is
    /// no posterior.
    pub(crate) fn total(&self) -> Vec<Vec<f64>> {
        let errors_of_coefficients =
            self.of_runs().filter_map(|part| part.varying.as_ref().map(|(_, mean)| mean));
        sum(self.constants().chain(errors_of_coefficients))
    }

    /// Sum of the covariances of all errors, with the parameter-dependent parts averaged over the draws of a posterior.
    ///
    /// # Errors
    /// If a draw lies outside the surrogate's box.
    pub(crate) fn over(
        &self,
        posterior: &Posterior,
        evidence: &Evidence,
    ) -> Result<Vec<Vec<f64>>, WorkflowError> {
        let of_runs = self.of_runs().map(|part| part.over(posterior, evidence));
        let of_runs: Vec<Vec<Vec<f64>>> = of_runs.collect::<Result<_, _>>()?;
        let others = [&self.mesh, &self.discrepancy].into_iter().flatten();
        Ok(sum(of_runs.iter().chain(others)))
    }

    /// Covariances that do not depend on the parameters.
    fn constants(&self) -> impl Iterator<Item = &Vec<Vec<f64>>> {
        let others = [&self.mesh, &self.discrepancy].into_iter().flatten();
        self.of_runs().filter_map(|part| part.constant.as_ref()).chain(others)
    }

    /// Returns the evidence for a calibration: the quantities `qois` of the specimens, the errors in `self`, and
    /// the known stiffness ratios.
    pub(crate) fn evidence(
        &self,
        qois: Vec<Vec<f64>>,
        known_stiffness: &KnownStiffness,
    ) -> Evidence {
        let size = qois.first().map_or(0, Vec::len);
        let zeros = vec![vec![0.0; size]; size];
        let shared = sum([&zeros].into_iter().chain(self.constants()));
        let coefficients = self.of_runs().filter_map(|part| part.varying.as_ref());
        let coefficients = coefficients.map(|(coefficients, _)| coefficients.clone()).collect();
        let population = known_stiffness.population.clone();
        Evidence { qois, known: known_stiffness.rows(), population, shared, open: coefficients }
    }
}

impl OfRuns {
    /// Covariance of the error, averaged over the draws of a posterior.
    fn over(
        &self,
        posterior: &Posterior,
        evidence: &Evidence,
    ) -> Result<Vec<Vec<f64>>, WorkflowError> {
        let Some((coefficients, _)) = &self.varying else { return Ok(sum(&self.constant)) };
        let known_inputs = evidence.middle();
        let draws = draws_of(posterior, "theta");
        let some = draws.iter().step_by(draws.len().div_ceil(MOST_DRAWS).max(1));
        let leverages: Vec<f64> = some
            .map(|theta| coefficients.leverage(&[&theta[..], &known_inputs[..]].concat()))
            .collect::<Result<_, _>>()?;
        let mean = leverages.iter().sum::<f64>() / leverages.len().max(1) as f64;
        let means = column_means(&evidence.qois);
        let scatter = relative_covariance(coefficients.scatter(&means)?, &means);
        let row = |row: Vec<f64>| row.into_iter().map(|s| s * mean).collect();
        let coefficients: Vec<Vec<f64>> = scatter.into_iter().map(row).collect();
        Ok(sum(self.constant.iter().chain([&coefficients])))
    }
}

/// Sum of matrices of the same shape; empty if there are no matrices.
fn sum<'a>(matrices: impl IntoIterator<Item = &'a Vec<Vec<f64>>>) -> Vec<Vec<f64>> {
    let mut all = matrices.into_iter();
    let first = all.next().cloned().unwrap_or_default();
    all.fold(first, |sum, more| added(&sum, more))
}

/// Largest number of draws over which an error is averaged.
const MOST_DRAWS: usize = 500;

/// Shares of the sources in the posterior variance of each parameter.
pub(crate) struct Budget {
    pub(crate) parameters: Vec<String>,
    pub(crate) sources: Vec<&'static str>,
    /// For each parameter, the share of each source of error in the posterior variance; the shares
    /// of a parameter sum to 1.
    pub(crate) shares: Vec<Vec<f64>>,
    /// 1 − (posterior variance)/(prior variance) of each parameter.
    pub(crate) contractions: Vec<f64>,
    /// Covariance of the error of surrogate and corrections together, quantities × quantities.
    of_runs: Vec<Vec<f64>>,
}

/// Smallest contraction of a parameter that counts as identified.
const IDENTIFIED: f64 = 0.1;

/// Name of the source whose share decreases with more runs.
pub(crate) const OF_SURROGATE: &str = "surrogate";

/// Errors of the quantities of one test, linearised at the posterior mean.
pub(crate) struct TestSources {
    /// Derivatives of the quantities of each group of specimens with respect to the parameters, relative to the means
    /// of the specimens.
    pub(crate) jacobian: Vec<Vec<f64>>,
    /// For each source of error: its name, and the covariance of the error that it causes in the
    /// means of all groups.
    pub(crate) sources: Vec<(&'static str, DMatrix<f64>)>,
    /// Covariance of the error of surrogate and corrections together, quantities × quantities.
    of_runs: Vec<Vec<f64>>,
}

/// Computes the covariance of the means of the quantities of a test that each source contributes:
///
/// - surrogate: the error of the surrogate that all specimens share, averaged over the posterior;
/// - mesh: the error of the correction from cheaper meshes. The discretisation error of the mesh of the specimen
///   is not included in any interval, and is reported in `confirm.csv`;
/// - discrepancy: the error of the model itself, as specified in the case;
/// - geometry: the scatter between packings divided by n, if runs show this scatter; the error of a mean response
///   estimated from few specimens; and the unknown stiffness of specimens without an image;
/// - specimens: the scatter between specimens minus the scatter between packings, divided by n.
///
/// Returns `None` if the posterior has no covariance between specimens.
pub(crate) fn sources_of_test(
    fitted: &Fitted,
    posterior: &Posterior,
    evidence: &Evidence,
    shared: &SharedError,
) -> Result<Option<TestSources>, WorkflowError> {
    let means = column_means(&evidence.qois);
    let (unknown, groups) = (fitted.unknown(), groups(evidence));
    let draws = draws_of(posterior, "theta");
    let means_of_draws = column_means(&draws);
    let Some(scatter) = mean_scatter(posterior, means.len()) else { return Ok(None) };
    let of_surrogate = shared.surrogate.over(posterior, evidence)?;
    let of_runs = match &shared.mesh {
        Some(mesh) => added(&of_surrogate, mesh),
        None => of_surrogate.clone(),
    };
    // covariance of the group means, for an error that all specimens share and for errors that are independent between
    // specimens
    let shared_by_all = |part: &[Vec<f64>]| blocks(&groups, |_, _| matrix(part));
    let zero = DMatrix::zeros(means.len(), means.len());
    let of_each = |part: &DMatrix<f64>| {
        blocks(&groups, |g, h| if g == h { part / groups[g].size } else { zero.clone() })
    };
    let mut of_population: Option<DMatrix<f64>> = None;
    let mut sources = vec![(OF_SURROGATE, shared_by_all(&of_surrogate))];
    sources.extend(shared.mesh.as_ref().map(|mesh| ("mesh", shared_by_all(mesh))));
    sources.extend(shared.discrepancy.as_ref().map(|model| ("discrepancy", shared_by_all(model))));
    let mut geometry: Option<DMatrix<f64>> = None;
    let mut remaining = scatter.clone();
    if let Some(packings) = fitted.between_microstructures(&means)? {
        let packings = matrix(&packings);
        let packings = &packings * largest_part(&scatter, &packings);
        remaining -= &packings;
        geometry = Some(of_each(&packings));
    }
    if let Some(of_few) = &shared.specimens {
        let of_few = shared_by_all(&of_few.over(posterior, evidence)?);
        geometry = Some(geometry.map_or_else(|| of_few.clone(), |all| all + &of_few));
    }

    let mut jacobian: Vec<Vec<f64>> = Vec::new();
    for group in &groups {
        // inputs that are known from the specimens (the stiffness ratio) are not parameters: fix them at their group
        // means
        let mean_point = [&means_of_draws[..], &group.inputs].concat();
        let (_, slopes) = fitted.pce.value_and_jacobian(&mean_point)?;
        let relative = |(row, mean): (&Vec<f64>, &f64)| row.iter().map(|s| s / mean).collect();
        let slopes: Vec<Vec<f64>> = slopes.iter().zip(&means).map(relative).collect();
        jacobian.extend(group.recorded.iter().map(|&m| slopes[m][..unknown.len()].to_vec()));
        if let Some(population) = group.population {
            // change of the quantities for one standard deviation of each unknown input
            let column = |row: &Vec<f64>| {
                row[unknown.len()..]
                    .iter()
                    .zip(population.sd())
                    .map(|(slope, sd)| slope * sd)
                    .collect()
            };
            let columns = matrix(&slopes.iter().map(column).collect::<Vec<_>>());
            // each specimen has a different stiffness; the error of the estimated mean stiffness of the population is the
            // same for all groups of the population
            let between = &columns * columns.transpose();
            let of_groups = |a: usize, b: usize| {
                let is_unknown = groups[a].population.is_some() && groups[b].population.is_some();
                let own = if a == b { groups[a].size.recip() } else { 0.0 };
                if is_unknown {
                    &between * (own + population.count().recip())
                } else {
                    zero.clone()
                }
            };
            of_population.get_or_insert_with(|| blocks(&groups, of_groups));
        }
    }
    if let Some(own) = of_population {
        geometry = Some(geometry.map_or_else(|| own.clone(), |all| all + &own));
    }
    sources.extend(geometry.map(|geometry| ("geometry", geometry)));
    sources.push(("specimens", of_each(&remaining)));

    Ok(Some(TestSources { jacobian, sources, of_runs }))
}

/// Computes the shares of the sources of [`sources_of_test`] in the posterior variance of each parameter.
///
/// Returns `None` if the covariance of all sources together is not positive definite.
pub(crate) fn budget(
    fitted: &Fitted,
    priors: &[Prior],
    posterior: &Posterior,
    evidence: &Evidence,
    shared: &SharedError,
) -> Result<Option<Budget>, WorkflowError> {
    let Some(test) = sources_of_test(fitted, posterior, evidence, shared)? else { return Ok(None) };
    let TestSources { jacobian, sources, of_runs } = test;
    let draws = draws_of(posterior, "theta");
    let means_of_draws = column_means(&draws);
    let variance = |(i, mean): (usize, &f64)| {
        draws.iter().map(|draw| (draw[i] - mean).powi(2)).sum::<f64>() / draws.len() as f64
    };
    let variances = means_of_draws.iter().enumerate().map(variance);
    let prior: Vec<f64> = priors.iter().map(Univariate::variance).collect();
    let contractions = variances.zip(&prior).map(|(after, prior)| 1.0 - after / prior).collect();
    let parameters = fitted.unknown().iter().map(|input| input.name.clone()).collect();
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
    /// Share of a source in the posterior variance of each parameter.
    pub(crate) fn shares_of(&self, source: &str) -> Vec<f64> {
        let index = self.sources.iter().position(|known_source| *known_source == source);
        self.shares.iter().map(|shares| index.map_or(0.0, |index| shares[index])).collect()
    }

    /// Returns the identified parameter with the largest share of the surrogate, and this share. Parameters that are
    /// not identified have the width of the prior, even with an exact surrogate. If no parameter is identified, all
    /// parameters are compared, because an inaccurate surrogate may be the cause.
    pub(crate) fn largest_share(&self) -> Option<(&str, f64)> {
        let all =
            || self.parameters.iter().zip(self.shares_of(OF_SURROGATE)).zip(&self.contractions);
        let any = all().any(|(_, contraction)| *contraction >= IDENTIFIED);
        all()
            .filter(|(_, contraction)| !any || **contraction >= IDENTIFIED)
            .map(|((parameter, share), _)| (parameter.as_str(), share))
            .max_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Writes `uncertainty.csv`.
    pub(crate) fn write(&self, task: &Task<'_>) -> Result<(), WorkflowError> {
        let rows = self.parameters.iter().zip(&self.shares).flat_map(|(parameter, shares)| {
            let row = |(source, share): (&&str, &f64)| {
                [parameter.clone(), (*source).to_owned(), share.to_string()]
            };
            self.sources.iter().zip(shares).map(row).collect::<Vec<_>>()
        });
        task.write_csv("uncertainty.csv", ["parameter", "source", "share"], rows)
    }

    /// Returns a warning if the error of the runs widens the posterior: n S/Σ > 0.1 for some quantity, where S is the
    /// relative variance of this error, Σ the relative variance between specimens, and n the number of specimens that have the quantity.
    pub(crate) fn warning(
        &self,
        summary: &Summary,
        quantities: &[String],
        evidence: &Evidence,
    ) -> Option<String> {
        let worst = quantities
            .iter()
            .enumerate()
            .filter_map(|(m, name)| {
                let sd = summary.row(&format!("sd[{}]", short_name(name)))?.mean;
                Some((evidence.specimens_with(m) as f64 * self.of_runs[m][m] / (sd * sd), name))
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        worst.filter(|(ratio, _)| *ratio > 0.1).map(|(ratio, name)| {
            format!(
                "Errors of the surrogate and of the mesh correction widen the intervals noticeably (variance ratio \
                 {ratio:.2} for {name}). More runs in the design, a table [sequential], or more repeats in [fidelity] make \
                 the intervals narrower."
            )
        })
    }
}

/// Draws of a quantity, one row per draw.
pub(crate) fn draws_of(posterior: &Posterior, name: &str) -> Vec<Vec<f64>> {
    let group = &posterior.posterior;
    let Some(values) = group.variables.iter().find(|v| v.name == name) else { return Vec::new() };
    let size = values.data.len() / (group.chains * group.draws).max(1);
    values.data.chunks(size.max(1)).map(<[f64]>::to_vec).collect()
}

/// Group of specimens with the same covariance.
struct Group<'a> {
    size: f64,
    /// Indices of the quantities that the specimens have.
    recorded: Vec<usize>,
    /// Last inputs of the surrogate (the stiffness ratio), averaged over the group.
    inputs: Vec<f64>,
    /// Distribution of the inputs over all possible specimens, if the inputs of the specimens are
    /// unknown.
    population: Option<&'a Population>,
}

/// Splits the specimens into groups: specimens of one group have the same quantities, and all or none of them have known
/// inputs. Groups with known inputs come first.
fn groups(evidence: &Evidence) -> Vec<Group<'_>> {
    let recorded = evidence.recorded();
    let known = |k: usize| evidence.known.get(k).cloned().unwrap_or_else(|| Some(Vec::new()));
    let mut groups: Vec<(bool, Vec<usize>, Vec<Vec<f64>>)> = Vec::new();
    for is_known in [true, false] {
        for (k, own) in recorded.iter().enumerate().filter(|(k, _)| known(*k).is_some() == is_known)
        {
            let inputs = known(k).unwrap_or_default();
            let same = |group: &&mut (bool, Vec<usize>, Vec<Vec<f64>>)| {
                group.0 == is_known && group.1 == *own
            };
            match groups.iter_mut().find(same) {
                Some(group) => group.2.push(inputs),
                None => groups.push((is_known, own.clone(), vec![inputs])),
            }
        }
    }
    let population = |is_known: bool| evidence.population.as_ref().filter(|_| !is_known);
    let group = |(is_known, recorded, inputs): (bool, Vec<usize>, Vec<Vec<f64>>)| Group {
        size: inputs.len() as f64,
        recorded,
        inputs: population(is_known).map_or_else(|| column_means(&inputs), |p| p.mean().to_vec()),
        population: population(is_known),
    };
    groups.into_iter().map(group).collect()
}

/// Assembles a matrix for the means of the quantities of all groups from one block for each pair of groups. A block has one
/// row and one column per quantity. Rows and columns of quantities that a group has not recorded are omitted.
fn blocks(groups: &[Group<'_>], block: impl Fn(usize, usize) -> DMatrix<f64>) -> DMatrix<f64> {
    let starts: Vec<usize> = groups
        .iter()
        .scan(0, |next, group| {
            let start = *next;
            *next += group.recorded.len();
            Some(start)
        })
        .collect();
    let size = groups.iter().map(|group| group.recorded.len()).sum();
    let mut whole = DMatrix::zeros(size, size);
    for (g, a) in groups.iter().enumerate() {
        for (h, b) in groups.iter().enumerate() {
            let part = block(g, h).select_rows(&a.recorded).select_columns(&b.recorded);
            whole.view_mut((starts[g], starts[h]), part.shape()).copy_from(&part);
        }
    }
    whole
}

/// Posterior mean of the covariance between specimens, diag(sd) R diag(sd) with standard deviations sd and correlations
/// R.
pub(crate) fn mean_scatter(posterior: &Posterior, size: usize) -> Option<DMatrix<f64>> {
    let group = &posterior.posterior;
    let values_of = |name: &str| group.variables.iter().find(|v| v.name == name).map(|v| &v.data);
    let (sd, corr) = (values_of("sd")?, values_of("corr")?);
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
