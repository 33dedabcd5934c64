//! Posterior of a finished run: named draws, predictions and diagnostics.

mod collect;
mod error;
mod estimates;
mod from_draws;
mod row;
mod sample;

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use crate::density::{Location, Rejection};
use crate::diagnostics::{Identifiability, Loo, LooError};
use crate::model::bound::Bound;
use crate::model::context::Model;
use crate::model::erased::ErasedModel;
use crate::quantity::draws::{Group, Values, element_names};
use crate::quantity::layout::{LabelError, Layout};
use crate::quantity::record::{Role, Variable};
use crate::sampler::Chains;
use collect::{Collected, Columns};
pub use error::{PosteriorError, SampleError};
pub use estimates::EstimateError;
pub use row::SummaryRow;

/// Number of prior draws stored with every posterior. With this number, the relative standard error of the prior
/// variance is about 3 %.
const PRIOR_DRAWS: usize = 2000;

/// A divergence, described by the parameters of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct DivergentPoint {
    /// Index of the chain.
    pub chain: usize,
    /// Index, within the chain, of the draw whose trajectory diverged.
    pub draw: usize,
    /// Parameter values at the divergence by element name; empty if the model rejects the point.
    pub values: Vec<(String, f64)>,
}

/// Draws from a posterior, by name and shape, with predictions and sampler statistics.
///
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     fn strength(measured: &[f64]) {
///         let mean ~ Uniform(100.0, 200.0); // N
///         let sd ~ HalfNormal(20.0);
///         for measured in measured {
///             measured ~ Normal(mean, sd);
///         }
///         #[predict] let next ~ Normal(mean, sd);
///     }
/// }
///
/// let forces = [147.0, 139.5, 151.2, 144.8];
/// let posterior = Nuts::default().seed(7).sample(&strength(&forces))?;
/// println!("{}", posterior.summary());
/// println!("95 % of specimens bear {:.0} N", posterior.quantile("next", 0.05)?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Tracked quantities, predictions, replicates of the data and pointwise log-likelihoods are computed once, when the
/// posterior is created, so that the posterior does not borrow the model. If a chain stopped early, all chains are
/// cut to the length of the shortest chain. All results are reproducible from the seed of the run, for any number of
/// threads.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// Names, shapes, dimensions and roles of all quantities.
    pub layout: Layout,
    /// Draws of parameters and tracked quantities, in constrained space.
    pub posterior: Group,
    /// Draws of the `#[predict]` quantities, and replicates of each observed quantity under its name.
    pub predictive: Group,
    /// Pointwise log-likelihood of every executed observation statement.
    pub log_likelihood: Group,
    /// Log prior density of every parameter at every draw, one number per parameter name.
    pub log_prior: Group,
    /// Observed data, as one chain with one draw.
    pub observed: Group,
    /// Prior draws of parameters and tracked quantities; `None` if the model rejects its own prior draws.
    pub prior: Option<Group>,
    /// Prior draws of the `#[predict]` quantities, and replicates of each observed quantity under the prior; `None`
    /// if there are no prior draws.
    pub prior_predictive: Option<Group>,
    /// Number of prior draws that a statement rejected, by the location of the statement. These draws are not part of
    /// `prior`.
    pub prior_rejections: BTreeMap<Location, u64>,
    /// Unconstrained draws and statistics of the sampler.
    pub chains: Chains,
    /// Points at which trajectories diverged.
    pub divergences: Vec<DivergentPoint>,
    /// Number of posterior draws at which a statement rejected the computation of predictions, by the location of the
    /// statement. The predictions at these draws are NaN.
    pub unpredicted: BTreeMap<Location, u64>,
    /// Bounds of the priors' supports, one entry per variable of the layout.
    bounds: Vec<Option<(f64, f64)>>,
    /// Whether the chains were drawn from a density that differs from the density of the model.
    pub(crate) is_foreign: bool,
    /// Whether the model adds terms to its density by `factor`.
    has_factors: bool,
    /// Names of observations without data.
    pub(crate) without_data: Vec<String>,
}

impl Posterior {
    /// Computes all named quantities of the model at every draw of `chains`.
    ///
    /// `seed` determines predictions, replicates and prior draws. The random numbers are independent of the random
    /// numbers of a sampler with the same seed.
    ///
    /// # Errors
    /// [`PosteriorError`] if the number of coordinates of the chains differs from the model's, if there is no chain, if a
    /// chain is empty, or if the model is invalid. Chains that were drawn with different data are not an error, because they are used
    /// to predict held-out data; the summary then warns that the chains come from another density. A draw at which a
    /// prediction is rejected is not an error either: the values of the following statements are NaN, and the draw is
    /// counted in `unpredicted`.
    pub fn from_chains<M: Model>(
        model: &Bound<M>,
        chains: Chains,
        seed: u64,
    ) -> Result<Self, PosteriorError> {
        Self::of_erased(model, chains, seed)
    }

    /// Type-erased version of [`from_chains`](Self::from_chains), which is compiled once.
    pub(crate) fn of_erased(
        model: &dyn ErasedModel,
        chains: Chains,
        seed: u64,
    ) -> Result<Self, PosteriorError> {
        let layout = model.layout()?.clone();
        if chains.dim != layout.dim {
            return Err(PosteriorError::Dimension { expected: layout.dim, got: chains.dim });
        }
        if chains.chains.is_empty() {
            return Err(PosteriorError::NoChains);
        }
        chains.check().map_err(PosteriorError::Damaged)?;
        for (index, chain) in chains.chains.iter().enumerate() {
            if chain.is_empty() {
                let source = chain.stopped.clone();
                return Err(PosteriorError::NoDraws { chain: index, source });
            }
        }

        // long jumps of the generator make the random streams of predictions and prior draws independent of the
        // sampler's streams, which are separated by short jumps
        let mut prior_rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        prior_rng.long_jump();
        let mut streams = prior_rng.clone();
        streams.long_jump();
        let template = model.draw_prior(&mut prior_rng, &mut |_| ())?;
        let plan = Columns::new(&template);

        let streams: Vec<_> = chains
            .chains
            .iter()
            .map(|_| {
                streams.jump();
                streams.clone()
            })
            .collect();
        let draws = chains.len();
        let collected_by_chain: Vec<Collected> = streams
            .into_par_iter()
            .enumerate()
            .map(|(index, mut rng)| {
                let mut out = Collected::new(&plan);
                for draw in 0..draws {
                    let start = draw * chains.dim;
                    let point = &chains.chains[index].draws[start..start + chains.dim];
                    out.add(&plan, model.record_at(point, &mut rng), index)?;
                }
                Ok(out)
            })
            .collect::<Result<_, PosteriorError>>()?;
        let mut unpredicted = BTreeMap::new();
        for (location, count) in collected_by_chain.iter().flat_map(|collected| &collected.rejected)
        {
            *unpredicted.entry(*location).or_insert(0) += count;
        }
        let [posterior, predictive, log_likelihood, log_prior] =
            plan.groups(collected_by_chain, draws);

        let mut prior_rejections = BTreeMap::new();
        let drawn = prior_draws(model, &plan, &mut prior_rng, &mut prior_rejections)?;
        let (prior, prior_predictive) = match drawn {
            Some([prior, predictive, ..]) => (Some(prior), Some(predictive)),
            None => (None, None),
        };
        let divergences = divergent_points(model, &chains, &mut prior_rng);
        let observed = template.entries.iter().filter(|e| e.variable.role == Role::Observed);
        let observed = observed.map(|e| Values {
            name: e.variable.name.clone(),
            shape: e.variable.shape.clone(),
            data: e.values.clone(),
        });
        let bounds = layout.variables.iter().map(|v| template.get(&v.name)?.bounds).collect();
        Ok(Self {
            layout,
            posterior,
            predictive,
            log_likelihood,
            log_prior,
            observed: Group { chains: 1, draws: 1, variables: observed.collect() },
            prior,
            prior_predictive,
            prior_rejections,
            divergences,
            unpredicted,
            bounds,
            is_foreign: is_foreign(model, &chains),
            has_factors: template.factors.is_some(),
            without_data: template.without_data,
            chains,
        })
    }

    /// Returns the draws of a parameter, a tracked quantity or a prediction; `None` if there is no such quantity.
    pub fn values(&self, name: &str) -> Option<&Values> {
        self.posterior.get(name).or_else(|| self.predictive.get(name))
    }

    /// Returns the trace of one number, such as `young` or `sd[0]`: one vector of draws per chain. An element can
    /// also be named by its label, as in `sd[north]`; if the text is also a valid index, the index has precedence.
    pub fn trace(&self, element: &str) -> Option<Vec<Vec<f64>>> {
        let by_index = |element: &str| {
            self.posterior.trace(element).or_else(|| self.predictive.trace(element))
        };
        by_index(element).or_else(|| by_index(&self.layout.index_of(element)?))
    }

    /// Sets labels for the entries along one dimension of a quantity, used in tables and exports:
    /// `posterior.label("mean", 0, &["slope", "peak force", "displacement at peak"])?`.
    ///
    /// If the model names the dimension by `#[dims(…)]`, the labels apply to all quantities with this dimension.
    ///
    /// # Errors
    /// [`LabelError`] if the quantity or the dimension does not exist, or if the number of labels is wrong.
    pub fn label(
        &mut self,
        name: &str,
        dimension: usize,
        labels: &[&str],
    ) -> Result<(), LabelError> {
        self.layout.label(name, dimension, labels)
    }

    /// Sets the units of a quantity for exports. Give one unit for all numbers of the quantity, or one unit for each
    /// entry along its last dimension: `posterior.set_units("mean", &["N/mm", "N", "mm"])?`.
    ///
    /// # Errors
    /// [`LabelError`] if the quantity does not exist, or if the number of units is wrong.
    pub fn set_units(&mut self, name: &str, units: &[&str]) -> Result<(), LabelError> {
        self.layout.set_units(name, units)
    }

    /// Leave-one-out cross-validation over all observation statements. Terms that `factor` adds to the density are
    /// never left out; [`Loo::has_factors`] reports such terms.
    ///
    /// # Errors
    /// [`LooError`] if the model observes nothing or a log-likelihood is not finite.
    pub fn loo(&self) -> Result<Loo, LooError> {
        let group = &self.log_likelihood;
        let per_draw: usize = group.variables.iter().map(Values::size).sum();
        let mut rows = Vec::with_capacity(group.chains * group.draws * per_draw);
        for draw in 0..group.chains * group.draws {
            for values in &group.variables {
                let size = values.size();
                rows.extend_from_slice(&values.data[draw * size..(draw + 1) * size]);
            }
        }
        let mut hasher = DefaultHasher::new();
        let data = self.observed.variables.iter().flat_map(|values| &values.data);
        data.for_each(|x| x.to_bits().hash(&mut hasher));
        let loo = Loo::new(group.chains, group.draws, per_draw, &rows)?;
        Ok(Loo { data: Some(hasher.finish()), has_factors: self.has_factors, ..loo })
    }

    /// Whether the model adds terms to the density other than the prior, that is, observations or `factor` terms.
    pub(crate) fn has_likelihood(&self) -> bool {
        self.has_factors || !self.log_likelihood.variables.is_empty()
    }

    /// Compares prior and posterior of every parameter. The list is empty if there are no prior draws.
    pub fn identifiability(&self) -> Vec<Identifiability> {
        let Some(prior) = &self.prior else {
            return Vec::new();
        };
        let mut rows = Vec::new();
        for (Variable { name, role, .. }, bounds) in self.layout.variables.iter().zip(&self.bounds)
        {
            if *role != Role::Parameter {
                continue;
            }
            let (Some(before), Some(after)) = (prior.get(name), self.posterior.get(name)) else {
                continue;
            };
            let names = before.elements();
            rows.par_extend(names.into_par_iter().enumerate().filter_map(|(index, element)| {
                let [before, after] =
                    [(prior, before), (&self.posterior, after)].map(|(g, v)| g.column(v, index));
                // skip numbers that are constant, such as the zeros of a Cholesky factor: they are not parameters
                let moves = before.iter().any(|x| *x != before[0]);
                moves.then(|| Identifiability::of_draws(element, &before, &after, *bounds))
            }));
        }
        rows
    }

    /// Number of rejected points by the location of the rejecting statement: the pair (in the warmup, after the
    /// warmup).
    pub fn rejections(&self) -> BTreeMap<Location, (u64, u64)> {
        let mut counts: BTreeMap<Location, (u64, u64)> = BTreeMap::new();
        for chain in &self.chains.chains {
            for (location, count) in &chain.warmup.rejections {
                counts.entry(*location).or_default().0 += count;
            }
            for (location, count) in &chain.rejections {
                counts.entry(*location).or_default().1 += count;
            }
        }
        counts
    }
}

fn prior_draws(
    model: &dyn ErasedModel,
    plan: &Columns,
    rng: &mut Xoshiro256PlusPlus,
    rejections: &mut BTreeMap<Location, u64>,
) -> Result<Option<[Group; 4]>, PosteriorError> {
    let mut out = Collected::new(plan);
    let mut rejected = |rejection: &Rejection| {
        if let Some(location) = rejection.location() {
            *rejections.entry(location).or_insert(0) += 1;
        }
    };
    for _ in 0..PRIOR_DRAWS {
        match model.draw_prior(rng, &mut rejected) {
            Ok(record) => out.add(plan, (record, Ok(())), 0)?,
            Err(_) => return Ok(None),
        }
    }
    Ok(Some(plan.groups(vec![out], PRIOR_DRAWS)))
}

/// Whether the log densities stored in the chains differ from the log densities of the model by more than rounding
/// errors and a constant.
fn is_foreign(model: &dyn ErasedModel, chains: &Chains) -> bool {
    const SAME: f64 = 1e-6;
    let Some(chain) = chains.chains.first() else { return false };
    let mut evaluator = model.evaluator();
    let mut at = |draw: usize| {
        let point = &chain.draws[draw * chains.dim..][..chains.dim];
        let then = chain.stats[draw].log_density;
        (then, evaluator.log_density(point).unwrap_or(f64::NAN))
    };
    // only differences are compared, because the sampled density may omit a constant
    let (first, last) = (at(0), at(chain.len() - 1));
    let difference = (last.1 - first.1) - (last.0 - first.0);
    let size = [first.0, first.1, last.0, last.1].iter().fold(1.0f64, |size, x| size.max(x.abs()));
    difference.is_nan() || difference.abs() > SAME * size
}

fn divergent_points(
    model: &dyn ErasedModel,
    chains: &Chains,
    rng: &mut Xoshiro256PlusPlus,
) -> Vec<DivergentPoint> {
    let mut divergent_points = Vec::new();
    for (chain, run) in chains.chains.iter().enumerate() {
        for divergence in &run.divergences {
            let (record, outcome) = model.record_at(&divergence.position, rng);
            let record = outcome.is_ok().then_some(record);
            let entries = record.iter().flat_map(|record| &record.entries);
            let values = entries
                .filter(|e| e.variable.role == Role::Parameter)
                .flat_map(|e| {
                    element_names(&e.variable.name, &e.variable.shape)
                        .into_iter()
                        .zip(e.values.iter().copied())
                })
                .collect();
            divergent_points.push(DivergentPoint { chain, draw: divergence.draw, values });
        }
    }
    divergent_points
}
