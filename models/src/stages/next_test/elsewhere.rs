//! Parameters of a further test whose values differ from the values in the calibrated test, if several tests were
//! calibrated: a varying parameter has a new value about its centre, and a trend has another value at another
//! temperature or rate.
//!
//! The belief then has the parameters of the calibrated test, followed by the values of the differing parameters in the
//! further test. The further test measures the differing parameters. It informs about the parameters of the calibrated
//! test by the covariance of both in the joint posterior.

use crate::forward::posterior_draws::Draw;
use crate::further_test::{Belief, FurtherTestError, TestAtDraw};
use crate::pipeline::inputs::Inputs;
use crate::prior::Prior;
use crate::results_folder::error::WorkflowError;

/// Smallest relative difference of a value that counts as a difference.
const DIFFERENT: f64 = 1e-9;

/// Values of the parameters in a further test.
pub(super) struct Elsewhere {
    /// Values of all parameters in the further test, one row per draw of the present posterior.
    theta: Vec<Vec<f64>>,
    /// Indices of the parameters with other values than in the calibrated test.
    differing: Vec<usize>,
}

impl Elsewhere {
    /// Reads the values of the candidate with this number, counted from 1; `None` if a single test was calibrated, or no
    /// parameter differs.
    ///
    /// # Errors
    /// If the joint calibration has not written the values.
    pub(super) fn read(
        inputs: &Inputs<'_>,
        number: usize,
        present: &[Draw],
    ) -> Result<Option<Self>, WorkflowError> {
        let Some(joint) = &inputs.calibration().joint else { return Ok(None) };
        let test = joint.file_stem().unwrap_or_default().to_string_lossy();
        let name = joint.with_file_name("candidate").join(format!("{test}-{number}.json"));
        let name = name.to_string_lossy();
        if inputs.file_if_there(&name).is_none() {
            let path = inputs.folder().join(&*name);
            return Err(WorkflowError::Missing { path, stage: "calibrate" });
        }
        Ok(Self::of(inputs.json(&name)?, present))
    }

    fn of(theta: Vec<Vec<f64>>, present: &[Draw]) -> Option<Self> {
        let parameters = theta.first().map_or(0, Vec::len);
        let differs = |i: &usize| {
            let pairs = theta.iter().zip(present);
            pairs.into_iter().any(|(row, draw)| {
                (row[*i] - draw.theta[*i]).abs() > DIFFERENT * draw.theta[*i].abs()
            })
        };
        let differing: Vec<usize> = (0..parameters).filter(differs).collect();
        (!differing.is_empty()).then_some(Self { theta, differing })
    }

    /// Returns the draws of the present posterior with the values in the further test.
    pub(super) fn draws(&self, present: &[Draw]) -> Vec<Draw> {
        let draw =
            |(theta, draw): (&Vec<f64>, &Draw)| Draw { theta: theta.clone(), ..draw.clone() };
        self.theta.iter().zip(present).map(draw).collect()
    }

    /// Computes the belief about the parameters of the calibrated test, followed by the differing parameters in the further
    /// test.
    ///
    /// # Errors
    /// The errors of [`Belief::of_draws`].
    pub(super) fn belief(
        &self,
        priors: &[Prior],
        present: &[Draw],
    ) -> Result<Belief, FurtherTestError> {
        let priors: Vec<Prior> =
            priors.iter().chain(self.differing.iter().map(|&i| &priors[i])).copied().collect();
        let row = |(draw, other): (&Draw, &Vec<f64>)| {
            let differing = self.differing.iter().map(|&i| other[i]);
            draw.theta.iter().copied().chain(differing).collect()
        };
        let rows: Vec<Vec<f64>> = present.iter().zip(&self.theta).map(row).collect();
        Belief::of_draws(&priors, &rows)
    }

    /// Moves the derivatives with respect to the differing parameters behind the derivatives with respect to the
    /// parameters of the calibrated test, which become zero.
    pub(super) fn moved(&self, draws: Vec<TestAtDraw>) -> Vec<TestAtDraw> {
        let row = |mut row: Vec<f64>| {
            let differing: Vec<f64> =
                self.differing.iter().map(|&i| std::mem::take(&mut row[i])).collect();
            [row, differing].concat()
        };
        let draw = |draw: TestAtDraw| {
            let jacobian = draw.jacobian.into_iter().map(row).collect();
            TestAtDraw { jacobian, ..draw }
        };
        draws.into_iter().map(draw).collect()
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;
    use crate::further_test::FurtherTest;

    /// Two parameters, of which the second has another value in the further test. Each of its two values is the sum of
    /// a common number and an independent number, all normal with variance 1. The further test measures the sum of both
    /// parameters. The conditional variance of the second parameter equals the conditional variance in the joint normal
    /// distribution.
    #[test]
    fn a_value_in_another_test_informs_by_its_correlation() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        let (mut present, mut theta) = (Vec::new(), Vec::new());
        for _ in 0..200_000 {
            let [a, centre, here, there] = [normal(), normal(), normal(), normal()];
            present.push(Draw { theta: vec![a, centre + here], scatter: vec![vec![0.5]] });
            theta.push(vec![a, centre + there]);
        }
        let elsewhere = Elsewhere::of(theta, &present).unwrap();
        assert_eq!(elsewhere.differing, [1]);
        let sd = 3.0;
        let half = sd * 3.0_f64.sqrt();
        let priors = [Prior::uniform(-half, half); 2];
        let belief = elsewhere.belief(&priors, &present).unwrap();
        let draws = vec![TestAtDraw { jacobian: vec![vec![1.0, 1.0]], scatter: vec![vec![0.5]] }];
        let draws = elsewhere.moved(draws);
        assert_eq!(draws[0].jacobian, [[1.0, 0.0, 1.0]]);
        let test = FurtherTest { draws, shared: vec![vec![0.0]], seen: Vec::new(), alike: None };
        // the measured value has the variance 1 + 2 + 0.5/n, and the covariances 1 with both parameters
        for n in [1, 4, 1000] {
            let gain = 1.0 / (3.0 + 0.5 / n as f64);
            let expected = test.expected(&belief, n).unwrap();
            for (found, before) in expected.iter().zip([1.0, 2.0]) {
                let exact = 1.0 - (before - gain) / (sd * sd);
                assert!((found.contraction - exact).abs() < 3e-3, "{n}: {found:?} {exact}");
            }
        }
    }

    #[test]
    fn equal_values_need_no_further_parameter() {
        let present = [Draw { theta: vec![1.0, 2.0], scatter: Vec::new() }];
        assert!(Elsewhere::of(vec![vec![1.0, 2.0 + 1e-12]], &present).is_none());
    }
}
