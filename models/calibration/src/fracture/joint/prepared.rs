//! Tests of one material, prepared for their joint likelihood.

use std::collections::BTreeMap;

use ppl::prelude::*;
use serde::Serialize;
use surrogate::{DynPce, Input};

use super::correlation;
use crate::fracture::within_box::{deviated, exponential_within};
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
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
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
    /// The logarithm of the value is a linear function of a variable of the tests.
    Trend(TrendOverTests),
}

/// Trend of a parameter over a variable of the tests, such as their temperature: the trend of
/// [`calibrate_groups`](crate::calibrate_groups).
///
/// The parameters of the trend are the values at the smallest and at the largest value of the variable. Both have the prior of
/// the parameter. Between them, the logarithm of the parameter is linear in the variable.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrendOverTests {
    /// Value of the variable in each test, by the name of the test. The ends of the trend are the smallest and the largest of
    /// all these values, also if a test is omitted from the calibration.
    pub at: BTreeMap<String, f64>,
    /// Whether the logarithm of the parameter is linear in the logarithm of the variable, as in a power law of the rate.
    pub is_logarithmic: bool,
    /// Unit of the variable, for the names of the parameters.
    pub unit: String,
    /// Scale of the half-normal prior of the standard deviation with which the logarithm deviates from the trend in each
    /// test; 0: no deviations.
    pub deviation: f64,
}

impl TrendOverTests {
    /// The smallest and the largest value of the variable.
    fn ends(&self) -> [f64; 2] {
        let all = || self.at.values().copied();
        [all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// Position of a value of the variable between the ends of the trend: 0 at the smallest value, 1 at the largest.
    pub(super) fn position(&self, value: f64) -> f64 {
        let scale = |x: f64| if self.is_logarithmic { x.ln() } else { x };
        let [low, high] = self.ends().map(scale);
        (scale(value) - low) / (high - low)
    }

    /// Names of the parameters at the ends of the trend.
    fn names(&self, parameter: &str) -> [String; 2] {
        self.ends().map(|end| {
            let digits = format!("{end:.3e}").parse().unwrap_or(end);
            format!("{parameter} (at {digits} {})", self.unit)
        })
    }

    /// Describes why the trend cannot be used for tests with these names; `None` if it can be used.
    fn problem(&self, tests: &[JointTest]) -> Option<String> {
        if let Some(test) = tests.iter().find(|test| !self.at.contains_key(&test.name)) {
            return Some(format!("follows a trend, which has no value for {}", test.name));
        }
        let is_possible = |x: &&f64| x.is_finite() && (!self.is_logarithmic || **x > 0.0);
        if let Some((test, x)) = self.at.iter().find(|(_, x)| !is_possible(x)) {
            return Some(format!("follows a trend, whose value {x} for {test} is impossible"));
        }
        let [low, high] = self.ends();
        // the names of the ends have four digits
        if high - low <= 1e-3 * low.abs().max(high.abs()) {
            return Some("follows a trend, but all tests have the same value of it".to_owned());
        }
        let is_scale = self.deviation >= 0.0 && self.deviation.is_finite();
        (!is_scale).then(|| format!("deviates from its trend by {}", self.deviation))
    }
}

/// Value of an input of a test in the joint model, before its deviation in the test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum InputValue {
    /// The parameter with this index.
    Parameter(usize),
    /// A point of a trend: the indices of the parameters at its ends, and the position between them.
    Trend([usize; 2], f64),
}

/// Parameter that varies between tests.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Varying {
    /// Name of the surrogate's input.
    pub(super) name: String,
    /// Scale of the prior of the standard deviation between tests.
    pub(super) scale: f64,
}

/// Tests prepared for their joint likelihood, and the parameters of the joint model.
#[derive(Clone, Debug)]
pub struct JointTests {
    /// Names of the parameters of the joint model: the name of the surrogate's input, followed by the name of the test
    /// in parentheses for a parameter of one test.
    pub(super) names: Vec<String>,
    /// Priors of the parameters.
    pub(super) priors: Vec<Prior>,
    /// Parameters that vary between tests.
    pub(super) varying: Vec<Varying>,
    /// Trends of parameters, by the name of the surrogate's input.
    pub(super) trends: BTreeMap<String, TrendOverTests>,
    pub(super) tests: Vec<PreparedTest>,
}

/// A test prepared for the likelihood, with quantities relative to the means of its specimens.
#[derive(Clone, Debug)]
pub(super) struct PreparedTest {
    pub(super) name: String,
    pub(super) inputs: Vec<Input>,
    /// Value of each input of the surrogate in the joint model.
    pub(super) values: Vec<InputValue>,
    /// Index of each varying parameter among the inputs of the surrogate, in the order of
    /// [`JointTests::varying`].
    pub(super) varying: Vec<usize>,
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
    /// - A parameter that varies or follows a trend has no positive lower bound, is missing in a test, or is listed in
    ///   `own` of a test.
    /// - A trend has no value for a test, or the same value for all tests.
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
        let trends = between.iter().filter_map(|(name, relation)| match relation {
            BetweenTests::Trend(trend) => Some((name.clone(), trend.clone())),
            _ => None,
        });
        let mut joint = Self {
            names: Vec::new(),
            priors: Vec::new(),
            varying: Vec::new(),
            trends: trends.collect(),
            tests: Vec::new(),
        };
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
            let values = inputs
                .iter()
                .zip(&test.priors)
                .map(|(input, prior)| joint.value(test, input, prior, between))
                .collect::<Result<_, _>>()?;
            let (forward, specimens) = relative_to_means(&test.forward, &test.evidence)?;
            joint.tests.push(PreparedTest {
                name: test.name.clone(),
                values,
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
            let scale = match relation {
                BetweenTests::Shared | BetweenTests::Own => continue,
                BetweenTests::Varies { scale } => *scale,
                BetweenTests::Trend(trend) => {
                    if let Some(problem) = trend.problem(tests) {
                        return refuse(name, problem);
                    }
                    trend.deviation
                }
            };
            let varies = matches!(relation, BetweenTests::Varies { .. });
            if varies && !(scale > 0.0 && scale.is_finite()) {
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
            let has_shared = |test: &&JointTest| {
                !test.own.contains(name) && test.forward.inputs().iter().any(|i| i.name == *name)
            };
            if !tests.iter().any(|test| has_shared(&test)) {
                let problem = match varies {
                    true => "varies about a common centre, but every test has its own prior of it",
                    false => "follows a trend, but every test has its own prior of it",
                };
                return refuse(name, problem.to_owned());
            }
            if let Some(test) = tests.iter().find(|test| !has_shared(test)) {
                return refuse(&test.name, format!("has no shared parameter {name}"));
            }
            if scale > 0.0 {
                joint.varying.push(Varying { name: name.clone(), scale });
            }
        }
        for test in &mut joint.tests {
            let place =
                |varying: &Varying| test.inputs.iter().position(|input| input.name == varying.name);
            test.varying = joint.varying.iter().filter_map(place).collect();
        }
        Ok(joint)
    }

    /// Returns the value of a test's input in the joint model, and adds its parameters if they are new.
    fn value(
        &mut self,
        test: &JointTest,
        input: &Input,
        prior: &Prior,
        between: &BTreeMap<String, BetweenTests>,
    ) -> Result<InputValue, CalibrationError> {
        let relation = between.get(&input.name);
        let is_own = test.own.contains(&input.name) || relation == Some(&BetweenTests::Own);
        if is_own {
            let name = format!("{} ({})", input.name, test.name);
            return Ok(InputValue::Parameter(self.parameter(test, name, prior)?));
        }
        match relation {
            Some(BetweenTests::Trend(trend)) => {
                let [low, high] = trend.names(&input.name);
                let low = self.parameter(test, low, prior)?;
                let high = self.parameter(test, high, prior)?;
                // `problem` refuses a test without a value
                let value = trend.at.get(&test.name).copied().unwrap_or(f64::NAN);
                Ok(InputValue::Trend([low, high], trend.position(value)))
            }
            _ => Ok(InputValue::Parameter(self.parameter(test, input.name.clone(), prior)?)),
        }
    }

    /// Returns the index of a parameter, and adds the parameter if it is new.
    fn parameter(
        &mut self,
        test: &JointTest,
        name: String,
        prior: &Prior,
    ) -> Result<usize, CalibrationError> {
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
        self.varying.iter().map(|varying| varying.name.clone()).collect()
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
        let value = |(value, input): (&InputValue, &Input)| match *value {
            InputValue::Parameter(index) => parameters[index],
            InputValue::Trend([low, high], position) => {
                let line =
                    parameters[low].ln() * (1.0 - position) + parameters[high].ln() * position;
                exponential_within(line, [input.lower, input.upper])
            }
        };
        let mut point: Vec<R> = self.values.iter().zip(&self.inputs).map(value).collect();
        for (&place, &deviation) in self.varying.iter().zip(deviations) {
            let Input { lower, upper, .. } = self.inputs[place];
            point[place] = deviated(point[place].ln(), deviation, [lower, upper]);
        }
        point
    }

    /// Returns, for each input of the surrogate, the parameters on which its value depends and its derivatives with respect
    /// to them.
    pub(super) fn dependences(&self, parameters: &[f64]) -> Vec<Vec<(usize, f64)>> {
        let centre = self.point(parameters, &[]);
        let slopes = |(value, centre): (&InputValue, f64)| match *value {
            InputValue::Parameter(index) => vec![(index, 1.0)],
            InputValue::Trend([low, high], position) => {
                // derivative of exp((1 − x) ln a + x ln b)
                let slope = |index: usize, part: f64| (index, part * centre / parameters[index]);
                vec![slope(low, 1.0 - position), slope(high, position)]
            }
        };
        self.values.iter().zip(centre).map(slopes).collect()
    }

    /// Returns the values of the varying parameters in this test, from the values of all inputs.
    pub(super) fn varying_values<R: Scalar>(&self, point: &[R]) -> Vec<R> {
        self.varying.iter().map(|&place| point[place]).collect()
    }
}
