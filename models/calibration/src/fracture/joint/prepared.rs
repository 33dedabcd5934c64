//! Tests of one material, prepared for their joint likelihood.

use std::collections::BTreeMap;

use ppl::prelude::*;
use surrogate::{DynPce, Input};

use super::correlation;
use crate::fracture::within_box::deviated;
use crate::fracture::{
    CalibrationError, Evidence, Specimens, relative_to_means, short_name, unknown_inputs,
};
use crate::prior::Prior;

/// Concentration of the LKJ prior of the correlations between the quantities of a test.
const ETA: f64 = 3.0;

/// One test of a material: its forward model and its specimens.
#[derive(Clone, Debug)]
pub struct JointTest {
    /// Name of the test.
    pub name: String,
    /// Surrogate of the test, whose first inputs are the parameters.
    pub forward: DynPce,
    /// Priors of the parameters, in the order of the surrogate's inputs. Their ranges are the surrogate's box.
    pub priors: Vec<Prior>,
    /// Names of the parameters whose value in this test is independent of the other tests.
    pub own: Vec<String>,
    /// Experimental data of the specimens, and errors of the forward model.
    pub evidence: Evidence,
}

/// Relation between the values of one parameter in the tests.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum BetweenTests {
    /// All tests have the same value.
    #[default]
    Shared,
    /// Each test has its own value, independent of the other tests.
    Own,
    /// The logarithm of the value varies between the tests about a common centre. The standard deviation of the
    /// logarithm has a half-normal prior with this scale.
    Varies {
        /// Scale of the half-normal prior; 0.05 corresponds to a variation of about 5 %.
        scale: f64,
    },
}

/// Tests prepared for their joint likelihood, and the parameters of the joint model.
#[derive(Clone, Debug)]
pub struct JointTests {
    /// Names of the parameters of the joint model: the name of the surrogate's input, followed by the name of the test
    /// in parentheses for a parameter of one test.
    pub(super) names: Vec<String>,
    /// Priors of the parameters.
    pub(super) priors: Vec<Prior>,
    /// Indices of the parameters that vary between tests, and the scales of their variation.
    pub(super) varying: Vec<(usize, f64)>,
    pub(super) tests: Vec<PreparedTest>,
}

/// A test prepared for the likelihood, with quantities relative to the means of its specimens.
#[derive(Clone, Debug)]
pub(super) struct PreparedTest {
    pub(super) name: String,
    pub(super) inputs: Vec<Input>,
    /// For each input of the surrogate, the index of its parameter in the joint model.
    pub(super) parameters: Vec<usize>,
    /// Index of each varying parameter among the inputs of the surrogate, in the order of
    /// [`JointTests::varying`].
    varying: Vec<usize>,
    pub(super) forward: DynPce,
    pub(super) specimens: Specimens,
    /// Names of the quantities.
    pub(super) quantities: Vec<String>,
    /// Shapes of the beta distributions of the partial correlations.
    pub(super) shapes: Vec<f64>,
}

impl JointTests {
    /// Checks that the tests are consistent, and prepares them. `between` gives the relation between the tests for
    /// parameters by name; all other parameters are shared.
    ///
    /// # Errors
    /// - There is no test, or two tests have the same name.
    /// - A test has fewer than two specimens, or a row or covariance of the wrong size.
    /// - The ranges of the priors of a test are not the box of its surrogate.
    /// - Two tests have different priors of a shared parameter.
    /// - A varying parameter has no positive lower bound, is missing in a test, or is listed in
    ///   `own` of a test.
    /// - A name in `between` or `own` is not the name of a parameter.
    pub fn new(
        tests: &[JointTest],
        between: &BTreeMap<String, BetweenTests>,
    ) -> Result<Self, CalibrationError> {
        let refuse = |name: &str, problem: String| {
            Err(CalibrationError::Group { group: name.to_owned(), problem })
        };
        if tests.is_empty() {
            return Err(CalibrationError::TooFew(0));
        }
        let mut joint =
            Self { names: Vec::new(), priors: Vec::new(), varying: Vec::new(), tests: Vec::new() };
        for test in tests {
            if joint.tests.iter().any(|other| other.name == test.name) {
                return refuse(&test.name, "is the name of two tests".to_owned());
            }
            if test.evidence.qois.len() < 2 {
                let count = test.evidence.qois.len();
                let problem =
                    format!("has {count} specimen: the scatter of a test needs at least two");
                return refuse(&test.name, problem);
            }
            let known = test.evidence.known_inputs();
            let inputs = unknown_inputs(&test.forward, &test.priors, known)?.to_vec();
            if let Some(own) = test.own.iter().find(|own| inputs.iter().all(|i| i.name != **own)) {
                return refuse(
                    &test.name,
                    format!(
                        "has no parameter {own}, which is listed as a parameter of this test only"
                    ),
                );
            }
            let parameters = inputs
                .iter()
                .zip(&test.priors)
                .map(|(input, prior)| joint.parameter(test, input, prior, between))
                .collect::<Result<_, _>>()?;
            let (forward, specimens) = relative_to_means(&test.forward, &test.evidence)?;
            joint.tests.push(PreparedTest {
                name: test.name.clone(),
                parameters,
                inputs,
                varying: Vec::new(),
                quantities: forward.outputs().iter().map(|name| short_name(name)).collect(),
                shapes: correlation::shapes(forward.outputs().len(), ETA),
                forward,
                specimens,
            });
        }
        for (name, relation) in between {
            let all = || joint.tests.iter().flat_map(|test| &test.inputs);
            let Some(input) = all().find(|input| input.name == *name) else {
                return refuse(name, "is not a parameter of the tests".to_owned());
            };
            let BetweenTests::Varies { scale } = *relation else { continue };
            if !(scale > 0.0 && scale.is_finite()) {
                return refuse(
                    name,
                    format!(
                        "has the scale {scale} of its variation between tests, which must be finite and above 0"
                    ),
                );
            }
            if input.lower <= 0.0 {
                let problem = format!("has no logarithm at its lower bound {}", input.lower);
                return refuse(name, problem);
            }
            let Some(index) = joint.names.iter().position(|own| own == name) else {
                let problem = "varies about a common centre, but every test has a separate parameter of this name";
                return refuse(name, problem.to_owned());
            };
            joint.varying.push((index, scale));
        }
        for test in &mut joint.tests {
            for &(index, _) in &joint.varying {
                let Some(place) = test.parameters.iter().position(|&own| own == index) else {
                    let problem = format!(
                        "does not have the parameter {}, which varies between tests",
                        joint.names[index]
                    );
                    return refuse(&test.name, problem);
                };
                test.varying.push(place);
            }
        }
        Ok(joint)
    }

    /// Returns the index of the parameter of a test's input, and adds the parameter if it is new.
    fn parameter(
        &mut self,
        test: &JointTest,
        input: &Input,
        prior: &Prior,
        between: &BTreeMap<String, BetweenTests>,
    ) -> Result<usize, CalibrationError> {
        let is_own = test.own.contains(&input.name)
            || between.get(&input.name).is_some_and(|relation| *relation == BetweenTests::Own);
        let name = match is_own {
            true => format!("{} ({})", input.name, test.name),
            false => input.name.clone(),
        };
        if let Some(index) = self.names.iter().position(|other| *other == name) {
            return match self.priors[index] == *prior {
                true => Ok(index),
                false => Err(CalibrationError::Group {
                    group: test.name.clone(),
                    problem: format!(
                        "has another prior of {name} than the tests before it, but the tests share this parameter"
                    ),
                }),
            };
        }
        self.names.push(name);
        self.priors.push(*prior);
        Ok(self.names.len() - 1)
    }

    /// Names of the parameters that vary between tests.
    pub(super) fn varying_names(&self) -> Vec<String> {
        self.varying.iter().map(|&(index, _)| self.names[index].clone()).collect()
    }

    /// Names of the values of varying parameters in the tests, test by test.
    pub(super) fn names_in_tests(&self) -> Vec<String> {
        let names = self.varying_names();
        let of = |test: &PreparedTest| -> Vec<String> {
            names.iter().map(|name| format!("{name} ({})", test.name)).collect()
        };
        self.tests.iter().flat_map(of).collect()
    }

    /// Names of the quantities of all tests, test by test.
    pub(super) fn quantity_names(&self) -> Vec<String> {
        let of = |test: &PreparedTest| -> Vec<String> {
            test.quantities.iter().map(|name| format!("{name} ({})", test.name)).collect()
        };
        self.tests.iter().flat_map(of).collect()
    }

    /// Names of the pairs of quantities of each test, in the order of the entries below the diagonal.
    pub(super) fn pair_names(&self) -> Vec<String> {
        let mut names = Vec::new();
        for test in &self.tests {
            for (row, first) in test.quantities.iter().enumerate() {
                let others = &test.quantities[..row];
                names.extend(others.iter().map(|other| format!("{first} {other} ({})", test.name)));
            }
        }
        names
    }
}

impl PreparedTest {
    /// Returns the values of the surrogate's inputs from the parameters of the joint model and the deviations of
    /// the varying parameters in this test.
    pub(super) fn point<R: Scalar>(&self, parameters: &[R], deviations: &[R]) -> Vec<R> {
        let mut point: Vec<R> = self.parameters.iter().map(|&index| parameters[index]).collect();
        for (&place, &deviation) in self.varying.iter().zip(deviations) {
            let Input { lower, upper, .. } = self.inputs[place];
            point[place] = deviated(point[place].ln(), deviation, [lower, upper]);
        }
        point
    }

    /// Returns the values of the varying parameters in this test, from the values of all inputs.
    pub(super) fn varying_values<R: Scalar>(&self, point: &[R]) -> Vec<R> {
        self.varying.iter().map(|&place| point[place]).collect()
    }
}
