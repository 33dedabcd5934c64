//! Synthetic laboratories that choose their next tests by the computation of the stage `next-test`.

use ppl::Posterior;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use super::emulated::{Emulated, EmulatedTest};
use super::joint::EmulatedTests;
use super::study::{CoverageStudy, Setting, theta};
use crate::fracture::{CalibrationError, JointTest, column_means, relative_covariance};
use crate::further_test::{AlikeTest, Belief, Expected, FurtherTest, TestAtDraw};
use crate::prior::Prior;

/// Number of posterior draws in expectations, as in the stage.
const DRAWS: usize = 400;

/// Laboratories that make a first test and then choose further tests, until the posterior is narrow enough.
#[derive(Clone, Debug)]
pub struct NextTests {
    /// Candidates. The first of them is the test that every laboratory makes first.
    pub candidates: EmulatedTests,
    /// For each parameter, the largest accepted ratio of the posterior's standard deviation to its mean.
    pub goals: Vec<f64>,
    /// Largest number of further tests.
    pub most_tests: usize,
    /// Numbers of specimens that a further test can have, each at least 2.
    pub specimens: Vec<usize>,
}

/// The tests of one laboratory.
#[derive(Clone, Debug, PartialEq)]
pub struct TestProgramme {
    /// True parameters.
    pub truth: Vec<f64>,
    /// The first test, and the chosen tests in their order.
    pub steps: Vec<ProgrammeStep>,
    /// Whether the last posterior meets all goals.
    pub is_successful: bool,
}

/// One test of a laboratory, and the posterior of all tests up to this test.
#[derive(Clone, Debug, PartialEq)]
pub struct ProgrammeStep {
    /// Name of the candidate.
    pub test: String,
    /// Number of specimens of this test.
    pub specimens: usize,
    /// Ratio of standard deviation to mean that was expected before the test, for each parameter; empty for the first
    /// test.
    pub expected: Vec<f64>,
    /// Ratio of the posterior's standard deviation to its mean, for each parameter.
    pub relative_sd: Vec<f64>,
}

/// A draw of the posterior: parameters, and covariance between the specimens of the first test.
struct Draw {
    theta: Vec<f64>,
    scatter: Vec<Vec<f64>>,
}

/// A possible next test, in the order of preference.
struct Choice {
    candidate: usize,
    specimens: usize,
    /// Sum over the parameters of the logarithm by which the expected standard deviation exceeds its goal.
    excess: f64,
    expected: Vec<f64>,
}

impl NextTests {
    /// Simulates laboratories on all threads. The result depends only on the seed of the study. `on_finished` is called
    /// with the number of each finished laboratory.
    ///
    /// # Errors
    /// The first error of an ensemble or of a calibration.
    pub fn run(
        &self,
        study: &CoverageStudy,
        laboratories: usize,
        on_finished: impl Fn(usize) + Sync,
    ) -> Result<Vec<TestProgramme>, CalibrationError> {
        let programme = |k| {
            let programme = self.programme(study, k)?;
            on_finished(k);
            Ok(programme)
        };
        (0..laboratories).into_par_iter().map(programme).collect()
    }

    /// Simulates laboratory `k`. Each candidate has one ensemble: more specimens of a test share its errors.
    fn programme(
        &self,
        study: &CoverageStudy,
        k: usize,
    ) -> Result<TestProgramme, CalibrationError> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(study.seed.wrapping_add(k as u64));
        let candidates = self.candidates.tests();
        let (first_name, first) = &candidates[0];
        let truth = first.truth(&mut rng);
        let mut tests: Vec<EmulatedTest> = Vec::new();
        for (index, (_, candidate)) in candidates.iter().enumerate() {
            let specimens = if index == 0 { candidate.specimens } else { 0 };
            tests.push(candidate.test(truth.clone(), specimens, &mut rng)?);
        }
        let (mut test, mut specimens) = (first_name.clone(), first.specimens);
        let mut expected = Vec::new();
        let mut steps = Vec::new();
        loop {
            let made = |(name, test): (&(String, Emulated), &EmulatedTest)| {
                let is_made = !test.laboratory.specimens.is_empty();
                is_made.then(|| test.per_run.joint_test(&name.0, &test.laboratory))
            };
            let joint: Vec<JointTest> = candidates.iter().zip(&tests).filter_map(made).collect();
            let posterior = study.joint_posterior(&joint, k)?;
            let draws = draws(&posterior, truth.len(), first.packings.len());
            let relative_sd = relative_sd(&draws);
            let is_successful = self.excess(&relative_sd) == 0.0;
            steps.push(ProgrammeStep { test, specimens, expected, relative_sd });
            if is_successful || steps.len() > self.most_tests {
                return Ok(TestProgramme { truth, steps, is_successful });
            }
            let choice = self.choice(&tests, &draws)?;
            let (name, chosen) = &candidates[choice.candidate];
            let (more, _) = chosen.specimens(&truth, choice.specimens, &mut rng)?;
            tests[choice.candidate].laboratory.specimens.extend(more);
            (test, specimens, expected) = (name.clone(), choice.specimens, choice.expected);
        }
    }

    /// Sum over the parameters of the logarithm by which the standard deviation exceeds its goal; 0 if all goals are met.
    fn excess(&self, relative_sd: &[f64]) -> f64 {
        let excess = |(sd, goal): (&f64, &f64)| (sd / goal).ln().max(0.0);
        relative_sd.iter().zip(&self.goals).map(excess).sum()
    }

    /// Chooses the candidate and the number of specimens with the smallest excess; of several choices that are expected to
    /// meet all goals, the choice with the fewest specimens.
    fn choice(&self, tests: &[EmulatedTest], draws: &[Draw]) -> Result<Choice, CalibrationError> {
        let refused = |candidate: usize, problem: String| CalibrationError::Group {
            group: self.candidates.tests()[candidate].0.clone(),
            problem,
        };
        let rows: Vec<Vec<f64>> = draws.iter().map(|draw| draw.theta.clone()).collect();
        let priors = Prior::uniform_on(tests[0].per_run.forward.inputs());
        let belief =
            Belief::of_draws(&priors, &rows).map_err(|error| refused(0, error.to_string()))?;
        let means = column_means(&rows);
        let some: Vec<&Draw> = draws.iter().step_by((draws.len() / DRAWS).max(1)).collect();
        let mut best: Option<Choice> = None;
        for candidate in 0..tests.len() {
            let test = further_test(tests, candidate, &means, &some)?;
            for &specimens in &self.specimens {
                let expected = test
                    .expected(&belief, specimens)
                    .map_err(|error| refused(candidate, error.to_string()))?;
                let relative_sd = |((prior, mean), expected): ((&Prior, &f64), &Expected)| {
                    prior.sd() * (1.0 - expected.contraction).sqrt() / mean
                };
                let expected: Vec<f64> =
                    priors.iter().zip(&means).zip(&expected).map(relative_sd).collect();
                let excess = self.excess(&expected);
                let is_better = |best: &Choice| (excess, specimens) < (best.excess, best.specimens);
                if best.as_ref().is_none_or(is_better) {
                    best = Some(Choice { candidate, specimens, excess, expected });
                }
            }
        }
        best.ok_or_else(|| refused(0, "has no number of specimens to choose from".to_owned()))
    }
}

/// Returns the further test of a candidate, as in the stage: more specimens of a test share its error; another test can
/// share the error of the first test.
fn further_test(
    tests: &[EmulatedTest],
    candidate: usize,
    means: &[f64],
    draws: &[&Draw],
) -> Result<FurtherTest, CalibrationError> {
    let EmulatedTest { per_run, laboratory, .. } = &tests[candidate];
    let recorded = |specimens: &[Vec<f64>]| -> Vec<Vec<usize>> {
        specimens.iter().map(|row| (0..row.len()).collect()).collect()
    };
    let first = &tests[0];
    let is_new = laboratory.specimens.is_empty();
    let has_quantities_of_first = per_run.forward.outputs() == first.per_run.forward.outputs();
    let alike = match is_new && has_quantities_of_first {
        true => Some(AlikeTest {
            draws: linearised(&first.per_run, draws)?,
            shared: shared(&first.per_run, means)?,
            seen: recorded(&first.laboratory.specimens),
            quantities: (0..first.per_run.forward.outputs().len()).collect(),
        }),
        false => None,
    };
    Ok(FurtherTest {
        draws: linearised(per_run, draws)?,
        shared: shared(per_run, means)?,
        seen: recorded(&laboratory.specimens),
        alike,
    })
}

/// Covariance of the errors that all specimens of a test share, relative to the quantities, averaged over the box.
fn shared(setting: &Setting, means: &[f64]) -> Result<Vec<Vec<f64>>, CalibrationError> {
    let quantities = setting.forward.value(means)?;
    let size = quantities.len();
    let mut all = vec![vec![0.0; size]; size];
    let of_surrogate = match &setting.error {
        Some(error) => relative_covariance(error.mean_error(&quantities)?, &quantities),
        None => Vec::new(),
    };
    for part in [&of_surrogate, &setting.shared] {
        for (row, part) in all.iter_mut().zip(part) {
            row.iter_mut().zip(part).for_each(|(entry, part)| *entry += part);
        }
    }
    Ok(all)
}

/// Linearises a test at draws: derivatives relative to the quantities at the draw.
fn linearised(setting: &Setting, draws: &[&Draw]) -> Result<Vec<TestAtDraw>, CalibrationError> {
    let at = |draw: &&Draw| {
        let (values, jacobian) = setting.forward.value_and_jacobian(&draw.theta)?;
        let row = |(row, value): (Vec<f64>, &f64)| row.iter().map(|slope| slope / value).collect();
        let jacobian = jacobian.into_iter().zip(&values).map(row).collect();
        Ok(TestAtDraw { jacobian, scatter: draw.scatter.clone() })
    };
    draws.iter().map(at).collect()
}

/// Draws of a joint posterior. The scatter is the covariance of the `quantities` of the first test.
fn draws(posterior: &Posterior, parameters: usize, quantities: usize) -> Vec<Draw> {
    let group = &posterior.posterior;
    let count = group.chains * group.draws;
    let row = |name: &str, draw: usize| {
        let data = group.get(name).map_or(&[][..], |values| &values.data);
        let size = data.len() / count.max(1);
        &data[draw * size..(draw + 1) * size]
    };
    let scatter = |draw: usize| {
        let (sd, correlations) = (row("sd", draw), row("correlation", draw));
        let entry = |a: usize, b: usize| {
            let (high, low) = (a.max(b), a.min(b));
            // correlations below the diagonal, row by row
            let correlation = if a == b { 1.0 } else { correlations[high * (high - 1) / 2 + low] };
            sd[a] * sd[b] * correlation
        };
        (0..quantities).map(|a| (0..quantities).map(|b| entry(a, b)).collect()).collect()
    };
    let rows = theta(posterior).chunks(parameters).enumerate();
    rows.map(|(draw, theta)| Draw { theta: theta.to_vec(), scatter: scatter(draw) }).collect()
}

/// Ratio of standard deviation to mean of each parameter.
fn relative_sd(draws: &[Draw]) -> Vec<f64> {
    let rows: Vec<Vec<f64>> = draws.iter().map(|draw| draw.theta.clone()).collect();
    let means = column_means(&rows);
    let sd = |(i, mean): (usize, &f64)| {
        let squares: f64 = rows.iter().map(|row| (row[i] - mean).powi(2)).sum();
        (squares / (rows.len() as f64 - 1.0)).sqrt() / mean
    };
    means.iter().enumerate().map(sd).collect()
}

#[cfg(test)]
mod tests {
    use super::super::closed_form::{study, world};
    use super::*;

    fn with_goals(goals: [f64; 3]) -> NextTests {
        // many runs, so that the errors of surrogates are small
        let candidates = world(8, 120);
        NextTests { candidates, goals: goals.into(), most_tests: 3, specimens: vec![4, 16] }
    }

    /// The fast test alone says nothing about Gc: the first chosen test is the slow one. The reached standard deviations
    /// of Gc exceed the expected ones by a factor of e^0.5 = 1.7 on average: the expectation does not include that the
    /// scatter between a few specimens is uncertain, and is linear in a parameter whose posterior fills its box.
    #[test]
    fn the_slow_test_is_chosen_and_reaches_a_little_less_than_is_expected() {
        let programmes = with_goals([0.02, 0.08, 0.08]).run(&study(), 4, |_| ()).unwrap();
        let mut ratios = Vec::new();
        for TestProgramme { steps, is_successful, .. } in &programmes {
            let [first, second, ..] = &steps[..] else { panic!("{steps:?}") };
            assert_eq!((&*first.test, first.specimens), ("fast", 8));
            assert!(first.relative_sd[1] > 0.2, "{first:?}");
            assert_eq!(second.test, "slow");
            assert!(is_successful == &(steps.last().unwrap().relative_sd[1] <= 0.08), "{steps:?}");
            ratios.push((second.relative_sd[1] / second.expected[1]).ln());
        }
        let successes = programmes.iter().filter(|programme| programme.is_successful).count();
        assert!(successes >= 3, "{programmes:?}");
        let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
        assert!((0.0..1.0).contains(&mean), "{ratios:?}");
    }

    /// Goals that no candidate can reach use all tests; goals that the first test meets need no further test.
    #[test]
    fn programmes_end_at_success_or_after_the_last_test() {
        let never = with_goals([1e-4, 1e-4, 1e-4]).run(&study(), 1, |_| ()).unwrap().remove(0);
        assert!(!never.is_successful && never.steps.len() == 4, "{never:?}");
        assert!(never.steps[1..].iter().all(|step| step.specimens == 16), "{never:?}");
        let once = with_goals([0.5, 0.9, 0.9]).run(&study(), 1, |_| ()).unwrap().remove(0);
        assert!(once.is_successful && once.steps.len() == 1, "{once:?}");
    }
}
