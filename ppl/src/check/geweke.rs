//! Geweke's joint distribution test.

use std::fmt;

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use super::{CheckError, Transition, sbc::elements};
use crate::diagnostics::mean_and_variance;
use crate::special::regularised_beta;
use crate::tempered::Tempered;
use crate::{Bound, Model, Record, Role};

/// Geweke's test: does a transition leave the joint distribution of unknowns and data unchanged?
///
/// Unknowns and data are drawn together in two ways: unknowns from the prior and data from them
/// (marginal–conditional), and by a chain that from such a start alternates a transition of the
/// sampler given the data with new data given the unknowns (successive–conditional). If model,
/// simulation and transition agree, both have the same distribution, after any number of steps.
/// Compared are all parameters and the log likelihood, by their ranks u in both samples together,
/// so that heavy tails do no harm: the mean of u sees shifts, the mean of (2u − 1)² sees
/// spread. Chains are independent, so the means of the chains give the standard error, and
/// Welch's t-test the p-values.
///
/// It needs thousands of transitions instead of hundreds of whole runs, and so sees smaller faults
/// of a kernel than [`sbc`](super::sbc); it does not see a sampler that never reaches a part of the
/// posterior within its steps, nor what the warmup does.
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
/// let start = mean(&[0.0; 10]); // the data give only the shape
/// let report = check::geweke(7, Metropolis::default()).run(&start, |joint| {
///     let data = joint.replicate("y");
///     joint.update(&mean(&data))
/// })?;
/// report.assert_equal(1e-4);
/// # Ok::<(), check::CheckError>(())
/// ```
///
/// # References
/// Geweke, JASA 99 (2004) 799, doi:10.1198/016214504000001132; Gandy & Scott (2020),
/// arXiv:2001.06465, for tests with independent chains.
#[derive(Clone, Debug)]
pub struct Geweke<K> {
    seed: u64,
    chains: usize,
    steps: usize,
    kernel: K,
}

/// Geweke's test of `kernel` with 200 chains of 40 steps; see [`Geweke`].
pub fn geweke<K: Transition>(seed: u64, kernel: K) -> Geweke<K> {
    Geweke { seed, chains: 200, steps: 40, kernel }
}

impl<K: Transition> Geweke<K> {
    /// Independent chains, at least 20.
    pub fn chains(mut self, chains: usize) -> Self {
        self.chains = chains;
        self
    }

    /// Transitions of each chain. A fault shows the better the further it has led the chain, up to
    /// some autocorrelation times.
    pub fn steps(mut self, steps: usize) -> Self {
        self.steps = steps;
        self
    }

    /// Runs the test; `update` binds the model to the data of a [`Joint`] and calls
    /// [`Joint::update`]. `start` gives the prior; its data matter only by their shape. Chains run
    /// in parallel; the result does not depend on the number of threads.
    ///
    /// # Errors
    /// [`CheckError`] if the model or the kernel fails, or there are fewer than 20 chains or no
    /// steps.
    pub fn run<M: Model>(
        &self,
        start: &Bound<M>,
        update: impl Fn(&mut Joint<'_, K>) -> Result<(), CheckError> + Sync,
    ) -> Result<GewekeReport, CheckError> {
        for (setting, value, least) in [("chains", self.chains, 20), ("steps", self.steps, 1)] {
            if value < least {
                return Err(CheckError::Setting { setting, value, least });
            }
        }
        let mut stream = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let streams: Vec<Xoshiro256PlusPlus> = (0..self.chains)
            .map(|_| {
                stream.jump();
                stream.clone()
            })
            .collect();
        let parts: Vec<[Vec<Vec<f64>>; 2]> = streams
            .into_par_iter()
            .map(|mut rng| {
                let record = start.draw_prior(&mut rng)?;
                let mut joint =
                    Joint { record, rng, kernel: &self.kernel, moves: false, values: Vec::new() };
                // as many independent pairs as the chain has steps, the last of which starts it
                let mut marginal = Vec::with_capacity(self.steps);
                for _ in 0..self.steps {
                    joint.record = start.draw_prior(&mut joint.rng)?;
                    update(&mut joint)?;
                    marginal.push(numbers(&joint));
                }
                joint.moves = true;
                let mut successive = Vec::with_capacity(self.steps);
                for _ in 0..self.steps {
                    update(&mut joint)?;
                    successive.push(numbers(&joint));
                }
                Ok([marginal, successive])
            })
            .collect::<Result<_, CheckError>>()?;

        let mut rng = stream;
        let mut first = Joint {
            record: start.draw_prior(&mut rng)?,
            rng,
            kernel: &self.kernel,
            moves: false,
            values: Vec::new(),
        };
        update(&mut first)?;
        let names = first.values.iter().map(|(name, _)| name);
        let quantities = names.enumerate().filter_map(|(index, name)| {
            let column = |part: usize| -> Vec<Vec<f64>> {
                let chains = parts.iter().map(|chain| &chain[part]);
                chains.map(|rows| rows.iter().map(|row| row[index]).collect()).collect()
            };
            compare(name, &column(0), &column(1))
        });
        Ok(GewekeReport { quantities: quantities.collect() })
    }
}

fn numbers<K>(joint: &Joint<'_, K>) -> Vec<f64> {
    joint.values.iter().map(|(_, value)| *value).collect()
}

/// Unknowns and data, drawn together.
#[derive(Debug)]
pub struct Joint<'a, K> {
    record: Record,
    rng: Xoshiro256PlusPlus,
    kernel: &'a K,
    /// Whether the unknowns move given the data, or stay as drawn from the prior.
    moves: bool,
    values: Vec<(String, f64)>,
}

impl<K: Transition> Joint<'_, K> {
    /// The current data of this name; empty if the model observes nothing of it.
    pub fn replicate(&self, name: &str) -> Vec<f64> {
        self.record.replicate(name).unwrap_or_default().to_vec()
    }

    /// Takes a transition given the data that `model` is bound to, and draws new data.
    ///
    /// # Errors
    /// [`CheckError`] if the model or the kernel fails.
    pub fn update<M: Model>(&mut self, model: &Bound<M>) -> Result<(), CheckError> {
        let mut y = self.record.unconstrained.clone();
        if self.moves {
            self.kernel.transition(model, &mut y, &mut self.rng)?;
            self.record = model.constrain(&y, &mut self.rng)?;
        }
        let entries = self.record.entries.iter();
        let parameters = entries.filter(|entry| entry.variable.role == Role::Parameter);
        self.values = parameters.flat_map(elements).collect();
        self.values.push(("log likelihood".to_owned(), model.parts(&y)?.ln_likelihood));
        Ok(())
    }
}

/// One number in both samples.
#[derive(Clone, Debug, PartialEq)]
pub struct GewekeQuantity {
    /// Name with indices.
    pub name: String,
    /// Mean rank of the chain less that of prior draws, as a fraction of all.
    pub shift: f64,
    /// p-value of the shift.
    pub shift_p: f64,
    /// The same difference for (2u − 1)²: positive where the chain is too wide.
    pub spread: f64,
    /// p-value of the spread.
    pub spread_p: f64,
}

/// Both samples compared.
#[derive(Clone, Debug, PartialEq)]
pub struct GewekeReport {
    /// One entry a number; constants are left out.
    pub quantities: Vec<GewekeQuantity>,
}

impl GewekeReport {
    /// The smallest p-value over all quantities and both tests, corrected for their number
    /// (Bonferroni): below p with a chance of about p at most if everything is right.
    pub fn p_value(&self) -> f64 {
        let tests = 2.0 * self.quantities.len() as f64;
        let all = self.quantities.iter().flat_map(|q| [q.shift_p, q.spread_p]);
        (tests * all.fold(f64::INFINITY, f64::min)).min(1.0)
    }

    /// Asserts that both samples have the same distribution; fails by chance about with the rate
    /// `false_alarms`, as 1e-4.
    ///
    /// # Panics
    /// With all differences if the p-value is smaller, and if nothing was compared.
    #[track_caller]
    pub fn assert_equal(&self, false_alarms: f64) {
        assert!(!self.quantities.is_empty(), "nothing was compared: the model has no unknowns");
        assert!(self.p_value() >= false_alarms, "the chain left the joint distribution\n{self}");
    }
}

impl fmt::Display for GewekeReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for q in &self.quantities {
            writeln!(
                f,
                "{}: mean rank {:+.4} (p = {:.2e}), spread {:+.4} (p = {:.2e})",
                q.name, q.shift, q.shift_p, q.spread, q.spread_p
            )?;
        }
        write!(f, "p = {:.2e} over all", self.p_value())
    }
}

/// Compares independent draws with chains, each given as `chain × draw`; `None` for a constant.
fn compare(name: &str, marginal: &[Vec<f64>], chains: &[Vec<f64>]) -> Option<GewekeQuantity> {
    let [marginal, chains] = joint_ranks([marginal, chains])?;
    let test = |statistic: fn(f64) -> f64| {
        let independent = marginal.iter().flatten().map(|&u| statistic(u));
        let means = chains
            .iter()
            .map(|chain| chain.iter().map(|&u| statistic(u)).sum::<f64>() / chain.len() as f64);
        welch(independent, means)
    };
    let (shift, shift_p) = test(|u| u);
    let (spread, spread_p) = test(|u| (2.0 * u - 1.0).powi(2));
    Some(GewekeQuantity { name: name.to_owned(), shift, shift_p, spread, spread_p })
}

/// Ranks on (0, 1) among all numbers; ties share their average.
fn joint_ranks(samples: [&[Vec<f64>]; 2]) -> Option<[Vec<Vec<f64>>; 2]> {
    let mut order = Vec::new();
    for (s, sample) in samples.iter().enumerate() {
        for (c, chain) in sample.iter().enumerate() {
            order.extend(chain.iter().enumerate().map(|(t, &x)| (x, s, c, t)));
        }
    }
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
    let total = order.len() as f64;
    let mut ranks = samples.map(|sample| sample.to_vec());
    let mut before = 0.0;
    for ties in order.chunk_by(|a, b| a.0 == b.0) {
        let count = ties.len() as f64;
        if count == total {
            return None;
        }
        for &(_, s, c, t) in ties {
            ranks[s][c][t] = (before + 0.5 * count) / total;
        }
        before += count;
    }
    Some(ranks)
}

/// Difference of two means and its two-sided p-value (Welch 1947, doi:10.1093/biomet/34.1-2.28).
fn welch(
    reference: impl Iterator<Item = f64> + Clone,
    other: impl Iterator<Item = f64> + Clone,
) -> (f64, f64) {
    let of = |values: (usize, (f64, f64))| {
        let (n, (mean, variance)) = values;
        (mean, variance / n as f64, n as f64 - 1.0)
    };
    let (a, va, na) = of((reference.clone().count(), mean_and_variance(reference)));
    let (b, vb, nb) = of((other.clone().count(), mean_and_variance(other)));
    let squared = (b - a).powi(2) / (va + vb);
    let freedom = (va + vb).powi(2) / (va * va / na + vb * vb / nb);
    let (near, far) = (freedom / (freedom + squared), squared / (freedom + squared));
    (b - a, regularised_beta(0.5 * freedom, 0.5, near, far).0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two samples of three: means 2 and 4, variances 1 and 4; t = 2/√(5/3), ν = 50/17. The
    /// p-value is the integral of the t density beyond t, by Simpson's rule.
    #[test]
    fn welch_by_hand() {
        let (difference, p) = welch([1.0, 2.0, 3.0].into_iter(), [2.0, 4.0, 6.0].into_iter());
        approx::assert_relative_eq!(difference, 2.0, max_relative = 1e-15);
        let (t, freedom) = (2.0 / (5.0f64 / 3.0).sqrt(), 50.0 / 17.0);
        let density = |x: f64| (1.0 + x * x / freedom).powf(-0.5 * (freedom + 1.0));
        // over all x, and over |x| < t; x = tan maps the tails to a finite interval
        let integral = |end: f64| {
            let cells = 20_000;
            let step = end / f64::from(cells);
            let at = |k: i32| {
                let angle = step * f64::from(k);
                density(angle.tan()) / angle.cos().powi(2)
            };
            let inner: f64 = (1..cells).map(|k| at(k) * f64::from(2 + 2 * (k % 2))).sum();
            (at(0) + at(cells) + inner) * step / 3.0
        };
        let whole = integral(std::f64::consts::FRAC_PI_2 - 1e-9);
        approx::assert_relative_eq!(p, 1.0 - integral(t.atan()) / whole, max_relative = 1e-6);
    }

    #[test]
    fn ranks_are_shared_by_ties() {
        let (one, two) = (vec![vec![1.0, 2.0]], vec![vec![2.0, 5.0]]);
        let ranks = joint_ranks([&one, &two]).expect("no constant");
        assert_eq!(ranks, [vec![vec![0.125, 0.5]], vec![vec![0.5, 0.875]]]);
        assert_eq!(joint_ranks([&[vec![1.0]], &[vec![1.0]]]), None);
    }
}
