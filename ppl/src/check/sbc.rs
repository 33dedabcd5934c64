//! Simulation-based calibration.

use std::fmt;

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use super::{CheckError, Sampler};
use crate::density::LogDensity;
use crate::quantity::draws::element_names;
use crate::sampler::Nuts;
use crate::special::regularised_gamma;
use crate::{Bound, Entry, Model, Record, Role};

/// Simulation-based calibration: a test that posterior intervals contain the true values with their nominal
/// probability.
///
/// Each trial draws true parameters from the prior, simulates data from them, and computes the rank of the true
/// values among the posterior draws. If model, gradient and sampler are correct, the ranks of many trials are
/// uniform. A sampler that returned prior draws would also give uniform ranks of the parameters. Therefore the log
/// likelihood of the simulated data is ranked too.
///
/// ```
/// use ppl::check;
/// use ppl::prelude::*;
///
/// ppl::model! {
///     fn mean(y: &[f64]) {
///         let mu ~ Normal(0.0, 1.0);
///         for y in y {
///             y ~ Normal(mu, 2.0);
///         }
///     }
/// }
///
/// let report = check::sbc(7).replications(50).run(|trial| {
///     let truth = mean(&[0.0; 10]).draw_prior(&mut trial.rng)?; // the data give only the shape
///     let data = truth.replicate("y").unwrap_or_default();
///     trial.rank(&mean(data), &truth)
/// })?;
/// report.assert_uniform(1e-4);
/// # Ok::<(), check::CheckError>(())
/// ```
///
/// References: Talts et al. (2018), arXiv:1804.06788; Modrák et al. (2023), doi:10.1214/23-BA1404.
#[derive(Clone, Debug)]
pub struct Sbc<S> {
    seed: u64,
    replications: usize,
    ranked: usize,
    sampler: S,
}

/// Simulation-based calibration with 200 trials and 99 ranked draws per trial; see [`Sbc`].
pub fn sbc<'a>(seed: u64) -> Sbc<Nuts<'a>> {
    let sampler = Nuts::default().chains(1).warmup(500).draws(990);
    Sbc { seed, replications: 200, ranked: 99, sampler }
}

impl<S: Sampler> Sbc<S> {
    /// Sets the number of trials, at least 20. The smallest detectable miscalibration is proportional to 1/√trials.
    pub fn replications(mut self, replications: usize) -> Self {
        self.replications = replications;
        self
    }

    /// Sets the number of posterior draws per trial among which the true values are ranked. These draws are equally
    /// spaced over the run. Choose a number so small that the draws are nearly independent: correlated draws give
    /// ranks that are not uniform even if the sampler is correct.
    pub fn ranked_draws(mut self, draws: usize) -> Self {
        self.ranked = draws;
        self
    }

    /// Sets the sampler to be tested. The default is [`Nuts`] with one chain of 500 warmup transitions and 990 draws.
    /// Each trial sets a new seed.
    pub fn sampler<T: Sampler>(self, sampler: T) -> Sbc<T> {
        let Self { seed, replications, ranked, .. } = self;
        Sbc { seed, replications, ranked, sampler }
    }

    /// Runs `trial` once per replication, in parallel. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// The first [`CheckError`] of a trial, or [`CheckError::Setting`] for fewer than 20 trials or 9 ranked draws.
    pub fn run(
        &self,
        trial: impl Fn(&mut Trial<'_, S>) -> Result<(), CheckError> + Sync,
    ) -> Result<SbcReport, CheckError> {
        let settings = [("replications", self.replications, 20), ("ranked_draws", self.ranked, 9)];
        for (setting, value, least) in settings {
            if value < least {
                return Err(CheckError::Setting { setting, value, least });
            }
        }
        let mut stream = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let streams: Vec<Xoshiro256PlusPlus> = (0..self.replications)
            .map(|_| {
                stream.jump();
                stream.clone()
            })
            .collect();
        let trials: Vec<Trial<'_, S>> = streams
            .into_par_iter()
            .map(|rng| {
                let ranks = Vec::new();
                let mut one = Trial {
                    rng,
                    sampler: &self.sampler,
                    ranked: self.ranked,
                    divergences: 0,
                    ranks,
                };
                trial(&mut one)?;
                Ok(one)
            })
            .collect::<Result<_, CheckError>>()?;

        let mut quantities: Vec<SbcQuantity> = Vec::new();
        for (name, rank) in trials.iter().flat_map(|t| &t.ranks) {
            match quantities.iter_mut().find(|q| q.name == *name) {
                Some(quantity) => quantity.ranks.push(*rank),
                None => quantities.push(SbcQuantity { name: name.clone(), ranks: vec![*rank] }),
            }
        }
        let divergences = trials.iter().map(|t| t.divergences).sum();
        Ok(SbcReport { quantities, divergences })
    }
}

/// One replication: it draws true parameters, simulates data, and ranks the true parameters among posterior draws.
#[derive(Debug)]
pub struct Trial<'a, S> {
    /// Random number generator of this trial, for the true parameters and the data.
    pub rng: Xoshiro256PlusPlus,
    sampler: &'a S,
    ranked: usize,
    divergences: usize,
    ranks: Vec<(String, f64)>,
}

/// Values with their names.
type Named = Vec<(String, f64)>;

impl<S: Sampler> Trial<'_, S> {
    /// Samples the posterior of `model`, and ranks the log likelihood and all parameters of `truth` among the draws.
    /// `truth` is a prior draw of the same model.
    ///
    /// # Errors
    /// [`CheckError`] if the sampler or the model fails.
    pub fn rank<M: Model>(&mut self, model: &Bound<M>, truth: &Record) -> Result<(), CheckError> {
        self.rank_with(model, truth, |_| Vec::new())
    }

    /// Version of [`rank`](Trial::rank) that also ranks the quantities that the closure `further` computes. These
    /// quantities can depend on the data, as in `|at| vec![("residual".to_owned(),
    /// at.values("mu").unwrap_or_default()[0] - mean_of_data)]`. The closure must return the same names for every
    /// record.
    ///
    /// # Errors
    /// [`CheckError`] if the sampler or the model fails.
    pub fn rank_with<M: Model>(
        &mut self,
        model: &Bound<M>,
        truth: &Record,
        further: impl Fn(&Record) -> Named,
    ) -> Result<(), CheckError> {
        model.layout()?;
        let quantities = |at: &Record, likelihood: f64| -> Named {
            let parameters = at.entries.iter().filter(|e| e.variable.role == Role::Parameter);
            let mut all: Named = parameters.flat_map(elements).collect();
            all.push(("log likelihood".to_owned(), likelihood));
            all.extend(further(at));
            all
        };
        // `truth` was drawn with other data, so its log likelihood is evaluated with the simulated data
        let (y, mut rng) = (&truth.unconstrained, self.rng.clone());
        let likelihood = model.constrain(y, &mut rng)?.log_likelihood();
        let truth = quantities(truth, likelihood);

        let draws = self.sampler.draws(model, self.rng.random())?;
        self.divergences += draws.divergences;
        let draw_positions: Vec<&[f64]> = draws.points.chunks_exact(model.dim().max(1)).collect();
        if draw_positions.len() < self.ranked {
            let (value, least) = (draw_positions.len(), self.ranked);
            return Err(CheckError::Setting { setting: "draws of the sampler", value, least });
        }
        let mut below = vec![0; truth.len()];
        let mut equal = vec![0; truth.len()];
        for k in 0..self.ranked {
            let record = model
                .constrain(draw_positions[k * draw_positions.len() / self.ranked], &mut self.rng)?;
            let values = quantities(&record, record.log_likelihood());
            for (i, ((_, value), (_, true_value))) in values.iter().zip(&truth).enumerate() {
                below[i] += usize::from(value < true_value);
                equal[i] += usize::from(value == true_value);
            }
        }
        for (i, (name, _)) in truth.into_iter().enumerate() {
            if equal[i] < self.ranked {
                // randomised rank: the rank is drawn uniformly between its bounds, so that it is exactly uniform on
                // (0, 1), also with ties
                let spread = self.rng.random::<f64>() * (equal[i] + 1) as f64;
                let rank = (below[i] as f64 + spread) / (self.ranked + 1) as f64;
                self.ranks.push((name, rank));
            }
        }
        Ok(())
    }
}

fn elements(entry: &Entry) -> impl Iterator<Item = (String, f64)> {
    let names = element_names(&entry.variable.name, &entry.variable.shape);
    names.into_iter().zip(entry.values.iter().copied())
}

/// Normalised ranks of one quantity over all trials.
#[derive(Clone, Debug, PartialEq)]
pub struct SbcQuantity {
    /// Name of the quantity, with indices.
    pub name: String,
    /// Ranks on (0, 1), one per trial.
    pub ranks: Vec<f64>,
}

impl SbcQuantity {
    /// Number of ranks in each of `bins` bins of equal width.
    pub fn histogram(&self, bins: usize) -> Vec<usize> {
        let mut counts = vec![0; bins];
        for rank in &self.ranks {
            counts[((rank * bins as f64) as usize).min(bins - 1)] += 1;
        }
        counts
    }

    /// p-value of Pearson's χ² test for uniform ranks, with about ten trials per bin (5 to 20 bins). The test is
    /// sensitive to ∪ and ∩ shapes of the histogram.
    pub fn chi_square_p(&self) -> f64 {
        let bins = (self.ranks.len() / 10).clamp(5, 20);
        let expected = self.ranks.len() as f64 / bins as f64;
        let counts = self.histogram(bins);
        let statistic: f64 = counts.iter().map(|&n| (n as f64 - expected).powi(2) / expected).sum();
        regularised_gamma((bins as f64 - 1.0) / 2.0, statistic / 2.0).1
    }

    /// Upper bound 2 exp(−2 n D²) on the p-value of the largest distance D between the empirical distribution
    /// function of the ranks and the diagonal (Massart 1990, doi:10.1214/aop/1176990746). The test is sensitive to
    /// shifts of the ranks.
    pub fn ecdf_p(&self) -> f64 {
        let mut sorted = self.ranks.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let n = sorted.len() as f64;
        let distance = sorted
            .iter()
            .enumerate()
            .fold(0.0_f64, |d, (i, u)| d.max(u - i as f64 / n).max((i as f64 + 1.0) / n - u));
        (2.0 * (-2.0 * n * distance * distance).exp()).min(1.0)
    }
}

/// Result of a simulation-based calibration.
#[derive(Clone, Debug, PartialEq)]
pub struct SbcReport {
    /// Ranks of each quantity.
    pub quantities: Vec<SbcQuantity>,
    /// Number of divergent transitions over all trials.
    pub divergences: usize,
}

impl SbcReport {
    /// Smallest p-value over all quantities and both tests, with Bonferroni correction. If model and sampler are
    /// correct, this p-value is below a given p with probability at most p.
    pub fn p_value(&self) -> f64 {
        let tests = 2.0 * self.quantities.len() as f64;
        let all = self.quantities.iter().flat_map(|q| [q.chi_square_p(), q.ecdf_p()]);
        (tests * all.fold(f64::INFINITY, f64::min)).min(1.0)
    }

    /// Asserts that all ranks are uniform. If model and sampler are correct, the assertion fails with a probability
    /// of at most `false_alarms`, for example 1e-4.
    ///
    /// # Panics
    /// If the p-value is smaller than `false_alarms`, with the histograms; or if no quantity was ranked.
    #[track_caller]
    pub fn assert_uniform(&self, false_alarms: f64) {
        assert!(!self.quantities.is_empty(), "no quantity was ranked: call Trial::rank");
        assert!(self.p_value() >= false_alarms, "ranks are not uniform\n{self}");
    }
}

impl fmt::Display for SbcReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for q in &self.quantities {
            writeln!(
                f,
                "{}: {} trials, p = {:.2e} (χ²), {:.2e} (distribution function); ranks {:?}",
                q.name,
                q.ranks.len(),
                q.chi_square_p(),
                q.ecdf_p(),
                q.histogram(10)
            )?;
        }
        writeln!(
            f,
            "p = {:.2e} over all; {} divergent transitions",
            self.p_value(),
            self.divergences
        )?;
        write!(
            f,
            "many low and high ranks: posteriors too narrow; many in the middle: too wide; \
             a slope: biased (mostly low ranks: estimates too high)"
        )
    }
}
