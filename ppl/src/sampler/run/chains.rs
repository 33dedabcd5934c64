//! Runs the chains of a sampler: starting points, warmup and draws.

use std::{
    collections::BTreeMap,
    sync::atomic::{AtomicBool, Ordering},
};

use rand::Rng;
use rayon::prelude::*;

use crate::density::{Location, Rejection};
use crate::model::erased::ErasedDensity;
use crate::model::start::{NoStart, StartKind, find_start, with_values};
use crate::sampler::draws::chains::{Chain, Chains, Paused};
use crate::sampler::draws::report::{Divergence, DrawStats, WarmupReport};
use crate::sampler::run::error::RunError;
use crate::sampler::run::progress::Meter;
use crate::sampler::run::rejections::Rejections;
use crate::sampler::run::settings::{Settings, Starts};
use crate::sampler::run::stop::StopReason;
use crate::sampler::run::stream::{Stream, streams};
use crate::sampler::walk::tuning::Tuning;

/// Transition kernel with the current state of one chain.
pub(crate) trait MarkovChain {
    /// Starts the chain at the point `y` if the density accepts `y`.
    fn begin(&mut self, y: &[f64]) -> Result<(), Rejection>;
    /// Searches an initial step size.
    fn prepare(&mut self, rng: &mut Stream) -> Result<(), StopReason>;
    /// Runs one transition.
    fn transition(&mut self, rng: &mut Stream) -> Result<DrawStats, StopReason>;
    /// Adapts the kernel after a warmup transition with the given statistics.
    fn adapt(&mut self, stats: &DrawStats, rng: &mut Stream) -> Result<(), StopReason>;
    /// State of the adaptation, from which the warmup can be resumed at the current position.
    fn tuning(&self) -> Tuning;
    /// Tuned state that is needed to draw after the warmup; `None` if the warmup report contains the complete tuned
    /// state.
    fn tuned(&self) -> Option<Tuning> {
        Some(self.tuning())
    }
    /// Ends the adaptation and writes the tuned values to the report.
    fn freeze(&mut self, report: &mut WarmupReport);
    /// Current position of the chain.
    fn position(&self) -> &[f64];
    /// Log density at the current position.
    fn log_density(&self) -> f64;
    /// Last position before the most recent divergence, and the energy error of the divergence.
    fn divergence(&self) -> (&[f64], f64);
    /// Counts of rejected points.
    fn rejections(&mut self) -> &mut Rejections;
    /// Describes a rejection at `y`, see [`LogDensity::explain`](crate::LogDensity::explain).
    fn explain(&self, y: &[f64]) -> Option<String>;
}

impl Settings<'_> {
    /// Runs all chains from their starting points; `make` builds the kernel of a chain.
    pub(crate) fn execute<K: MarkovChain>(
        &self,
        density: &dyn ErasedDensity,
        make: impl Fn() -> K + Sync,
    ) -> Result<Chains, RunError> {
        let dim = density.dim();
        self.validate(dim)?;
        let abort = AtomicBool::new(false);
        let chains = self.in_parallel(streams(self.seed, self.chains), |number, mut rng| {
            self.chain(number, density, make(), &mut rng, &abort)
        })?;
        Ok(Chains::new(dim, chains, self.thin))
    }

    /// Continues the chains `earlier` until each has the requested number of draws. `make` returns the tuned kernel and
    /// the random stream of a chain.
    pub(crate) fn go_on<K: MarkovChain>(
        &self,
        earlier: Vec<Chain>,
        make: impl Fn(&Chain) -> Result<(K, Stream), RunError> + Sync,
    ) -> Result<Vec<Chain>, RunError> {
        let abort = AtomicBool::new(false);
        self.in_parallel(earlier, |number, mut chain| {
            let (mut kernel, mut rng) = make(&chain)?;
            let warmup = chain.paused.take().map(|paused| paused.length);
            let ahead = warmup.map_or(0, |length| length.saturating_sub(chain.warmup.stats.len()));
            let mut meter = Meter::new(self.progress, number, ahead + self.draws * self.thin);
            chain.stopped = None;
            let tuned = warmup.map_or(Ok(()), |length| {
                self.tune(length, &mut chain, &mut kernel, &mut rng, &mut meter, &abort)
            });
            self.sample(&mut chain, &mut kernel, &mut rng, meter, &abort, tuned);
            Ok(chain)
        })
    }

    /// Runs one job per chain on the requested number of threads.
    fn in_parallel<T: Send, R: Send>(
        &self,
        jobs: Vec<T>,
        work: impl Fn(usize, T) -> Result<R, RunError> + Sync,
    ) -> Result<Vec<R>, RunError> {
        let all = || -> Vec<Result<R, RunError>> {
            jobs.into_par_iter().enumerate().map(|(number, job)| work(number, job)).collect()
        };
        let results = match self.threads {
            Some(n) => rayon::ThreadPoolBuilder::new().num_threads(n).build()?.install(all),
            None => all(),
        };
        results.into_iter().collect()
    }

    fn chain<K: MarkovChain>(
        &self,
        number: usize,
        density: &dyn ErasedDensity,
        mut kernel: K,
        rng: &mut Stream,
        abort: &AtomicBool,
    ) -> Result<Chain, RunError> {
        let dim = density.dim();
        let start_kind = self
            .start(number, density, &mut kernel, rng)
            .inspect_err(|_| abort.store(true, Ordering::Relaxed))?;
        // without unknowns there is nothing to tune
        let warmup = if dim == 0 { 0 } else { self.warmup };
        let mut chain = Chain::new(WarmupReport::at(kernel.position().to_vec(), start_kind));
        chain.warmup.stats.reserve_exact(warmup);
        chain.stats.reserve_exact(self.draws);
        chain.draws.reserve_exact(self.draws * dim);
        let mut meter = Meter::new(self.progress, number, warmup + self.draws * self.thin);

        // a model without unknowns has no step size to search
        let prepared = if dim == 0 { Ok(()) } else { kernel.prepare(rng) };
        let tuned = prepared
            .and_then(|()| self.tune(warmup, &mut chain, &mut kernel, rng, &mut meter, abort));
        self.sample(&mut chain, &mut kernel, rng, meter, abort, tuned);
        Ok(chain)
    }

    /// Runs the remaining transitions of a warmup of `length` transitions.
    fn tune<K: MarkovChain>(
        &self,
        length: usize,
        chain: &mut Chain,
        kernel: &mut K,
        rng: &mut Stream,
        meter: &mut Meter<'_>,
        abort: &AtomicBool,
    ) -> Result<(), StopReason> {
        let ended = (chain.warmup.stats.len()..length).try_for_each(|_| {
            self.check(abort).inspect_err(|_| {
                let (position, stream) = (kernel.position().to_vec(), rng.clone());
                chain.paused = Some(Box::new(Paused { position, stream, length }));
                chain.tuning = Some(Box::new(kernel.tuning()));
            })?;
            let stats = DrawStats { tuning: true, ..kernel.transition(rng)? };
            kernel.adapt(&stats, rng)?;
            meter.transition(&stats);
            chain.warmup.stats.push(stats);
            Ok(())
        });
        kernel.freeze(&mut chain.warmup);
        count(kernel, &mut chain.warmup.rejections);
        if ended.is_ok() {
            chain.warmup.end = kernel.position().to_vec();
            chain.stream = Some(rng.clone());
            chain.tuning = kernel.tuned().map(Box::new);
        }
        ended
    }

    /// Draws until `chain` has the requested number of draws. If `ended` is an error of the warmup, makes no draws
    /// and stores the error as the reason of the stop.
    fn sample<K: MarkovChain>(
        &self,
        chain: &mut Chain,
        kernel: &mut K,
        rng: &mut Stream,
        mut meter: Meter<'_>,
        abort: &AtomicBool,
        ended: Result<(), StopReason>,
    ) {
        let ended = ended.and_then(|()| {
            (chain.len()..self.draws).try_for_each(|draw| {
                let stats = self.draw(kernel, rng, &mut meter, abort)?;
                if stats.divergent {
                    let (position, energy_error) = kernel.divergence();
                    let position = position.to_vec();
                    chain.divergences.push(Divergence { draw, position, energy_error });
                }
                chain.draws.extend_from_slice(kernel.position());
                chain.stats.push(stats);
                chain.stream = Some(rng.clone());
                count(kernel, &mut chain.rejections);
                Ok(())
            })
        });
        meter.finish();

        if let Err(reason) = ended {
            abort.store(true, Ordering::Relaxed);
            chain.stopped = Some(reason);
        }
    }

    /// Finds the starting point of a chain.
    fn start<K: MarkovChain>(
        &self,
        chain: usize,
        density: &dyn ErasedDensity,
        kernel: &mut K,
        rng: &mut Stream,
    ) -> Result<StartKind, RunError> {
        let mut rejections = Rejections::default();
        let mut accept = |y: &[f64]| {
            kernel.begin(y).inspect_err(|rejection| {
                // `count` returns a copy of a fatal error; the copy is ignored, because the rejection itself is
                // returned too
                let _ = rejections.count(rejection);
            })
        };
        let start = match &self.init {
            Starts::Points(starts) => with_values(density, starts[chain].clone(), &self.values)
                .and_then(|point| match accept(&point) {
                    Ok(()) => Ok((StartKind::Given, point)),
                    Err(Rejection::Fatal(error)) => Err(NoStart::Fatal(error, point)),
                    Err(last) => Err(NoStart::Rejected { uniform: 1, prior: 0, last, point }),
                }),
            Starts::Uniform(radius) => {
                let mut uniform = |rng: &mut Stream| -> Vec<f64> {
                    let coordinate = |_| radius * (2.0 * rng.random::<f64>() - 1.0);
                    (0..density.dim()).map(coordinate).collect()
                };
                find_start(density, &self.values, rng, &mut uniform, &mut accept)
            }
        };
        let problem = match start {
            Ok((kind, _)) => {
                kernel.rejections().add(rejections);
                return Ok(kind);
            }
            Err(problem) => problem,
        };
        Err(match problem {
            NoStart::Values(problem) => RunError::Values(problem),
            NoStart::Fatal(source, point) => {
                // `explain` evaluates the density, which requires a point of the right length
                let detail = (point.len() == density.dim()).then(|| kernel.explain(&point));
                RunError::Fatal { chain, source, detail: detail.flatten() }
            }
            NoStart::Rejected { uniform, prior, last, point } => RunError::Initialisation {
                chain,
                tries: uniform,
                prior_draws: prior,
                rejections: rejections.take(),
                last: Box::new(last),
                detail: kernel.explain(&point),
            },
        })
    }

    /// Runs the transitions up to the next kept draw and returns their combined statistics.
    fn draw<K: MarkovChain>(
        &self,
        kernel: &mut K,
        rng: &mut Stream,
        meter: &mut Meter<'_>,
        abort: &AtomicBool,
    ) -> Result<DrawStats, StopReason> {
        let mut next = || {
            self.check(abort)?;
            kernel.transition(rng).inspect(|stats| meter.transition(stats))
        };
        let mut joint = next()?;
        for _ in 1..self.thin {
            let stats = next()?;
            joint = DrawStats {
                acceptance: joint.acceptance + stats.acceptance,
                leapfrogs: joint.leapfrogs + stats.leapfrogs,
                divergent: joint.divergent || stats.divergent,
                ..stats
            };
        }
        joint.acceptance /= self.thin as f64;
        Ok(joint)
    }

    fn check(&self, abort: &AtomicBool) -> Result<(), StopReason> {
        if self.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            Err(StopReason::Interrupted)
        } else if abort.load(Ordering::Relaxed) {
            Err(StopReason::OtherChain)
        } else {
            Ok(())
        }
    }
}

/// Moves the kernel's counts of rejections to `rejections`. Called only between transitions, in states from which the
/// chain can be resumed.
fn count(kernel: &mut impl MarkovChain, rejections: &mut BTreeMap<Location, u64>) {
    for (location, count) in kernel.rejections().take() {
        *rejections.entry(location).or_insert(0) += count;
    }
}
