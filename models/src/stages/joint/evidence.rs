//! Surrogate, specimens and errors of each test, read from the folder of the test.

use super::folders;
use crate::case::{CaseFile, SingleTest};
use crate::forward::fitted::{Fitted, read_experiments};
use crate::forward::uncertainty::SharedError;
use crate::fracture::{Evidence, JointTest, column_means};
use crate::pipeline::gate::check_range_of_test;
use crate::pipeline::inputs::Inputs;
use crate::prior::Prior;
use crate::results_folder::error::WorkflowError;

/// Data of one test for the joint calibration.
pub(super) struct TestEvidence {
    pub(super) name: String,
    pub(super) fitted: Fitted,
    pub(super) priors: Vec<Prior>,
    pub(super) evidence: Evidence,
    pub(super) shared: SharedError,
    /// Paths of the parameters that have a prior in this test only.
    own: Vec<String>,
    /// Number of specimens.
    pub(super) specimens: usize,
}

impl TestEvidence {
    /// Reads all tests of a case, and records every key and file on which the tests depend.
    ///
    /// # Errors
    /// Fails if a file of a test is missing or belongs to another case. Unless `accept_out_of_range`, fails if the
    /// specimens of a test are outside the range of its runs.
    pub(super) fn read_all(
        inputs: &Inputs<'_>,
        accept_out_of_range: bool,
    ) -> Result<Vec<Self>, WorkflowError> {
        let read = |test| Self::read(inputs, test, accept_out_of_range);
        inputs.tests()?.into_iter().map(read).collect()
    }

    fn read(
        inputs: &Inputs<'_>,
        test: SingleTest,
        accept_out_of_range: bool,
    ) -> Result<Self, WorkflowError> {
        let SingleTest { name, file, own: separate } = test;
        let folder = folders::of_test(&name);
        let dir = inputs.folder().join(&folder);
        let file = CaseFile { path: dir.join("case.toml"), ..file };
        let of_test = inputs.of_folder(&file, &dir);
        let fitted = Fitted::read(&of_test)?;
        let (prior, priors) = (of_test.prior()?, of_test.priors()?);
        if !fitted.pce.inputs().starts_with(&prior) {
            let path = dir.join("surrogate.json");
            return Err(WorkflowError::OtherCase { path, stage: "surrogate" });
        }
        let specimens = read_experiments(&of_test, fitted.pce.outputs())?;
        if !accept_out_of_range {
            check_range_of_test(&of_test, &specimens)?;
        }
        let means = column_means(&specimens);
        let shared = SharedError::of(&fitted, &of_test.calibration().discrepancy, &means)?;
        let count = specimens.len();
        let evidence = shared.evidence(specimens, &fitted.known_stiffness);
        inputs.reads_in_folder(&of_test, &folder);
        Ok(Self { name, fitted, priors, evidence, shared, own: separate, specimens: count })
    }

    /// Converts to a test of the joint model.
    pub(super) fn joint_test(&self) -> JointTest {
        JointTest {
            name: self.name.clone(),
            forward: self.fitted.pce.clone(),
            priors: self.priors.clone(),
            own: self.own.clone(),
            evidence: self.evidence.clone(),
        }
    }
}
