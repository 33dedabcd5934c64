//! Sequential Monte Carlo from the prior to the posterior.

mod evidence;
mod particles;

use std::sync::atomic::AtomicBool;

pub use evidence::Evidence;
use particles::Particles;

use super::{
    chains::{Chain, Chains},
    error::SampleError,
    progress::{Meter, Progress},
    run::Stream,
    settings::Run,
};
use crate::{bound::Bound, model::Model, posterior::Posterior, tempered::Tempered};

/// Tempered sequential Monte Carlo: for several modes, and for the evidence.
///
/// Particles drawn from the prior are led to the posterior over `prior · likelihood^β`, β from 0
/// to 1. Each step takes β so far that the effective sample size of the new weights falls to
/// `ess_fraction` of the particles (bisection), resamples systematically, and moves the particles
/// by random-walk Metropolis with their own covariance; the scale follows the acceptance, and the
/// sweeps go on until a particle has made `jumps` accepted moves on average, 3 + d/2 by default.
/// Modes that the prior sees are found with their weights, where a Markov chain would sit in
/// one. No gradient is needed.
///
/// Several independent runs give the evidence with its standard error, and stand as the chains
/// of the result, so that R-hat compares them. The particles of a run are not a Markov chain, but
/// descendants of one ancestor are neighbours, so that effective sizes and standard errors from
/// autocorrelation allow for their kinship. An interrupted run is an error: before β = 1 the
/// particles are not those of the posterior.
///
/// [`ChainStatus::done`](super::ChainStatus::done) counts thousandths of β. Statistics of a draw:
/// `leapfrogs` counts the evaluations of the run for one particle; `acceptance` and `step_size`
/// (the scale) are those of the last sweep.
///
/// # Errors
/// [`SampleError`] if a setting is out of range, the prior gives no accepted point, or a run is
/// stopped.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     /// Two modes, at ±3.
///     fn square(measured: f64) {
///         let x ~ Normal(0.0, 5.0);
///         measured ~ Normal(x * x, 1.0);
///     }
/// }
///
/// let result = Smc::default().particles(500).seed(7).sample(&square(9.0))?;
/// ppl::check::mean(&result.draws, "x", 0.0).within_mcse(4.0);
/// println!("ln evidence {:.2} ± {:.2}", result.evidence.ln, result.evidence.standard_error);
/// # Ok::<(), ppl::SampleError>(())
/// ```
/// A density that is not a model gives its two factors by [`Tempered`]:
/// ```
/// use ppl::{Parts, Rejection, Smc, Tempered};
/// use ppl::rand_xoshiro::Xoshiro256PlusPlus;
/// use ppl::rand::Rng;
///
/// /// Uniform on (−1, 1), and the likelihood e^{y}.
/// struct Tilted;
/// impl Tempered for Tilted {
///     fn unknowns(&self) -> usize {
///         1
///     }
///     fn draw(&self, rng: &mut Xoshiro256PlusPlus) -> Result<Vec<f64>, Rejection> {
///         Ok(vec![rng.random_range(-1.0..1.0)])
///     }
///     fn parts(&self, y: &[f64]) -> Result<Parts, Rejection> {
///         let ln_prior = if y[0].abs() < 1.0 { -2f64.ln() } else { f64::NEG_INFINITY };
///         Ok(Parts { ln_prior, ln_likelihood: y[0] })
///     }
/// }
///
/// let evidence = Smc::default().seed(7).run(&Tilted)?.evidence;
/// assert!((evidence.ln - 1f64.sinh().ln()).abs() < 4.0 * evidence.standard_error);
/// # Ok::<(), ppl::SampleError>(())
/// ```
///
/// # References
/// Del Moral, Doucet & Jasra, JRSS B 68 (2006) 411, doi:10.1111/j.1467-9868.2006.00553.x; Jasra
/// et al., Scand. J. Stat. 38 (2011) 1, doi:10.1111/j.1467-9469.2010.00723.x for the temperatures;
/// Dai, Heng, Jacob & Whiteley, JASA 117 (2022) 1587, doi:10.1080/01621459.2022.2087659.
#[derive(Clone, Debug)]
pub struct Smc<'a> {
    /// Chains are the runs, draws the particles.
    run: Run<'a>,
    ess_fraction: f64,
    jumps: Option<usize>,
}

impl Default for Smc<'_> {
    fn default() -> Self {
        let run = Run { chains: 8, ..Run::new(0, 1000) };
        Self { run, ess_fraction: 0.5, jumps: None }
    }
}

/// What a tempered run leaves behind: draws (a [`Posterior`] for a model, [`Chains`] for a bare
/// density) and evidence.
#[derive(Clone, Debug)]
pub struct TemperedDraws<T> {
    /// The particles at β = 1, one chain a run.
    pub draws: T,
    /// The marginal likelihood of the data.
    pub evidence: Evidence,
    /// The way from the prior, one list a run.
    pub stages: Vec<Vec<Stage>>,
}

/// One step of the temperature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage {
    /// Power β of the likelihood.
    pub temperature: f64,
    /// Effective sample size of the weights that led here.
    pub ess: f64,
    /// Share of proposals accepted in all sweeps.
    pub acceptance: f64,
    /// Sweeps of Metropolis over all particles.
    pub sweeps: usize,
    /// Scale of the proposal after them.
    pub scale: f64,
}

impl<'a> Smc<'a> {
    /// Independent runs, at least 2: with R of them the standard error of the evidence is itself
    /// known to 1/√(2R − 2).
    pub fn runs(mut self, runs: usize) -> Self {
        self.run.chains = runs;
        self
    }

    /// Particles of each run, at least 50; they must be so many that every mode holds some of
    /// the prior draws that the first temperatures keep.
    pub fn particles(mut self, particles: usize) -> Self {
        self.run.draws = particles;
        self
    }

    /// Effective sample size that a temperature step leaves, as a fraction of the particles,
    /// between 0 and 1: larger takes more and smaller steps.
    pub fn ess_fraction(mut self, fraction: f64) -> Self {
        self.ess_fraction = fraction;
        self
    }

    /// Accepted moves of a particle at each temperature, on average.
    pub fn jumps(mut self, jumps: usize) -> Self {
        self.jumps = Some(jumps);
        self
    }

    /// Seed of the random streams; the same seed gives the same draws on any number of threads.
    pub fn seed(mut self, seed: u64) -> Self {
        self.run.seed = seed;
        self
    }

    /// Threads of this run; by default rayon's pool is shared.
    pub fn threads(mut self, threads: usize) -> Self {
        self.run.threads = Some(threads);
        self
    }

    /// Who hears of the runs while they go on.
    pub fn progress(mut self, progress: &'a dyn Progress) -> Self {
        self.run.progress = Some(progress);
        self
    }

    /// When the flag becomes true, every run ends after its sweep with an error.
    pub fn interrupt(mut self, interrupt: &'a AtomicBool) -> Self {
        self.run.interrupt = Some(interrupt);
        self
    }

    /// Leads particles through any density with a prior that can be drawn from.
    ///
    /// # Errors
    /// See [`Smc`].
    pub fn run<D: Tempered>(&self, density: &D) -> Result<TemperedDraws<Chains>, SampleError> {
        self.run_any(density)
    }

    fn run_any(&self, density: &dyn Tempered) -> Result<TemperedDraws<Chains>, SampleError> {
        let dim = density.unknowns();
        self.validate(dim)?;
        let finished = self
            .run
            .in_parallel(self.run.streams(), |number, rng| self.one(density, number, rng))?;
        let (mut chains, mut stages, mut evidence) = (Vec::new(), Vec::new(), Vec::new());
        for (chain, way, ln) in finished {
            chains.push(chain);
            stages.push(way);
            evidence.push(ln);
        }
        let draws = Chains::new(dim, chains, 1);
        Ok(TemperedDraws { draws, evidence: Evidence::new(evidence), stages })
    }

    /// Samples a model: the draws with everything the model names, and its evidence.
    ///
    /// # Errors
    /// See [`Smc`]; also if the model cannot be evaluated.
    pub fn sample<M: Model>(
        &self,
        model: &Bound<M>,
    ) -> Result<TemperedDraws<Posterior>, SampleError> {
        model.layout()?;
        let TemperedDraws { draws, evidence, stages } = self.run(model)?;
        let draws = Posterior::from_chains(model, draws, self.run.seed)?;
        Ok(TemperedDraws { draws, evidence, stages })
    }

    fn validate(&self, dim: usize) -> Result<(), SampleError> {
        let refuse = |setting, value, mend| Err(SampleError::Setting { setting, value, mend });
        if !(2..=10_000).contains(&self.run.chains) {
            return refuse("runs", self.run.chains.to_string(), "give 2 to 10 000, as 8");
        }
        if self.run.draws < 50 || self.run.draws.saturating_mul(dim + 8) > 1 << 32 {
            let mend = "give at least 50, and at most 2^32 / (unknowns + 8)";
            return refuse("particles", self.run.draws.to_string(), mend);
        }
        if !(self.ess_fraction > 0.0 && self.ess_fraction < 1.0) {
            let mend = "give a number between 0 and 1, as 0.5";
            return refuse("ess_fraction", self.ess_fraction.to_string(), mend);
        }
        if self.jumps == Some(0) {
            return refuse("jumps", "0".into(), "give at least 1");
        }
        if self.run.threads == Some(0) {
            return refuse("threads", "0".into(), "give at least 1");
        }
        Ok(())
    }

    /// One run: its particles, its way, and its estimate of the log evidence.
    fn one(
        &self,
        density: &dyn Tempered,
        run: usize,
        rng: Stream,
    ) -> Result<(Chain, Vec<Stage>, f64), SampleError> {
        let mut meter = Meter::new(self.run.progress, run, 1000);
        let (mut particles, mut ln_evidence) = Particles::draw(density, self.run.draws, run, rng)?;
        let jumps = self.jumps.unwrap_or(3 + density.unknowns() / 2);
        let mut stages = Vec::new();
        while particles.temperature < 1.0 {
            let before = particles.temperature;
            let stopped = |reason| SampleError::Tempering { run, temperature: before, reason };
            let (ln_step, ess) = particles.temper(self.ess_fraction).map_err(|s| stopped(s.0))?;
            ln_evidence += ln_step;
            let stage = particles
                .wander(jumps, |scale| {
                    meter.stage((1000.0 * before) as usize, scale);
                    // a run that fails does not stop the others, so that the error is the same
                    // whatever their order
                    self.run.check(&AtomicBool::new(false))
                })
                .map_err(|s| stopped(s.0))?;
            stages.push(Stage { ess, ..stage });
        }
        meter.stage(1000, particles.scale());
        meter.finish();
        let evaluations = 1 + stages.iter().map(|stage| stage.sweeps).sum::<usize>();
        Ok((particles.into_chain(evaluations, stages.last()), stages, ln_evidence))
    }
}
