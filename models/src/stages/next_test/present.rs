//! The present belief about the parameters: posterior draws of the calibration, and the present test at these draws.

use surrogate::{DynPce, Input};

use super::elsewhere::Elsewhere;
use crate::forward::fitted::{Fitted, read_experiments};
use crate::forward::posterior_draws::{Draw, posterior_draws};
use crate::forward::uncertainty::SharedError;
use crate::fracture::column_means;
use crate::further_test::{AlikeTest, Belief, FurtherTest, FurtherTestError, TestAtDraw};
use crate::pipeline::task::Task;
use crate::prior::Prior;
use crate::qoi::Quantity;
use crate::results_folder::error::WorkflowError;

/// Number of posterior draws in averages: the standard error of a mean is about 5 % of the standard deviation of the
/// draws.
const DRAWS: usize = 400;

/// The posterior of the calibration.
pub(super) struct Present {
    /// The parameters with their ranges.
    pub(super) prior: Vec<Input>,
    priors: Vec<Prior>,
    pub(super) draws: Vec<Draw>,
    /// Names of the quantities' columns.
    pub(super) outputs: Vec<String>,
    pce: DynPce,
    /// Means of the known inputs of the specimens (the stiffness ratio).
    known_inputs: Vec<f64>,
    /// Indices of the recorded quantities of each specimen.
    recorded: Vec<Vec<usize>>,
    shared: Vec<Vec<f64>>,
}

impl Present {
    pub(super) fn read(task: &Task<'_>) -> Result<Self, WorkflowError> {
        let inputs = &task.inputs;
        let fitted = Fitted::read(inputs)?;
        let (prior, outputs) = (inputs.prior()?, fitted.pce.outputs().to_vec());
        let qois = read_experiments(inputs, &outputs)?;
        let discrepancy = &inputs.calibration().discrepancy;
        let shared = SharedError::of(&fitted, discrepancy, &column_means(&qois))?;
        let evidence = shared.evidence(qois, &fitted.known_stiffness);
        let (pce, shared) = (fitted.pce, shared.total());
        let draws = posterior_draws(inputs, &prior, &outputs)?;
        let (known_inputs, recorded) = (evidence.middle(), evidence.recorded());
        let priors = inputs.priors()?;
        Ok(Self { prior, priors, draws, outputs, pce, known_inputs, recorded, shared })
    }

    pub(super) fn belief(&self) -> Result<Belief, FurtherTestError> {
        belief(&self.priors, &self.draws)
    }

    /// Returns the test of more specimens of the present kind.
    pub(super) fn test(&self) -> Result<FurtherTest, WorkflowError> {
        let scatter = |draw: &Draw| draw.scatter.clone();
        Ok(FurtherTest {
            draws: at_draws(&self.pce, &self.known_inputs, &self.draws, &scatter)?,
            shared: self.shared.clone(),
            seen: self.recorded.clone(),
            alike: None,
        })
    }

    /// Returns the data of the present test that are needed for a further test with the same errors; `None` if the
    /// present test lacks one of the quantities.
    pub(super) fn alike(
        &self,
        quantities: &[Quantity],
    ) -> Result<Option<AlikeTest>, WorkflowError> {
        let index_of = |quantity: &Quantity| {
            self.outputs.iter().position(|column| *column == quantity.column())
        };
        let Some(quantities) = quantities.iter().map(index_of).collect::<Option<Vec<usize>>>()
        else {
            return Ok(None);
        };
        let FurtherTest { draws, shared, seen, .. } = self.test()?;
        Ok(Some(AlikeTest { draws, shared, seen, quantities }))
    }

    /// Returns the belief about the parameters and about their values in a further test.
    pub(super) fn belief_elsewhere(
        &self,
        elsewhere: &Elsewhere,
    ) -> Result<Belief, FurtherTestError> {
        elsewhere.belief(&self.priors, &self.draws)
    }
}

/// Mean of each parameter over draws.
pub(super) fn mean(draws: &[Draw]) -> Vec<f64> {
    column_means(&draws.iter().map(|draw| draw.theta.clone()).collect::<Vec<_>>())
}

/// Computes the belief about the parameters from posterior draws.
pub(super) fn belief(priors: &[Prior], draws: &[Draw]) -> Result<Belief, FurtherTestError> {
    let theta: Vec<Vec<f64>> = draws.iter().map(|draw| draw.theta.clone()).collect();
    Belief::of_draws(priors, &theta)
}

/// Creates a test whose quantities are the outputs of an expansion, evaluated at a subset of the draws. Derivatives are
/// divided by the quantities at the draw. `known_inputs` are the values of the expansion's further inputs, which follow the
/// parameters.
pub(super) fn at_draws(
    pce: &DynPce,
    known_inputs: &[f64],
    draws: &[Draw],
    scatter: &dyn Fn(&Draw) -> Vec<Vec<f64>>,
) -> Result<Vec<TestAtDraw>, WorkflowError> {
    let every = (draws.len() / DRAWS).max(1);
    let at = |draw: &Draw| {
        let (values, jacobian) =
            pce.value_and_jacobian(&[&draw.theta[..], known_inputs].concat())?;
        let row = |(row, value): (Vec<f64>, &f64)| {
            row[..draw.theta.len()].iter().map(|slope| slope / value).collect()
        };
        let jacobian = jacobian.into_iter().zip(&values).map(row).collect();
        Ok(TestAtDraw { jacobian, scatter: scatter(draw) })
    };
    draws.iter().step_by(every).map(at).collect()
}
