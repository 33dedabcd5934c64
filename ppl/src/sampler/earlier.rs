//! Runs that begin where earlier ones ended.

use super::{
    chains::{Chain, Chains, WarmupReport},
    error::SampleError,
    metric::Metric,
    nuts::{Nuts, NutsChain},
    run::{Kernel, Stream},
    settings::{Init, Run},
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
        let dim = density.dim();
        let Some(max_depth) = earlier.max_depth else {
            return Err(misfit("they are of another sampler", "give chains of NUTS"));
        };
        if earlier.dim != dim {
            let reason = format!("they have {} coordinates, the density {dim}", earlier.dim);
            return Err(misfit(reason, "give the density they were drawn from"));
        }
        if earlier.chains.len() != self.run.chains {
            let (got, set) = (earlier.chains.len(), self.run.chains);
            let reason = format!("there are {got} of them, but {set} are to be run");
            return Err(misfit(reason, "set `chains` to their number"));
        }
        if earlier.thin != self.run.thin {
            let (got, set) = (earlier.thin, self.run.thin);
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
        Run { init: Init::Uniform(0.0), ..self.run.clone() }.validate(dim)?;
        let chains = self.run.go_on(earlier.chains, |chain| take_up(density, max_depth, chain))?;
        let chains = Chains::new(dim, chains, self.run.thin);
        Ok(Chains { max_depth: Some(max_depth), ..chains })
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

/// The kernel of a chain, and its random stream, as they were after its last transition.
fn take_up<'a>(
    density: &'a dyn AnyDensity,
    max_depth: u32,
    chain: &Chain,
) -> Result<(NutsChain<'a>, Stream), SampleError> {
    let dim = density.dim();
    let (stream, covariance, step, warmup, position) = match &chain.paused {
        Some(p) => (Some(&p.stream), &p.covariance, p.step, p.warmup.clone(), &*p.position),
        None => {
            let WarmupReport { covariance, step_size, .. } = &chain.warmup;
            let frozen = Warmup::new(Rule::Fisher, dim, 0, 0.8, true);
            (chain.stream.as_ref(), covariance, *step_size, frozen, last_position(chain, dim))
        }
    };
    let stream = (stream.cloned())
        .ok_or_else(|| misfit("a chain has no random stream", "give chains of NUTS"))?;
    let metric = Metric::from_covariance(covariance, dim)
        .filter(|_| step.is_finite() && step > 0.0)
        .ok_or_else(|| misfit("a mass matrix or step is not positive", "begin anew with `run`"))?;
    let mut kernel = NutsChain::new(density, max_depth, warmup, Some((metric, step)));
    let begun = kernel.begin(position);
    // a chain that has not moved yet has no log density to compare with
    let last = chain.stats.last().or(chain.warmup.stats.last());
    let now = kernel.current.log_density;
    let then = last.map_or(now, |stats| stats.log_density);
    if begun.is_err() || (now - then).abs() > SAME_DENSITY * then.abs().max(1.0) {
        let reason = format!("the log density at a last draw was {then} and is {now}");
        return Err(misfit(reason, "give the model and the data that they were drawn with"));
    }
    Ok((kernel, stream))
}

fn last_position(chain: &Chain, dim: usize) -> &[f64] {
    match chain.draws.len().checked_sub(dim) {
        Some(start) if !chain.is_empty() => &chain.draws[start..],
        _ => chain.paused.as_deref().map_or(&chain.warmup.end, |paused| &paused.position),
    }
}

fn misfit(reason: impl Into<String>, mend: &'static str) -> SampleError {
    SampleError::Earlier { reason: reason.into(), mend }
}
