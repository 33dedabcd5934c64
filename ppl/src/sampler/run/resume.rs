//! Resumption of earlier runs.

use crate::sampler::draws::chains::{Chain, Chains};
use crate::sampler::run::chains::MarkovChain;
use crate::sampler::run::error::RunError;
use crate::sampler::run::settings::{Settings, Starts};
use crate::sampler::run::stream::Stream;

/// Largest difference between the stored and the recomputed log density of a point, relative to max(1, |log density|),
/// for which the density counts as unchanged. Another compiler or processor causes far smaller differences.
const SAME_DENSITY: f64 = 1e-6;

impl Settings<'_> {
    /// Continues the chains of an earlier run. `make` builds the tuned transition kernel of a chain.
    pub(crate) fn resume<K: MarkovChain>(
        &self,
        dim: usize,
        earlier: Chains,
        make: impl Fn(&Chain) -> Result<K, RunError> + Sync,
    ) -> Result<Chains, RunError> {
        if earlier.dim != dim {
            let reason = format!("they have {} coordinates but the density has {dim}", earlier.dim);
            return Err(misfit(reason, "use the density from which they were drawn"));
        }
        if earlier.chains.len() != self.chains {
            let (got, set) = (earlier.chains.len(), self.chains);
            let reason = format!("there are {got} earlier chains but `chains` is {set}");
            return Err(misfit(reason, "set `chains` to the number of earlier chains"));
        }
        if earlier.thin != self.thin {
            let (got, set) = (earlier.thin, self.thin);
            let reason = format!("they keep one of {got} transitions but `thin` is {set}");
            return Err(misfit(reason, "set `thin` to the value of the earlier run"));
        }
        if let Err(problem) = earlier.check() {
            return Err(misfit(problem, "use chains as returned by `run`, `resume` or `load`"));
        }
        let is_lost = |chain: &Chain| chain.stream.is_none() && chain.paused.is_none();
        if let Some(number) = earlier.chains.iter().position(is_lost) {
            let reason = format!("chain {number} failed in its warmup");
            return Err(misfit(reason, "start a new run with `run`"));
        }
        Settings { init: Starts::Uniform(0.0), ..self.clone() }.validate(dim)?;
        let max_depth = earlier.max_depth;
        let chains = self.go_on(earlier.chains, |chain| take_up(make(chain)?, chain, dim))?;
        Ok(Chains { max_depth, ..Chains::new(dim, chains, self.thin) })
    }
}

/// Moves the transition kernel to the last position of the chain. Returns the kernel and the state of the random
/// stream at this position.
fn take_up<K: MarkovChain>(
    mut kernel: K,
    chain: &Chain,
    dim: usize,
) -> Result<(K, Stream), RunError> {
    let paused = chain.paused.as_deref().map(|paused| &paused.stream);
    let stream = paused.or(chain.stream.as_ref()).ok_or_else(|| {
        misfit(
            "the state of a chain's random number generator is not stored",
            "start a new run with `run`",
        )
    })?;
    let other = |reason| misfit(reason, "use the model and the data with which they were drawn");
    kernel.begin(last_position(chain, dim)).map_err(|rejection| {
        other(format!("the density now rejects the last draw of a chain: {rejection}"))
    })?;
    // a chain without transitions has no log density to compare with
    let last = chain.stats.last().or(chain.warmup.stats.last());
    let now = kernel.log_density();
    let then = last.map_or(now, |stats| stats.log_density);
    if (now - then).abs() > SAME_DENSITY * then.abs().max(1.0) {
        return Err(other(format!(
            "the log density at the last draw of a chain was {then} and is now {now}"
        )));
    }
    Ok((kernel, stream.clone()))
}

pub(crate) fn last_position(chain: &Chain, dim: usize) -> &[f64] {
    match chain.draws.len().checked_sub(dim) {
        Some(start) if !chain.is_empty() => &chain.draws[start..],
        _ => chain.paused.as_deref().map_or(&chain.warmup.end, |paused| &paused.position),
    }
}

/// Creates the error for chains that were tuned by a different kind of sampler.
pub(crate) fn another_sampler() -> RunError {
    misfit("another sampler has drawn them", "use chains of this sampler")
}

pub(crate) fn misfit(reason: impl Into<String>, help: &'static str) -> RunError {
    RunError::Resume { reason: reason.into(), help }
}
