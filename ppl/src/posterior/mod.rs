//! A finished run: draws by name, predictions, and everything needed to judge them.

mod collect;
mod error;
mod row;
mod sample;

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use crate::bound::Bound;
use crate::density::{Location, Rejection};
use crate::diagnostics::{Identifiability, Loo, LooError};
use crate::erased::ErasedModel;
use crate::group::{Group, Values, element_names};
use crate::layout::{LabelError, Layout};
use crate::model::Model;
use crate::record::{Role, Variable};
use crate::sampler::Chains;
use collect::{Collected, Columns};
pub use error::{PosteriorError, SampleError};
pub use row::SummaryRow;

/// Prior draws taken beside every posterior: enough for a prior variance to about 3 %.
const PRIOR_DRAWS: usize = 2000;

/// Where a trajectory diverged, in the model's own quantities.
#[derive(Clone, Debug, PartialEq)]
pub struct DivergentPoint {
    /// Chain.
    pub chain: usize,
    /// Draw in the chain whose trajectory diverged.
    pub draw: usize,
    /// Parameters there by element name; empty if the model rejects the point.
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
/// let next = posterior.trace("next").expect("a prediction of the model").concat();
/// println!("95 % of specimens bear {:.0} N", ppl::diagnostics::quantile(&next, 0.05));
/// # Ok::<(), ppl::SampleError>(())
/// ```
///
/// Tracked quantities, predictions, replicates of the data and pointwise log-likelihoods are
/// computed once, when the posterior is made, so that it does not hold on to the model. Chains
/// that stopped early are cut to the shortest. Everything is reproducible from the seed of the
/// run, whatever the number of threads.
#[derive(Clone, Debug)]
pub struct Posterior {
    /// Names, shapes, dimensions and roles.
    pub layout: Layout,
    /// Parameters and tracked quantities on their own scale.
    pub posterior: Group,
    /// `#[predict]` quantities, and under the name of each observed quantity a replicate of it.
    pub predictive: Group,
    /// Log density of every observation statement executed.
    pub log_likelihood: Group,
    /// Log prior density of every parameter at every draw, one number a name.
    pub log_prior: Group,
    /// The data: one chain with one draw.
    pub observed: Group,
    /// Prior draws of parameters and tracked quantities; `None` if the model rejected one for good.
    pub prior: Option<Group>,
    /// Prior predictions and replicates.
    pub prior_predictive: Option<Group>,
    /// Draws that the prior made beside those, and a statement rejected, by location.
    pub prior_rejections: BTreeMap<Location, u64>,
    /// Unconstrained draws and the sampler's statistics.
    pub chains: Chains,
    /// Where trajectories diverged.
    pub divergences: Vec<DivergentPoint>,
    /// Draws at which the model could not be evaluated again, by location: their predictions are NaN.
    pub unpredicted: BTreeMap<Location, u64>,
    /// The ends of the priors' supports, one for each of the layout's variables.
    bounds: Vec<Option<(f64, f64)>>,
    /// Whether the chains were drawn from another density than the model's.
    pub(crate) is_foreign: bool,
    /// Whether the model adds to its density by `factor`.
    has_factors: bool,
    /// Observations that had no data.
    pub(crate) without_data: Vec<String>,
}

impl Posterior {
    /// Computes everything that the model names at every draw of `chains`.
    ///
    /// `seed` drives predictions, replicates and prior draws; they are independent of the sampler's
    /// stream with the same seed.
    ///
    /// # Errors
    /// [`PosteriorError`] if the chains have another number of coordinates than the model, one is
    /// empty, or the model itself is at fault. Chains of the same unknowns with other data are no
    /// error, as held-out data need them; the summary says that they are of another density. A draw
    /// at which a prediction rejects is none either: what follows the statement is NaN, and counted.
    pub fn from_chains<M: Model>(
        model: &Bound<M>,
        chains: Chains,
        seed: u64,
    ) -> Result<Self, PosteriorError> {
        Self::of_erased(model, chains, seed)
    }

    /// As [`from_chains`](Self::from_chains), compiled once.
    pub(crate) fn of_erased(
        model: &dyn ErasedModel,
        chains: Chains,
        seed: u64,
    ) -> Result<Self, PosteriorError> {
        let layout = model.layout()?.clone();
        if chains.dim != layout.dim {
            return Err(PosteriorError::Dimension { expected: layout.dim, got: chains.dim });
        }
        chains.check().map_err(PosteriorError::Damaged)?;
        for (index, chain) in chains.chains.iter().enumerate() {
            if chain.is_empty() {
                let source = chain.stopped.clone();
                return Err(PosteriorError::NoDraws { chain: index, source });
            }
        }

        // long jumps keep these streams apart from the sampler's, which are short jumps apart
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
        let parts: Vec<Collected> = streams
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
        for (location, count) in parts.iter().flat_map(|part| &part.rejected) {
            *unpredicted.entry(*location).or_insert(0) += count;
        }
        let [posterior, predictive, log_likelihood, log_prior] = plan.groups(parts, draws);

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

    /// Draws of a parameter, tracked quantity or prediction.
    pub fn values(&self, name: &str) -> Option<&Values> {
        self.posterior.get(name).or_else(|| self.predictive.get(name))
    }

    /// One vector a chain for one number, as `young` or `sd[0]`; where there are labels also
    /// `sd[north]`, if no number is called so by its index.
    pub fn trace(&self, element: &str) -> Option<Vec<Vec<f64>>> {
        let of = |element: &str| {
            self.posterior.trace(element).or_else(|| self.predictive.trace(element))
        };
        of(element).or_else(|| of(&self.layout.index_of(element)?))
    }

    /// Labels the entries along one dimension of a quantity, in tables and exports:
    /// `posterior.label("mean", 0, &["slope", "peak force", "displacement at peak"])?`.
    ///
    /// A dimension that was named in the model, by `#[dims(…)]`, gets the labels wherever it
    /// stands.
    ///
    /// # Errors
    /// [`LabelError`] for a name or dimension that does not exist, or a wrong number of labels.
    pub fn label(
        &mut self,
        name: &str,
        dimension: usize,
        labels: &[&str],
    ) -> Result<(), LabelError> {
        self.layout.label(name, dimension, labels)
    }

    /// Says in what units a quantity is, for exports: one unit for all of its numbers, or one for each
    /// entry along its last dimension: `posterior.set_units("mean", &["N/mm", "N", "mm"])?`.
    ///
    /// # Errors
    /// [`LabelError`] for a name that does not exist, or another number of units than of entries.
    pub fn set_units(&mut self, name: &str, units: &[&str]) -> Result<(), LabelError> {
        self.layout.set_units(name, units)
    }

    /// Leave-one-out cross-validation over all observation statements. What `factor` adds to the
    /// density is kept throughout; the result says so if there is any.
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

    /// Whether the density is more than the prior.
    pub(crate) fn has_likelihood(&self) -> bool {
        self.has_factors || !self.log_likelihood.variables.is_empty()
    }

    /// What the data did to every parameter; empty without prior draws.
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
                // structural constants, as the zeros of a Cholesky factor, are not parameters
                let moves = before.iter().any(|x| *x != before[0]);
                moves.then(|| Identifiability::of_draws(element, &before, &after, *bounds))
            }));
        }
        rows
    }

    /// Points rejected by statement: (warmup, sampling).
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

/// Whether log densities differ from draw to draw by more than another order of the same sums would
/// change.
fn is_foreign(model: &dyn ErasedModel, chains: &Chains) -> bool {
    const SAME: f64 = 1e-6;
    let Some(chain) = chains.chains.first() else { return false };
    let mut evaluator = model.evaluator();
    let mut at = |draw: usize| {
        let point = &chain.draws[draw * chains.dim..][..chains.dim];
        let then = chain.stats[draw].log_density;
        (then, evaluator.log_density(point).unwrap_or(f64::NAN))
    };
    // a constant may have been left out
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
    let mut points = Vec::new();
    for (chain, found) in chains.chains.iter().enumerate() {
        for divergence in &found.divergences {
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
            points.push(DivergentPoint { chain, draw: divergence.draw, values });
        }
    }
    points
}
