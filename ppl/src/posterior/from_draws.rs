//! Posteriors computed from draws of another program.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{Posterior, PosteriorError};
use crate::model::bound::Bound;
use crate::model::context::Model;
use crate::model::erased::ErasedModel;
use crate::model::start::StartKind;
use crate::quantity::draws::Group;
use crate::quantity::record::Role;
use crate::sampler::{Chain, Chains, DrawStats, WarmupReport};

impl Posterior {
    /// Computes the posterior from draws of the parameters, for example of another sampler or from a file. `draws` has
    /// the values of every parameter of the model by name, in constrained space; quantities that are not parameters are
    /// ignored. Tracked quantities, predictions and log-likelihoods are computed from the parameters.
    ///
    /// # Errors
    /// [`PosteriorError::Draws`] if a parameter is missing, has the wrong number of values, or has a value outside the
    /// support of its prior; the other variants as for [`from_chains`](Self::from_chains).
    ///
    /// # Example
    /// ```
    /// use ppl::prelude::*;
    /// use ppl::{Group, Posterior, Values};
    ///
    /// ppl::model! {
    ///     fn counts(counts: &[u64]) {
    ///         let rate ~ Gamma(2.0, 0.5);
    ///         for count in counts {
    ///             count ~ Poisson(rate);
    ///         }
    ///         #[track] let twice = 2.0 * rate;
    ///     }
    /// }
    /// let rate = Values { name: "rate".into(), shape: vec![], data: vec![3.0, 4.0, 5.0, 4.0] };
    /// let draws = Group { chains: 2, draws: 2, variables: vec![rate] };
    /// let posterior = Posterior::from_draws(&counts(&[4, 7, 2, 5]), &draws)?;
    /// assert_eq!(posterior.mean("twice")?, 8.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn from_draws<M: Model>(model: &Bound<M>, draws: &Group) -> Result<Self, PosteriorError> {
        let chains = chains(model, draws)?;
        Self::of_erased(model, chains, 0)
    }
}

/// Converts draws by name to chains in unconstrained space.
fn chains(model: &dyn ErasedModel, draws: &Group) -> Result<Chains, PosteriorError> {
    let layout = model.layout()?;
    let per_chain = draws.draws;
    let mut columns = Vec::new();
    for variable in layout.with_role(Role::Parameter) {
        let values = draws.get(&variable.name).ok_or_else(|| {
            let given: Vec<_> = draws.variables.iter().map(|v| format!("`{}`", v.name)).collect();
            let given = if given.is_empty() { "nothing".to_owned() } else { given.join(", ") };
            misfit(format!(
                "the parameter `{}` is missing; the draws contain {given}",
                variable.name
            ))
        })?;
        let size: usize = variable.shape.iter().product();
        let (expected, got) = (size * draws.chains * per_chain, values.data.len());
        if got != expected {
            return Err(misfit(format!(
                "`{}` has {got} numbers, but {} chains × {per_chain} draws × {size} numbers need {expected}",
                variable.name, draws.chains
            )));
        }
        columns.push((variable.name.clone(), size, &values.data));
    }
    // the base point is overwritten completely; a prior draw lies in the support of every parameter
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
    let base = model.prior_point(&mut rng).unwrap_or_else(|| vec![0.0; layout.dim]);
    let mut evaluator = model.evaluator();
    let mut chains = Vec::with_capacity(draws.chains);
    for chain in 0..draws.chains {
        let mut positions = Vec::with_capacity(per_chain * layout.dim);
        let mut stats = Vec::with_capacity(per_chain);
        for draw in 0..per_chain {
            let at = chain * per_chain + draw;
            let values: Vec<(String, Vec<f64>)> = columns
                .iter()
                .map(|(name, size, data)| (name.clone(), data[at * size..(at + 1) * size].to_vec()))
                .collect();
            let point = model
                .with_values(&base, &values)
                .map_err(|problem| misfit(format!("draw {draw} of chain {chain}: {problem}")))?;
            let log_density = evaluator.log_density(&point).unwrap_or(f64::NAN);
            stats.push(DrawStats::walk(log_density, 1.0, 0.0, 0));
            positions.extend(point);
        }
        let start = positions[..layout.dim.min(positions.len())].to_vec();
        let report = WarmupReport::at(start, StartKind::Given);
        chains.push(Chain { draws: positions, stats, ..Chain::new(report) });
    }
    Ok(Chains::new(layout.dim, chains, 1))
}

fn misfit(problem: String) -> PosteriorError {
    PosteriorError::Draws { problem }
}
