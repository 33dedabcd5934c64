//! Joint calibration of several tests of one material. Each test has its own forward model, specimens and errors.
//!
//! 1. `correlation`: correlation matrices of different sizes in one model
//! 2. `prepared`: the tests, and the parameters of the joint model
//! 3. `model`: the joint model
//! 4. `draws`: draws of the joint posterior for each test
//! 5. `new_test`: draws for a test that was not calibrated

mod correlation;
mod draws;
mod model;
mod new_test;
mod prepared;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use ppl::{Map, Mode, Nuts, Posterior, PowerScalingError, SampleError};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::sensitivity::{PriorSensitivity, sensitivities};
use super::{CalibrationError, leave_out};
use crate::bridge::{BridgeError, MarginalLikelihood, marginal_likelihood};
use crate::prior::Prior;
pub use draws::{TestDraws, calibration_of_draws};
pub use model::calibration_over_tests;
use prepared::PreparedTest;
pub use prepared::{BetweenTests, JointTest, JointTests, TrendOverTests};

/// Posterior and mode of a joint calibration.
#[derive(Clone, Debug)]
pub struct JointCalibration {
    /// Draws of all unknowns. The parameters are `theta`, labelled by their names.
    pub posterior: Posterior,
    /// Names of the parameters: the name of the surrogate's input, followed by the name of the test in parentheses for
    /// a parameter of one test.
    pub names: Vec<String>,
    /// Priors of the parameters, in the order of `names`.
    pub priors: Vec<Prior>,
    /// Joint mode of the parameters over the constrained values (no Jacobian), in the order of `names`.
    pub map: Vec<f64>,
    /// Result of the search for the mode.
    pub mode: Mode,
    /// The same draws in the parameters of each test, in the order of the tests.
    pub tests: Vec<TestDraws>,
    /// For each test and each of its surrogate's inputs: the indices of the parameters on which the input depends, and its
    /// derivatives with respect to these parameters at the posterior mean.
    pub dependences: Vec<Vec<Vec<(usize, f64)>>>,
    /// For each test and each of its surrogate's inputs: the mean squared deviation of the value in the test from the
    /// common centre or the trend; 0 if the value does not vary between tests.
    pub variances_between: Vec<Vec<f64>>,
    /// The joint model.
    model: JointTests,
}

/// Calibrates the parameters of several tests together. `between` gives the relation between the tests for parameters by
/// name; all other parameters are shared. The first `burn_in` draws of each chain are omitted; `sampler` must draw them in
/// addition. `seed` is the seed of the starting points for the search for the mode.
///
/// # Errors
/// The errors of [`JointTests::new`], and an error if the surrogates reject every starting point.
///
/// # Example
/// ```no_run
/// use std::collections::BTreeMap;
/// use breccia_calibration::{BetweenTests, JointTest, calibrate_tests};
/// use ppl::Nuts;
///
/// # fn all(fast: JointTest, slow: JointTest) -> Result<(), breccia_calibration::CalibrationError> {
/// // E varies by some 5 % between the tests; all other parameters are the same
/// let varies = BetweenTests::Varies { scale: 0.05 };
/// let between = BTreeMap::from([("matrix.young_mpa".to_owned(), varies)]);
/// let result = calibrate_tests(&[fast, slow], &between, &Nuts::default().seed(7), 0, 7)?;
/// println!("{}", result.posterior.summary());
/// # Ok(()) }
/// ```
pub fn calibrate_tests(
    tests: &[JointTest],
    between: &BTreeMap<String, BetweenTests>,
    sampler: &Nuts<'_>,
    burn_in: usize,
    seed: u64,
) -> Result<JointCalibration, CalibrationError> {
    let prepared = JointTests::new(tests, between)?;
    let model = calibration_over_tests(&prepared);
    let mut chains = sampler.run(&model).map_err(SampleError::from)?;
    leave_out(&mut chains, burn_in);
    let mut posterior = Posterior::from_chains(&model, chains, seed)?;
    label(&mut posterior, &prepared)?;
    let mode = Map::default().seed(seed).find(&model)?;
    let record = model.constrain(&mode.point, &mut Xoshiro256PlusPlus::seed_from_u64(seed))?;
    let map = record.values("theta").map_or_else(Vec::new, <[f64]>::to_vec);
    let draws = TestDraws::of_each(&prepared, &posterior.posterior, &record)?;
    drop(model);
    let theta = posterior.posterior.get("theta").map_or(&[][..], |values| &values.data);
    let rows: Vec<&[f64]> = theta.chunks(prepared.names.len()).collect();
    let mean = |i: usize| rows.iter().map(|row| row[i]).sum::<f64>() / rows.len() as f64;
    let mean: Vec<f64> = (0..prepared.names.len()).map(mean).collect();
    let variances = |(test, draws): (&PreparedTest, &TestDraws)| draws.variances_about(test, &rows);
    let variances_between = prepared.tests.iter().zip(&draws).map(variances).collect();
    Ok(JointCalibration {
        posterior,
        map,
        mode,
        dependences: prepared.tests.iter().map(|test| test.dependences(&mean)).collect(),
        variances_between,
        tests: draws,
        names: prepared.names.clone(),
        priors: prepared.priors.clone(),
        model: prepared,
    })
}

impl JointCalibration {
    /// Computes the sensitivity of each parameter to the priors of the parameters (of varying parameters also to the prior of
    /// their spread), to the priors of the scatter, and to the data of all tests.
    ///
    /// # Errors
    /// If a log density is not finite at a draw.
    pub fn prior_sensitivity(&self) -> Result<Vec<PriorSensitivity>, PowerScalingError> {
        let group = &self.posterior.posterior;
        let mut ln_likelihood = vec![0.0; group.chains * group.draws];
        for (test, draws) in self.model.tests.iter().zip(&self.tests) {
            let own = draws.ln_likelihoods(test);
            ln_likelihood.iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
        }
        let (of_parameters, of_scatter) = (["theta", "spread"], ["sd", "partial"]);
        sensitivities(&self.posterior, &self.names, ln_likelihood, &of_parameters, &of_scatter)
    }

    /// Estimates the marginal likelihood of the quantities of all tests, relative to the means of the specimens of each test,
    /// from the draws. `seed` is the seed of the auxiliary draws.
    ///
    /// # Errors
    /// The errors of [`marginal_likelihood`].
    pub fn marginal_likelihood(&self, seed: u64) -> Result<MarginalLikelihood, BridgeError> {
        let model = calibration_over_tests(&self.model);
        marginal_likelihood(&model, &self.posterior.chains, seed)
    }
}

/// Replaces indices by the names of parameters, quantities and tests.
fn label(posterior: &mut Posterior, tests: &JointTests) -> Result<(), CalibrationError> {
    let mut label = |name: &str, labels: &[String]| {
        let labels: Vec<&str> = labels.iter().map(String::as_str).collect();
        match labels.is_empty() {
            true => Ok(()),
            false => posterior.label(name, 0, &labels),
        }
    };
    label("theta", &tests.names)?;
    label("spread", &tests.varying_names())?;
    label("in_test", &tests.names_in_tests())?;
    label("sd", &tests.quantity_names())?;
    label("correlation", &tests.pair_names())?;
    Ok(())
}
