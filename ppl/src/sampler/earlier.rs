//! Runs that begin where earlier ones ended.

use super::{
    chains::{Chain, Chains, WarmupReport},
    error::SampleError,
    metric::Metric,
    nuts::{Nuts, NutsChain},
    run::{Kernel, Stream},
    settings::{Init, Run},
    tuning::Tuning,
    warmup::{Rule, Warmup},
};
use crate::{any::AnyDensity, density::LogDensity};

/// Log densities of one point that differ by more than this, relative to themselves or to 1, are
/// not of the same density: far above what another compiler or processor changes.
const SAME_DENSITY: f64 = 1e-6;

impl Nuts<'_> {
    /// Starts every chain from the last draw (or where it was if it has none), the mass matrix and the
    /// step of the same chain of an earlier run, as of a similar model. The warmup then leaves out its
    /// early windows and may be short; with `warmup(0)` nothing is tuned any more.
    ///
    /// A run whose chains do not fit these is refused with [`SampleError::Earlier`].
    pub fn warm_start(mut self, earlier: &Chains) -> Self {
        let last = |chain: &Chain| last_position(chain, earlier.dim).to_vec();
        self.run.init = Init::Points(earlier.chains.iter().map(last).collect());
        let tuning = |chain: &Chain| (chain.warmup.covariance.clone(), chain.warmup.step_size);
        self.warm = Some(earlier.chains.iter().map(tuning).collect());
        self
    }

    /// Goes on with the chains of an earlier run until each has as many draws as this sampler is
    /// set to keep. They are those that one longer run would have drawn, bit for bit, on the same
    /// density with the same `thin`. It finishes an interrupted run, were it still in its warmup, and
    /// lengthens a finished one;
    /// [`Posterior::from_chains`](crate::Posterior::from_chains) gives the draws their names.
    ///
    /// Mass matrices, steps, the bound on doublings and the random streams are those of the earlier
    /// chains; [`Chains::save`] keeps them all.
    ///
    /// # Errors
    /// [`SampleError::Earlier`] if the chains are not of this sampler or this density, or one
    /// failed in its warmup; else see [`Nuts`].
    pub fn resume<D: LogDensity>(
        &self,
        density: &D,
        earlier: Chains,
    ) -> Result<Chains, SampleError> {
        self.resume_any(density, earlier)
    }

    fn resume_any(&self, density: &dyn AnyDensity, earlier: Chains) -> Result<Chains, SampleError> {
        let max_depth = earlier.max_depth.ok_or_else(another_sampler)?;
        self.run.resume(density.dim(), earlier, |chain| as_tuned(density, max_depth, chain))
    }

    /// Mass matrix and step of every chain of a warm start.
    pub(super) fn tuned_maps(&self, dim: usize) -> Result<Option<Vec<(Metric, f64)>>, SampleError> {
        let Some(warm) = &self.warm else { return Ok(None) };
        if warm.len() != self.run.chains {
            let (got, set) = (warm.len(), self.run.chains);
            let reason = format!("there are {got} of them, but {set} are to be run");
            return Err(misfit(reason, "set `chains` to their number"));
        }
        let tuned = warm.iter().map(|(covariance, step)| {
            let metric = Metric::from_covariance(covariance, dim)?;
            (step.is_finite() && *step > 0.0).then_some((metric, *step))
        });
        let misfit = || {
            misfit(
                "a mass matrix or step does not fit the density",
                "give chains of NUTS with as many coordinates",
            )
        };
        tuned.collect::<Option<Vec<_>>>().ok_or_else(misfit).map(Some)
    }
}

/// The kernel of a chain as it was after its last transition.
fn as_tuned<'a>(
    density: &'a dyn AnyDensity,
    max_depth: u32,
    chain: &Chain,
) -> Result<NutsChain<'a>, SampleError> {
    let dim = density.dim();
    let (covariance, step, warmup) = match chain.tuning.as_deref() {
        Some(Tuning::Hamiltonian { covariance, step, warmup }) => {
            (covariance, *step, warmup.clone())
        }
        Some(_) => return Err(another_sampler()),
        None => {
            let WarmupReport { covariance, step_size, .. } = &chain.warmup;
            (covariance, *step_size, Warmup::new(Rule::Fisher, dim, 0, 0.8, true))
        }
    };
    let metric = Metric::from_covariance(covariance, dim)
        .filter(|_| step.is_finite() && step > 0.0)
        .ok_or_else(|| misfit("a mass matrix or step is not positive", "begin anew with `run`"))?;
    Ok(NutsChain::new(density, max_depth, warmup, Some((metric, step))))
}

impl Run<'_> {
    /// Goes on with the chains of an earlier run; `make` builds the kernel of one as it was tuned.
    pub(super) fn resume<K: Kernel>(
        &self,
        dim: usize,
        earlier: Chains,
        make: impl Fn(&Chain) -> Result<K, SampleError> + Sync,
    ) -> Result<Chains, SampleError> {
        if earlier.dim != dim {
            let reason = format!("they have {} coordinates, the density {dim}", earlier.dim);
            return Err(misfit(reason, "give the density they were drawn from"));
        }
        if earlier.chains.len() != self.chains {
            let (got, set) = (earlier.chains.len(), self.chains);
            let reason = format!("there are {got} of them, but {set} are to be run");
            return Err(misfit(reason, "set `chains` to their number"));
        }
        if earlier.thin != self.thin {
            let (got, set) = (earlier.thin, self.thin);
            let reason = format!("they keep one transition in {got}, not one in {set}");
            return Err(misfit(reason, "set `thin` as it was"));
        }
        if let Err(problem) = earlier.check() {
            return Err(misfit(problem, "give chains as `run`, `resume` or `load` returned them"));
        }
        let is_lost = |chain: &Chain| chain.stream.is_none() && chain.paused.is_none();
        if let Some(number) = earlier.chains.iter().position(is_lost) {
            let reason = format!("chain {number} failed in its warmup");
            return Err(misfit(reason, "begin anew with `run`"));
        }
        Run { init: Init::Uniform(0.0), ..self.clone() }.validate(dim)?;
        let max_depth = earlier.max_depth;
        let chains = self.go_on(earlier.chains, |chain| take_up(make(chain)?, chain, dim))?;
        Ok(Chains { max_depth, ..Chains::new(dim, chains, self.thin) })
    }
}

/// `kernel` where the chain stopped, and the random stream from there.
fn take_up<K: Kernel>(
    mut kernel: K,
    chain: &Chain,
    dim: usize,
) -> Result<(K, Stream), SampleError> {
    let paused = chain.paused.as_deref().map(|paused| &paused.stream);
    let stream = paused
        .or(chain.stream.as_ref())
        .ok_or_else(|| misfit("a chain has no random stream", "begin anew with `run`"))?;
    let other = |reason| misfit(reason, "give the model and the data that they were drawn with");
    kernel
        .begin(last_position(chain, dim))
        .map_err(|rejection| other(format!("a last draw is rejected now: {rejection}")))?;
    // a chain that has not moved yet has no log density to compare with
    let last = chain.stats.last().or(chain.warmup.stats.last());
    let now = kernel.log_density();
    let then = last.map_or(now, |stats| stats.log_density);
    if (now - then).abs() > SAME_DENSITY * then.abs().max(1.0) {
        return Err(other(format!("the log density at a last draw was {then} and is {now}")));
    }
    Ok((kernel, stream.clone()))
}

fn last_position(chain: &Chain, dim: usize) -> &[f64] {
    match chain.draws.len().checked_sub(dim) {
        Some(start) if !chain.is_empty() => &chain.draws[start..],
        _ => chain.paused.as_deref().map_or(&chain.warmup.end, |paused| &paused.position),
    }
}

/// The chains have not the tuning of the sampler that is to go on with them.
pub(super) fn another_sampler() -> SampleError {
    misfit("they are of another sampler", "give chains of this one")
}

pub(super) fn misfit(reason: impl Into<String>, mend: &'static str) -> SampleError {
    SampleError::Earlier { reason: reason.into(), mend }
}
