//! `joint_model.json`: the joint model as data, for another program that samples the same posterior.

use std::collections::BTreeMap;

use serde::Serialize;
use surrogate::{CoefficientPosterior, DynPce};

use crate::fracture::{BetweenTests, Evidence, JointTest};
use crate::pipeline::task::Task;
use crate::prior::Prior;
use crate::results_folder::error::WorkflowError;

/// Name of the file.
const FILE: &str = "joint_model.json";

/// The joint model of all tests.
#[derive(Serialize)]
struct JointModelFile<'a> {
    tests: Vec<TestFile<'a>>,
    /// Relation between the values of a parameter in the tests; the tests share all other parameters.
    between_tests: &'a BTreeMap<String, BetweenTests>,
}

/// One test: its forward model and its specimens.
#[derive(Serialize)]
struct TestFile<'a> {
    name: &'a str,
    /// Priors by the name of the parameter. A uniform prior is its range.
    priors: BTreeMap<&'a str, Prior>,
    /// Parameters whose value in this test is independent of the other tests.
    own: &'a [String],
    surrogate: &'a DynPce,
    /// Quantities of interest, one row per specimen, in the order of the surrogate's outputs; null if the specimen lacks
    /// the quantity.
    quantities: &'a [Vec<f64>],
    /// Last inputs of the surrogate for each specimen, null if they are unknown; empty if all inputs are parameters.
    known_inputs: &'a [Option<Vec<f64>>],
    /// Population of the unknown inputs.
    population: Option<PopulationFile<'a>>,
    /// Covariance of the error that all specimens share, relative to the means of the quantities.
    shared_covariance: &'a [Vec<f64>],
    /// Shared errors that depend on the parameters: posteriors of the coefficients of the surrogate.
    errors_of_surrogate: &'a [CoefficientPosterior],
}

/// Independent normal distributions of inputs, estimated from `members` members; null if they are exact.
#[derive(Serialize)]
struct PopulationFile<'a> {
    mean: &'a [f64],
    sd: &'a [f64],
    members: f64,
}

/// Writes the joint model of the tests.
///
/// # Errors
/// Fails if the file cannot be written.
pub(super) fn write_model(
    task: &Task<'_>,
    tests: &[JointTest],
    between_tests: &BTreeMap<String, BetweenTests>,
) -> Result<(), WorkflowError> {
    let tests = tests.iter().map(test_file).collect();
    task.write_json(FILE, &JointModelFile { tests, between_tests })
}

fn test_file(test: &JointTest) -> TestFile<'_> {
    let JointTest { name, forward, priors, own, evidence } = test;
    let Evidence { qois, known, population, shared, open } = evidence;
    let names = forward.inputs().iter().map(|input| input.name.as_str());
    TestFile {
        name,
        priors: names.zip(priors.iter().copied()).collect(),
        own,
        surrogate: forward,
        quantities: qois,
        known_inputs: known,
        population: population.as_ref().map(|population| PopulationFile {
            mean: population.mean(),
            sd: population.sd(),
            members: population.count(),
        }),
        shared_covariance: shared,
        errors_of_surrogate: open,
    }
}
