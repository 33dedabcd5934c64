//! The front that all samplers share: settings, a run, and a run that goes on.

use std::sync::atomic::AtomicBool;

use super::{
    chains::Chains,
    error::RunError,
    progress::Progress,
    settings::{Settings, Starts},
};
use crate::{datum::Recordable, density::LogDensity, erased::ErasedDensity};

/// Markov chain Monte Carlo by the transitions of `M`: chains that run in parallel, go on where they
/// were interrupted, and draw the same for any number of threads.
///
/// Used by the names [`Nuts`](super::Nuts), [`Metropolis`](super::Metropolis) and
/// [`DelayedAcceptance`](super::DelayedAcceptance), whose pages say what they do.
#[derive(Clone, Debug)]
pub struct Mcmc<'a, M> {
    pub(crate) settings: Settings<'a>,
    pub(crate) method: M,
}

/// How a sampler moves. Its functions are compiled here, and not anew for every density of a user.
pub(crate) trait Method {
    /// What it samples: a density, or an expensive one with a cheap one before it.
    type Target<'d>: Copy;

    /// All chains, from the start.
    fn run(&self, settings: &Settings<'_>, target: Self::Target<'_>) -> Result<Chains, RunError>;

    /// All chains, from where earlier ones ended.
    fn resume(
        &self,
        settings: &Settings<'_>,
        target: Self::Target<'_>,
        earlier: Chains,
    ) -> Result<Chains, RunError>;
}

/// A method that samples one density.
pub(crate) trait OneDensity: for<'d> Method<Target<'d> = &'d dyn ErasedDensity> {}

#[expect(private_bounds, reason = "sealed: how chains move is no matter of the interface")]
impl<M: OneDensity> Mcmc<'_, M> {
    /// Samples any log density.
    ///
    /// # Errors
    /// [`RunError`] if a setting is out of range or a chain finds no starting point.
    pub fn run<D: LogDensity>(&self, density: &D) -> Result<Chains, RunError> {
        self.method.run(&self.settings, density)
    }

    /// Goes on with the chains of an earlier run until each has as many draws as this sampler is
    /// set to keep. They are those that one longer run would have drawn, bit for bit, on the same
    /// density with the same `thin`. It finishes an interrupted run, were it still in its warmup, and
    /// lengthens a finished one;
    /// [`Posterior::from_chains`](crate::Posterior::from_chains) gives the draws their names.
    ///
    /// What was tuned and the random streams are those of the earlier chains; [`Chains::save`] keeps
    /// them all.
    ///
    /// # Errors
    /// [`RunError::Resume`] if the chains are not of this sampler or this density, or one failed in
    /// its warmup.
    pub fn resume<D: LogDensity>(&self, density: &D, earlier: Chains) -> Result<Chains, RunError> {
        self.method.resume(&self.settings, density, earlier)
    }
}

impl<'a, M> Mcmc<'a, M> {
    /// Number of chains.
    pub fn chains(mut self, chains: usize) -> Self {
        self.settings.chains = chains;
        self
    }

    /// Warmup transitions of each chain; they are not kept.
    pub fn warmup(mut self, warmup: usize) -> Self {
        self.settings.warmup = warmup;
        self
    }

    /// Kept draws of each chain.
    pub fn draws(mut self, draws: usize) -> Self {
        self.settings.draws = draws;
        self
    }

    /// Keeps every `thin`-th transition after the warmup. Statistics of a kept draw then
    /// cover the transitions since the draw before: leapfrogs are added up, acceptance is
    /// averaged, and it is divergent if any of them was.
    pub fn thin(mut self, thin: usize) -> Self {
        self.settings.thin = thin;
        self
    }

    /// Seed of the random streams; the same seed gives the same draws on any number of threads.
    pub fn seed(mut self, seed: u64) -> Self {
        self.settings.seed = seed;
        self
    }

    /// Threads of this run; by default rayon's pool is shared.
    pub fn threads(mut self, threads: usize) -> Self {
        self.settings.threads = Some(threads);
        self
    }

    /// Random starts are uniform on (−`radius`, `radius`) in every unconstrained coordinate; 2 unless set.
    /// A chain whose density rejects 100 of these starts at a draw from the prior:
    /// [`WarmupReport::start_kind`](super::WarmupReport::start_kind).
    pub fn init_radius(mut self, radius: f64) -> Self {
        self.settings.init = Starts::Uniform(radius);
        self
    }

    /// Starting points in unconstrained space, one for each chain.
    pub fn init_points(mut self, points: Vec<Vec<f64>>) -> Self {
        self.settings.init = Starts::Points(points);
        self
    }

    /// Starts every chain with the quantity of this name at this value; quantities without a value start
    /// at random. A value is a number, or an array or a vector of as many as the quantity has.
    ///
    /// # Example
    /// ```
    /// use ppl::prelude::*;
    ///
    /// ppl::model! {
    ///     fn line(x: &[f64], y: &[f64]) {
    ///         let coefficients ~ Normal(0.0, 1e6).array::<2>();
    ///         let sd ~ HalfNormal(1e6);
    ///         for (x, y) in x.iter().zip(y) {
    ///             y ~ Normal(coefficients[0] + coefficients[1] * x, sd);
    ///         }
    ///     }
    /// }
    /// let model = line(&[1.0, 2.0, 3.0], &[2.1e5, 3.9e5, 6.2e5]);
    /// let nuts = Nuts::default().chains(2).warmup(300).draws(100);
    /// let nuts = nuts.init_value("coefficients", [0.0, 2e5]).init_value("sd", 2e4);
    /// let posterior = nuts.seed(7).sample(&model)?;
    /// assert_eq!(posterior.chains.chains[0].warmup.start[..2], [0.0, 2e5]);
    /// # Ok::<(), ppl::SampleError>(())
    /// ```
    pub fn init_value(mut self, name: &str, value: impl Recordable) -> Self {
        let mut numbers = Vec::new();
        value.flatten(&mut numbers);
        self.settings.values.push((name.to_owned(), numbers));
        self
    }

    /// Who hears of the chains while they run.
    pub fn progress(mut self, progress: &'a dyn Progress) -> Self {
        self.settings.progress = Some(progress);
        self
    }

    /// When the flag becomes true, every chain ends after its transition and keeps its draws.
    pub fn interrupt(mut self, interrupt: &'a AtomicBool) -> Self {
        self.settings.interrupt = Some(interrupt);
        self
    }
}
