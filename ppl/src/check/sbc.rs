//! Simulation-based calibration.

use std::fmt;

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use super::{CheckError, Sampler};
use crate::density::LogDensity;
use crate::group::element_names;
use crate::sampler::Nuts;
use crate::special::regularised_gamma;
use crate::{Bound, Entry, Model, Record, Role};

/// Simulation-based calibration: do posteriors of simulated data contain the truth as often as
/// they say?
///
/// A truth is drawn from the prior, data are simulated from it, and the rank of the truth among
/// the posterior's draws is noted. Over many trials the ranks are uniform if model, gradient and
/// sampler are right. The parameters alone cannot tell a posterior from the prior, whose draws
/// are calibrated too; so the log likelihood of the data is ranked with them.
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

/// Simulation-based calibration with 200 trials, 99 ranked draws of one chain each; see [`Sbc`].
pub fn sbc<'a>(seed: u64) -> Sbc<Nuts<'a>> {
    let sampler = Nuts::default().chains(1).warmup(500).draws(990);
    Sbc { seed, replications: 200, ranked: 99, sampler }
}

impl<S: Sampler> Sbc<S> {
    /// Number of trials, at least 20. The smallest miscalibration that can be seen shrinks as
    /// 1/√trials.
    pub fn replications(mut self, replications: usize) -> Self {
        self.replications = replications;
        self
    }

    /// Draws that the truth is ranked among, equally spaced over the run. Keep them so few that
    /// they are nearly independent: correlated draws make ranks look miscalibrated.
    pub fn ranked_draws(mut self, draws: usize) -> Self {
        self.ranked = draws;
        self
    }

    /// The sampler, by default [`Nuts`] with one chain of 500 + 990 draws; its seed is set anew
    /// for every trial.
    pub fn sampler<T: Sampler>(self, sampler: T) -> Sbc<T> {
        let Self { seed, replications, ranked, .. } = self;
        Sbc { seed, replications, ranked, sampler }
    }

    /// Runs `trial` once a replication, in parallel; the result does not depend on the number of
    /// threads.
    ///
    /// # Errors
    /// The first [`CheckError`] of a trial, or fewer than 20 trials.
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

/// One replication: draw a truth, simulate, and rank it.
#[derive(Debug)]
pub struct Trial<'a, S> {
    /// Random numbers of this trial, for truth and data.
    pub rng: Xoshiro256PlusPlus,
    sampler: &'a S,
    ranked: usize,
    divergences: usize,
    ranks: Vec<(String, f64)>,
}

/// Numbers by name.
type Named = Vec<(String, f64)>;

impl<S: Sampler> Trial<'_, S> {
    /// Samples `model` and ranks all parameters of `truth`, a prior draw of the same model, and
    /// the log likelihood.
    ///
    /// # Errors
    /// [`CheckError`] if the sampler or the model fails.
    pub fn rank<M: Model>(&mut self, model: &Bound<M>, truth: &Record) -> Result<(), CheckError> {
        self.rank_with(model, truth, |_| Vec::new())
    }

    /// As [`rank`](Trial::rank), with further quantities, which may depend on the data:
    /// `|at| vec![("residual".to_owned(), at.values("mu").unwrap_or_default()[0] - mean_of_data)]`,
    /// the same ones at every point.
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
        // the truth was drawn beside other data
        let (y, mut rng) = (&truth.unconstrained, self.rng.clone());
        let likelihood = model.constrain(y, &mut rng)?.log_likelihood();
        let truth = quantities(truth, likelihood);

        let draws = self.sampler.draws(model, self.rng.random())?;
        self.divergences += draws.divergences;
        let kept: Vec<&[f64]> = draws.points.chunks_exact(model.dim().max(1)).collect();
        if kept.len() < self.ranked {
            let (value, least) = (kept.len(), self.ranked);
            return Err(CheckError::Setting { setting: "draws of the sampler", value, least });
        }
        let mut below = vec![0; truth.len()];
        let mut equal = vec![0; truth.len()];
        for k in 0..self.ranked {
            let record = model.constrain(kept[k * kept.len() / self.ranked], &mut self.rng)?;
            let values = quantities(&record, record.log_likelihood());
            for (i, ((_, value), (_, true_value))) in values.iter().zip(&truth).enumerate() {
                below[i] += usize::from(value < true_value);
                equal[i] += usize::from(value == true_value);
            }
        }
        for (i, (name, _)) in truth.into_iter().enumerate() {
            if equal[i] < self.ranked {
                // a rank in 0 … L, spread over its cell: exactly uniform on (0, 1); ties likewise
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

/// Normalised ranks of one number over all trials.
#[derive(Clone, Debug, PartialEq)]
pub struct SbcQuantity {
    /// Name with indices.
    pub name: String,
    /// Ranks on (0, 1), one a trial.
    pub ranks: Vec<f64>,
}

impl SbcQuantity {
    /// Counts in `bins` equal bins.
    pub fn histogram(&self, bins: usize) -> Vec<usize> {
        let mut counts = vec![0; bins];
        for rank in &self.ranks {
            counts[((rank * bins as f64) as usize).min(bins - 1)] += 1;
        }
        counts
    }

    /// p-value of Pearson's χ² test for uniform ranks, with about ten trials a bin (5 to 20 bins):
    /// sees ∪ and ∩ shapes.
    pub fn chi_square_p(&self) -> f64 {
        let bins = (self.ranks.len() / 10).clamp(5, 20);
        let expected = self.ranks.len() as f64 / bins as f64;
        let counts = self.histogram(bins);
        let statistic: f64 = counts.iter().map(|&n| (n as f64 - expected).powi(2) / expected).sum();
        regularised_gamma((bins as f64 - 1.0) / 2.0, statistic / 2.0).1
    }

    /// Bound on the p-value of the largest distance D between the ranks' distribution function and
    /// the diagonal, 2 exp(−2 n D²) (Massart 1990, doi:10.1214/aop/1176990746): sees shifts.
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

/// Ranks of all quantities.
#[derive(Clone, Debug, PartialEq)]
pub struct SbcReport {
    /// One entry a number.
    pub quantities: Vec<SbcQuantity>,
    /// Divergent transitions over all trials.
    pub divergences: usize,
}

impl SbcReport {
    /// The smallest p-value over all quantities and both tests, corrected for their number
    /// (Bonferroni): below p with a chance of at most p if everything is right.
    pub fn p_value(&self) -> f64 {
        let tests = 2.0 * self.quantities.len() as f64;
        let all = self.quantities.iter().flat_map(|q| [q.chi_square_p(), q.ecdf_p()]);
        (tests * all.fold(f64::INFINITY, f64::min)).min(1.0)
    }

    /// Asserts that all ranks are uniform; fails by chance at most with the rate `false_alarms`,
    /// as 1e-4.
    ///
    /// # Panics
    /// With the histograms if the p-value is smaller, and if nothing was ranked.
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
