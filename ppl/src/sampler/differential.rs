//! Differential-evolution Metropolis.

use std::sync::atomic::AtomicBool;

use rand::Rng;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use super::{
    archive::Archive,
    chains::{Chains, Covariance, DrawStats, WarmupReport},
    earlier::another_sampler,
    error::SampleError,
    progress::Progress,
    random_walk::target_acceptance,
    rejections::{Rejections, Stop, accepting, finite},
    run::{Kernel, Stream},
    settings::{Init, Run, shared_settings},
    tuning::Tuning,
};
use crate::{
    any::{AnyDensity, Evaluator},
    bound::Bound,
    density::{LogDensity, Rejection},
    model::Model,
    posterior::Posterior,
};

/// Share of snooker updates.
const SNOOKER: f64 = 0.1;
/// Share of updates with γ = 1, which jump between modes.
const JUMP: f64 = 0.1;
/// Standard deviation of the noise on every proposal, in standard deviations of the archive.
const NOISE: f64 = 1e-3;
/// Warmup transitions between two entries of the population into the archive.
const THIN: usize = 10;
/// Starting points are this far from the first in every coordinate, at most.
const SPREAD: f64 = 2.0;
/// Tries for the start of a member.
const TRIES: usize = 100;

/// Differential-evolution Metropolis: jumps are differences of past points.
///
/// Each chain holds in its warmup a population that walks in lockstep and files every tenth
/// generation in an archive; the older half of the archive is forgotten as it grows. A member at
/// y proposes `y + γ (z₁ − z₂) + e` with z₁, z₂ from the archive, γ = 2.38/√(2d), and 1 in a
/// tenth of the updates so that it can jump between modes; a further tenth are snooker
/// updates along the line through y and a point z of the archive. So the proposals take on
/// scale and correlations of the target without a covariance, and several modes once the population
/// has found them. After the warmup the archive is frozen and one member walks on alone: the
/// kept draws are an ordinary Markov chain, and the chains are independent of each other.
///
/// Statistics of a draw: `leapfrogs` counts evaluations (the population's in the warmup, 1 later),
/// `step_size` is γ, `depth` 0, `energy` −ln p. [`WarmupReport::covariance`] has the variances of
/// the frozen archive.
///
/// # Errors
/// [`SampleError`] if a setting is out of range or a chain finds no starting point.
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
/// let posterior = DifferentialEvolution::default().draws(20_000).seed(7).sample(&square(9.0))?;
/// ppl::check::mean(&posterior, "x", 0.0).within_mcse(4.0);
/// # Ok::<(), ppl::SampleError>(())
/// ```
///
/// # References
/// ter Braak, Statistics and Computing 16 (2006) 239, doi:10.1007/s11222-006-8769-1; ter Braak &
/// Vrugt, Statistics and Computing 18 (2008) 435, doi:10.1007/s11222-008-9104-9.
#[derive(Clone, Debug)]
pub struct DifferentialEvolution<'a> {
    run: Run<'a>,
    population: usize,
    archive: Vec<Vec<f64>>,
}

impl Default for DifferentialEvolution<'_> {
    fn default() -> Self {
        Self { run: Run::new(2000, 10_000), population: 10, archive: Vec::new() }
    }
}

impl<'a> DifferentialEvolution<'a> {
    shared_settings!();

    /// Members of the population of each chain in its warmup, at least 3.
    pub fn population(mut self, members: usize) -> Self {
        self.population = members;
        self
    }

    /// Points in unconstrained space that the archive begins with, as draws of an earlier run;
    /// otherwise 10 d random ones about the starting point.
    pub fn archive(mut self, points: Vec<Vec<f64>>) -> Self {
        self.archive = points;
        self
    }

    /// Samples any log density; its gradient is not asked for.
    ///
    /// # Errors
    /// See [`DifferentialEvolution`].
    pub fn run<D: LogDensity>(&self, density: &D) -> Result<Chains, SampleError> {
        self.run_any(density)
    }

    fn run_any(&self, density: &dyn AnyDensity) -> Result<Chains, SampleError> {
        let refuse = |setting, value, mend| Err(SampleError::Setting { setting, value, mend });
        let dim = density.dim();
        if !(3..=10_000).contains(&self.population) {
            return refuse("population", self.population.to_string(), "give 3 to 10 000, as 10");
        }
        if let Some(point) = self.archive.iter().find(|point| point.len() != dim) {
            let value = format!("a point with {} coordinates", point.len());
            let mend = "give as many as the density has unconstrained coordinates";
            return refuse("archive", value, mend);
        }
        if self.archive.iter().flatten().any(|x| !x.is_finite()) {
            let value = "a point that is not finite".to_owned();
            return refuse("archive", value, "give points in unconstrained space");
        }
        let chains = self.run.execute(dim, || {
            let first = Member { y: vec![0.0; dim], log_density: f64::NEG_INFINITY };
            let archive = Archive::new(dim, &self.archive);
            let evolution = Evolution::new(density, vec![first], archive, 0);
            Evolution { population: self.population, ..evolution }
        })?;
        Ok(Chains::new(dim, chains, self.run.thin))
    }

    /// As [`Nuts::resume`](super::Nuts::resume): goes on with chains of this sampler, finished or
    /// interrupted, to the very draws of one longer run.
    ///
    /// # Errors
    /// [`SampleError::Earlier`] if the chains are not of this sampler or this density, or one
    /// failed in its warmup; else see [`DifferentialEvolution`].
    pub fn resume<D: LogDensity>(
        &self,
        density: &D,
        earlier: Chains,
    ) -> Result<Chains, SampleError> {
        self.resume_any(density, earlier)
    }

    fn resume_any(&self, density: &dyn AnyDensity, earlier: Chains) -> Result<Chains, SampleError> {
        self.run.resume(density.dim(), earlier, |chain| match chain.tuning.as_deref() {
            Some(Tuning::Population { members, archive, generations }) => {
                Ok(Evolution::new(density, members.clone(), archive.clone(), *generations))
            }
            _ => Err(another_sampler()),
        })
    }

    /// Samples a model: the draws with everything the model names.
    ///
    /// # Errors
    /// See [`DifferentialEvolution`]; also if the model cannot be evaluated, or a chain was
    /// stopped before its first draw.
    pub fn sample<M: Model>(&self, model: &Bound<M>) -> Result<Posterior, SampleError> {
        Posterior::sample(model, self.run.seed, &|density| self.run_any(density))
    }
}

/// A walker of the population.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Member {
    pub(super) y: Vec<f64>,
    log_density: f64,
}

struct Evolution<'a> {
    density: Box<dyn Evaluator + 'a>,
    /// The first is the one that is kept.
    members: Vec<Member>,
    population: usize,
    archive: Archive,
    proposal: Vec<f64>,
    generations: usize,
    rejections: Rejections,
}

impl<'a> Evolution<'a> {
    fn new(
        density: &'a dyn AnyDensity,
        members: Vec<Member>,
        archive: Archive,
        generations: usize,
    ) -> Self {
        Self {
            density: density.evaluator(),
            population: members.len(),
            members,
            archive,
            proposal: vec![0.0; density.dim()],
            generations,
            rejections: Rejections::default(),
        }
    }

    fn gamma(&self) -> f64 {
        2.38 / (2.0 * self.proposal.len().max(1) as f64).sqrt()
    }

    /// A random start for a member, or the first member's where none is accepted.
    fn found(&mut self, rng: &mut Stream) -> Result<Member, Stop> {
        let first = &self.members[0];
        for _ in 0..TRIES {
            let y: Vec<f64> = first.y.iter().map(|y| y + around(rng)).collect();
            let log_density = self.rejections.value(&mut *self.density, &y)?;
            if log_density > f64::NEG_INFINITY {
                return Ok(Member { y, log_density });
            }
        }
        Ok(Member { y: first.y.clone(), log_density: first.log_density })
    }

    /// Moves a member and returns its acceptance probability.
    fn step(&mut self, member: usize, rng: &mut Stream) -> Result<f64, Stop> {
        let gamma = self.gamma();
        let Member { y, log_density } = &mut self.members[member];
        let kind: f64 = rng.random();
        let correction = if kind < SNOOKER {
            self.archive.snooker(y, &mut self.proposal, rng)
        } else {
            let gamma = if kind < SNOOKER + JUMP { 1.0 } else { gamma };
            self.archive.difference(y, gamma, &mut self.proposal, rng);
            Some(0.0)
        };
        let Some(correction) = correction else { return Ok(0.0) };
        for (new, spread) in self.proposal.iter_mut().zip(self.archive.spread()) {
            // along a snooker line noise would spoil the acceptance rule
            if kind >= SNOOKER {
                *new += NOISE * spread * rng.sample::<f64, _>(StandardNormal);
            }
        }
        let proposed = self.rejections.value(&mut *self.density, &self.proposal)?;
        let acceptance = accepting(proposed - *log_density + correction);
        if rng.random::<f64>() < acceptance {
            std::mem::swap(y, &mut self.proposal);
            *log_density = proposed;
        }
        Ok(acceptance)
    }
}

/// A coordinate of a starting point about another.
fn around(rng: &mut Stream) -> f64 {
    SPREAD * (2.0 * rng.random::<f64>() - 1.0)
}

impl Kernel for Evolution<'_> {
    fn begin(&mut self, y: &[f64]) -> Result<(), Rejection> {
        self.members[0].y.copy_from_slice(y);
        self.members[0].log_density = finite(&mut *self.density, y)?;
        Ok(())
    }

    fn prepare(&mut self, rng: &mut Stream) -> Result<(), Stop> {
        while self.members.len() < self.population {
            let member = self.found(rng)?;
            self.members.push(member);
        }
        // ten points a coordinate, as ter Braak & Vrugt begin
        let missing = if self.archive.is_empty() { 10 * self.proposal.len() } else { 0 };
        for _ in 0..missing {
            let y: Vec<f64> = self.members[0].y.iter().map(|y| y + around(rng)).collect();
            self.archive.file(&y);
        }
        self.archive.measure();
        Ok(())
    }

    fn transition(&mut self, rng: &mut Stream) -> Result<DrawStats, Stop> {
        let mut sum = 0.0;
        let members = self.members.len();
        if !self.proposal.is_empty() {
            for member in 0..members {
                sum += self.step(member, rng)?;
            }
        } else {
            sum = members as f64;
        }
        let (log_density, gamma) = (self.members[0].log_density, self.gamma());
        Ok(DrawStats::walk(log_density, sum / members as f64, gamma, members as u32))
    }

    fn adapt(&mut self, _: &DrawStats, _: &mut Stream) -> Result<(), Stop> {
        self.generations += 1;
        if self.generations.is_multiple_of(THIN) {
            for member in &self.members {
                self.archive.file(&member.y);
            }
            self.archive.measure();
        }
        Ok(())
    }

    fn freeze(&mut self, report: &mut WarmupReport) {
        self.members.truncate(1);
        report.step_size = self.gamma();
        report.target_acceptance = target_acceptance(self.proposal.len());
        let variances = self.archive.spread().iter().map(|s| s * s).collect();
        report.covariance = Covariance::Diagonal(variances);
    }

    fn tuning(&self) -> Tuning {
        Tuning::Population {
            members: self.members.clone(),
            archive: self.archive.clone(),
            generations: self.generations,
        }
    }

    fn position(&self) -> &[f64] {
        &self.members[0].y
    }

    fn log_density(&self) -> f64 {
        self.members[0].log_density
    }

    fn divergence(&self) -> (&[f64], f64) {
        (&self.members[0].y, 0.0)
    }

    fn rejections(&mut self) -> &mut Rejections {
        &mut self.rejections
    }

    fn explain(&self, y: &[f64]) -> Option<String> {
        self.density.explain(y)
    }
}
