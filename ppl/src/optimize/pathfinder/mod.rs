//! Pathfinder: normal approximations along the way to a mode.

mod approximation;
mod path;

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

pub use path::PathfinderPath;

use super::map::OptimizeError;
use crate::{
    any::AnyDensity,
    density::LogDensity,
    diagnostics::pareto_smooth,
    sampler::{Chain, Chains, Covariance, DrawStats, WarmupReport},
};

/// Most numbers that the draws of all paths may have, 32 GiB: a slip of the keyboard should not
/// exhaust memory.
const MOST_NUMBERS: usize = 1 << 32;

/// Pareto k up to which importance sampling can be relied on.
const RELIABLE: f64 = 0.7;
/// A mode whose evidence is e²⁰ times smaller than another's holds no draw of any run.
const NEGLIGIBLE: f64 = 20.0;

/// Approximates a posterior in the time of an optimisation.
///
/// Each path climbs to a mode by L-BFGS from a start uniform on (−2, 2). The optimiser's inverse
/// Hessian gives a normal approximation at every iterate; the one with the largest evidence lower
/// bound, estimated from 25 draws, is kept. Draws of all paths are then weighted by p/q with q the
/// mixture of the paths' normals, smoothed by a Pareto tail, and resampled. The tail's shape k judges
/// the result: above 0.7 the draws are no approximation of the posterior, though still good starts
/// for [`Nuts::init_pathfinder`](crate::Nuts::init_pathfinder).
///
/// Paths run in parallel; the draws of a seed do not depend on the number of threads.
///
/// # Errors
/// [`OptimizeError`] if a setting is 0, no start is accepted, or no path has an approximation.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     fn level(measured: &[f64]) {
///         let level ~ Normal(0.0, 10.0);
///         let sd ~ HalfNormal(1.0);
///         for measured in measured {
///             measured ~ Normal(level, sd);
///         }
///     }
/// }
///
/// let model = level(&[3.1, 2.4, 2.9, 3.3, 2.2, 2.8]);
/// let fit = ppl::Pathfinder::default().seed(7).run(&model)?;
/// assert!(fit.is_reliable(), "Pareto k = {}", fit.pareto_k);
/// let posterior = ppl::Posterior::from_chains(&model, fit.chains(), 7)?;
/// let draws = posterior.trace("level").expect("an unknown").concat();
/// assert!((ppl::diagnostics::quantile(&draws, 0.5) - 2.8).abs() < 0.2);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Reference: Zhang, Carpenter, Gelman & Vehtari, *Pathfinder: parallel quasi-Newton variational
/// inference*, JMLR 23 (2022) 306, algorithms 1–4.
#[derive(Clone, Debug)]
pub struct Pathfinder {
    paths: usize,
    draws: usize,
    elbo_draws: usize,
    iterations: u64,
    seed: u64,
}

impl Default for Pathfinder {
    fn default() -> Self {
        Self { paths: 4, draws: 1000, elbo_draws: 25, iterations: 1000, seed: 0 }
    }
}

/// What [`Pathfinder`] found.
#[derive(Clone, Debug)]
pub struct PathfinderFit {
    /// Number of unconstrained coordinates.
    pub dim: usize,
    /// Resampled draws, row-major `n × dim`, unconstrained.
    pub draws: Vec<f64>,
    /// Log density at each of them.
    pub log_densities: Vec<f64>,
    /// Shape of the tail of the importance ratios.
    pub pareto_k: f64,
    /// The paths that found an approximation.
    pub paths: Vec<PathfinderPath>,
}

impl Pathfinder {
    /// Number of paths; 1 is single-path Pathfinder.
    pub fn paths(mut self, paths: usize) -> Self {
        self.paths = paths;
        self
    }

    /// Draws taken from each path, and draws resampled from all.
    pub fn draws(mut self, draws: usize) -> Self {
        self.draws = draws;
        self
    }

    /// Draws by which an approximation is judged.
    pub fn elbo_draws(mut self, draws: usize) -> Self {
        self.elbo_draws = draws;
        self
    }

    /// Most iterations of each optimisation.
    pub fn iterations(mut self, iterations: u64) -> Self {
        self.iterations = iterations;
        self
    }

    /// Seed of starts and draws.
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = seed;
        self
    }

    /// Approximates any log density, as that of a model.
    ///
    /// # Errors
    /// See [`Pathfinder`].
    pub fn run<D: LogDensity>(&self, density: &D) -> Result<PathfinderFit, OptimizeError> {
        self.run_any(density)
    }

    pub(crate) fn run_any(&self, density: &dyn AnyDensity) -> Result<PathfinderFit, OptimizeError> {
        let settings = [
            ("paths", self.paths),
            ("draws", self.draws),
            ("elbo_draws", self.elbo_draws),
            ("iterations", self.iterations as usize),
        ];
        if let Some(&(setting, _)) = settings.iter().find(|(_, value)| *value == 0) {
            let value = "0".to_owned();
            return Err(OptimizeError::Setting { setting, value, mend: "give at least 1" });
        }
        let dim = density.dim();
        if dim == 0 {
            return Err(OptimizeError::NoUnknowns);
        }
        let all = self.paths.saturating_mul(self.draws).saturating_mul(dim);
        if all > MOST_NUMBERS {
            let value = self.draws.to_string();
            let mend = "paths × draws × unknowns may be 2^32 at most";
            return Err(OptimizeError::Setting { setting: "draws", value, mend });
        }

        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let streams: Vec<_> = (0..self.paths)
            .map(|_| {
                let own = rng.clone();
                rng.jump();
                own
            })
            .collect();
        let search = |rng| path::find(density, self.iterations, self.elbo_draws, self.draws, rng);
        let found: Vec<Option<PathfinderPath>> =
            streams.into_par_iter().map(search).collect::<Result<_, OptimizeError>>()?;
        let paths: Vec<PathfinderPath> = found.into_iter().flatten().collect();

        // a draw outside the support has weight 0
        let draws: Vec<&path::Draw> = (paths.iter().flat_map(|path| &path.draws))
            .filter(|draw| draw.log_density.is_finite())
            .collect();
        if draws.is_empty() {
            return Err(OptimizeError::NoApproximation { paths: self.paths });
        }
        let mut weights: Vec<f64> =
            draws.iter().map(|draw| draw.log_density - log_mixture(&paths, &draw.y)).collect();
        let pareto_k = pareto_smooth(&mut weights, 1.0);

        let mut cumulative = 0.0;
        let cumulative: Vec<f64> = (weights.iter().map(|weight| weight.exp()))
            .map(|weight| {
                cumulative += weight;
                cumulative
            })
            .collect();
        let total = cumulative[cumulative.len() - 1];
        let mut fit = PathfinderFit {
            dim,
            draws: Vec::with_capacity(self.draws * dim),
            log_densities: Vec::with_capacity(self.draws),
            pareto_k,
            paths: Vec::new(),
        };
        for _ in 0..self.draws {
            let u = total * rng.random::<f64>();
            let chosen = cumulative.partition_point(|sum| *sum <= u).min(draws.len() - 1);
            fit.draws.extend_from_slice(&draws[chosen].y);
            fit.log_densities.push(draws[chosen].log_density);
        }
        fit.paths = paths;
        Ok(fit)
    }
}

/// Log density, but for a constant, of the mixture of the paths' normals. With each path's own
/// normal instead, ratios of good and better paths together have no Pareto tail.
fn log_mixture(paths: &[PathfinderPath], y: &[f64]) -> f64 {
    let logs: Vec<f64> = paths.iter().map(|path| path.approximation.log_density(y)).collect();
    let top = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    top + logs.iter().map(|log| (log - top).exp()).sum::<f64>().ln()
}

/// Whether importance sampling with this Pareto k can be relied on.
pub(crate) fn is_reliable(pareto_k: f64) -> bool {
    pareto_k <= RELIABLE
}

impl PathfinderFit {
    /// Whether the draws approximate the posterior: Pareto k at most 0.7.
    pub fn is_reliable(&self) -> bool {
        is_reliable(self.pareto_k)
    }

    /// The resampled draws as one chain, for [`Posterior::from_chains`](crate::Posterior::from_chains).
    pub fn chains(&self) -> Chains {
        let stats = self.log_densities.iter().map(|&value| DrawStats::walk(value, 1.0, 1.0, 1));
        let mean = self.paths.first().map_or(Vec::new(), |path| path.mean().to_vec());
        let covariance =
            self.paths.first().map_or(Vec::new(), |path| path.covariance().as_slice().to_vec());
        let mut chain = Chain::new(WarmupReport {
            step_size: 1.0,
            target_acceptance: 1.0,
            covariance: Covariance::Dense(covariance),
            ..WarmupReport::at(mean)
        });
        (chain.draws, chain.stats) = (self.draws.clone(), stats.collect());
        let chains = Chains::new(self.dim, vec![chain], 1);
        Chains { pareto_k: Some(self.pareto_k), ..chains }
    }

    /// `count` draws inside the support, in turn from the paths that found a mode of any weight:
    /// for chains to start from.
    pub(crate) fn starts(&self, count: usize) -> Vec<Vec<f64>> {
        let best = self.paths.iter().map(|path| path.elbo).fold(f64::NEG_INFINITY, f64::max);
        let inside = |path: &PathfinderPath| {
            let inside = path.draws.iter().filter(|draw| draw.log_density.is_finite());
            inside.map(|draw| draw.y.clone()).collect::<Vec<_>>()
        };
        let weighty = self.paths.iter().filter(|path| path.elbo >= best - NEGLIGIBLE);
        let paths: Vec<Vec<Vec<f64>>> =
            weighty.map(inside).filter(|draws| !draws.is_empty()).collect();
        let pick = |k: usize| {
            let draws = &paths[k % paths.len()];
            draws[k / paths.len() % draws.len()].clone()
        };
        (0..count).map(pick).collect()
    }
}
