//! Interface common to all samplers: settings, `run` and `resume`.

use std::sync::atomic::AtomicBool;

use crate::density::LogDensity;
use crate::model::erased::ErasedDensity;
use crate::quantity::datum::Recordable;
use crate::sampler::draws::chains::Chains;
use crate::sampler::run::error::RunError;
use crate::sampler::run::progress::Progress;
use crate::sampler::run::settings::{Settings, Starts};

/// Markov chain Monte Carlo with the transition kernel `M`. The chains run in parallel, can be resumed after an
/// interrupt, and give the same draws for any number of threads.
///
/// The type aliases [`Nuts`](crate::Nuts), [`Metropolis`](crate::Metropolis) and
/// [`DelayedAcceptance`](crate::DelayedAcceptance) document the samplers.
#[derive(Clone, Debug)]
pub struct Mcmc<'a, M> {
    pub(crate) settings: Settings<'a>,
    pub(crate) method: M,
}

/// Transition kernel of a sampler. The functions of the trait have a type-erased density as an argument, so that they
/// are compiled once and not for every user-defined density.
pub(crate) trait Method {
    /// The sampled density, or the pair of a cheap and an expensive density.
    type Target<'d>: Copy;

    /// Runs all chains from their starting points.
    fn run(&self, settings: &Settings<'_>, target: Self::Target<'_>) -> Result<Chains, RunError>;

    /// Resumes all chains from the last state of the earlier chains.
    fn resume(
        &self,
        settings: &Settings<'_>,
        target: Self::Target<'_>,
        earlier: Chains,
    ) -> Result<Chains, RunError>;
}

/// A method that samples a single density.
pub(crate) trait OneDensity: for<'d> Method<Target<'d> = &'d dyn ErasedDensity> {}

#[expect(private_bounds, reason = "sealed: the trait of transition kernels is not public")]
impl<M: OneDensity> Mcmc<'_, M> {
    /// Samples any log density.
    ///
    /// # Errors
    /// [`RunError`] if a setting is out of range or a chain finds no starting point.
    pub fn run<D: LogDensity>(&self, density: &D) -> Result<Chains, RunError> {
        self.method.run(&self.settings, density)
    }

    /// Continues the chains of an earlier run until each chain has the number of draws that this sampler is set to
    /// keep.
    ///
    /// The draws are bit for bit the draws of one longer run on the same density with the same `thin`. An interrupted
    /// run is completed, even if the interrupt came in the warmup; a finished run is extended.
    /// [`Posterior::from_chains`](crate::Posterior::from_chains) gives the draws their names. The run uses the tuning
    /// and the random streams of the earlier chains; [`Chains::save`] writes both to a file.
    ///
    /// # Errors
    /// [`RunError::Resume`] if the chains come from another sampler or another density, or if a chain failed in its
    /// warmup.
    pub fn resume<D: LogDensity>(&self, density: &D, earlier: Chains) -> Result<Chains, RunError> {
        self.method.resume(&self.settings, density, earlier)
    }
}

impl<'a, M> Mcmc<'a, M> {
    /// Sets the number of chains.
    pub fn chains(mut self, chains: usize) -> Self {
        self.settings.chains = chains;
        self
    }

    /// Sets the number of warmup transitions per chain; the draws of the warmup are discarded.
    pub fn warmup(mut self, warmup: usize) -> Self {
        self.settings.warmup = warmup;
        self
    }

    /// Sets the number of kept draws per chain.
    pub fn draws(mut self, draws: usize) -> Self {
        self.settings.draws = draws;
        self
    }

    /// Keeps every `thin`-th transition after the warmup. The statistics of a kept draw then cover all transitions
    /// since the previous kept draw: leapfrog steps are summed, acceptance probabilities are averaged, and the draw is
    /// divergent if any of the transitions was divergent.
    pub fn thin(mut self, thin: usize) -> Self {
        self.settings.thin = thin;
        self
    }

    /// Sets the seed of the random streams. The same seed gives the same draws on any number of threads.
    pub fn seed(mut self, seed: u64) -> Self {
        self.settings.seed = seed;
        self
    }

    /// Sets the number of threads of this run. By default, the run uses rayon's global thread pool.
    pub fn threads(mut self, threads: usize) -> Self {
        self.settings.threads = Some(threads);
        self
    }

    /// Sets the half-width of the random starts, which are uniform on (−`radius`, `radius`) in every unconstrained
    /// coordinate. The default is 2. If the density rejects 100 of these starts, the chain starts at a draw from the
    /// prior and [`WarmupReport::start_kind`](crate::WarmupReport::start_kind) records this.
    pub fn init_radius(mut self, radius: f64) -> Self {
        self.settings.init = Starts::Uniform(radius);
        self
    }

    /// Sets the starting points in unconstrained space, one for each chain.
    pub fn init_points(mut self, points: Vec<Vec<f64>>) -> Self {
        self.settings.init = Starts::Points(points);
        self
    }

    /// Starts every chain with the given value of the named quantity; quantities without a value start at random. The
    /// value is a number, or an array or vector with as many numbers as the quantity has.
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
        let mut elements = Vec::new();
        value.flatten(&mut elements);
        self.settings.values.push((name.to_owned(), elements));
        self
    }

    /// Sets an observer that is notified of the progress of the chains.
    pub fn progress(mut self, progress: &'a dyn Progress) -> Self {
        self.settings.progress = Some(progress);
        self
    }

    /// Sets a flag that interrupts the run: when the flag becomes true, every chain ends after its current transition
    /// and keeps its draws.
    pub fn interrupt(mut self, interrupt: &'a AtomicBool) -> Self {
        self.settings.interrupt = Some(interrupt);
        self
    }
}
