//! The parts of a case as inputs of a stage. Each method records the keys that it reads.

use std::collections::BTreeMap;

use ::surrogate::Input;
use fem::{Homogenisation, Order, PhaseField, SolverOptions};

use crate::case::{
    CalibrationCase, CandidateCase, CaseFile, ConditionsCase, ConfirmCase, DesignCase, ExtendCase,
    FidelityCase, FurtherTestsCase, InterfaceCase, MachineCase, MaterialCase, Microstructure,
    Parameter, PriorCase, QoiComparison, SequentialCase, SimulatorCase, SingleTest,
    SpecimenGeometry, SurrogateCase, TestCase, ValidationCase, has_surrogate_for, single_tests,
};
use crate::pipeline::inputs::Inputs;
use crate::prior::Prior;
use crate::results_folder::error::WorkflowError;
use crate::simulation::setup::Setup;
use crate::simulation::without_viscosity::refuse_without_peak;

/// Defines a method for each listed part of the case. The method records the key of the part and returns the part.
macro_rules! case_keys {
    ($($name:ident: $first:ident $(. $rest:ident)* => $type:ty;)*) => {$(
        fn $name(&self) -> &$type {
            let inputs = self.inputs();
            inputs.reads(concat!(stringify!($first) $(, ".", stringify!($rest))*));
            &inputs.unrecorded().case.$first$(.$rest)*
        }
    )*};
}

/// Access to the parts of a case, which is recorded.
pub(crate) trait CaseInputs {
    /// The recorded inputs of the stage.
    fn inputs(&self) -> &Inputs<'_>;

    case_keys! {
        order: specimen.order => Order;
        homogenisation: specimen.homogenisation => Homogenisation;
        material: material => BTreeMap<String, MaterialCase>;
        interface: interface => BTreeMap<String, InterfaceCase>;
        phase_field: phase_field => Option<PhaseField>;
        test: test => TestCase;
        machine: machine => MachineCase;
        conditions: conditions => Option<ConditionsCase>;
        solver: solver => SolverOptions;
        simulator: simulator => Option<SimulatorCase>;
        prior_table: prior => Option<PriorCase>;
        extend: extend => Vec<ExtendCase>;
        design: design => DesignCase;
        microstructure: design.microstructure => Microstructure;
        fidelity: fidelity => FidelityCase;
        sequential: sequential => Option<SequentialCase>;
        surrogate: surrogate => SurrogateCase;
        calibration: calibration => CalibrationCase;
        confirm: confirm => ConfirmCase;
        validation: validation => Vec<ValidationCase>;
        further_tests: further_tests => FurtherTestsCase;
    }

    /// Quantities that are compared between specimens and simulations.
    fn qoi(&self) -> QoiComparison {
        self.inputs().reads("qoi");
        self.inputs().reads("calibration.likelihood");
        self.inputs().unrecorded().case.qoi_comparison()
    }

    /// Returns the case that simulates a candidate for a further test. Inputs read from this case must be recorded with
    /// [`Inputs::reads_with`].
    fn candidate(&self, candidate: &CandidateCase) -> Result<CaseFile, WorkflowError> {
        Ok(self.inputs().unrecorded().of_candidate(candidate)?)
    }

    /// Whether the surrogate predicts the specimens of a validation.
    fn has_surrogate_for(&self, entry: &ValidationCase) -> bool {
        for key in ["specimen", "material", "interface", "phase_field", "test", "machine"] {
            self.inputs().reads(key);
        }
        for key in ["conditions", "solver", "simulator", "qoi", "calibration.likelihood"] {
            self.inputs().reads(key);
        }
        has_surrogate_for(self.inputs().unrecorded(), entry)
    }

    /// Returns the parts of the case that define a simulation.
    fn setup(&self) -> Setup<'_> {
        Setup {
            path: &self.inputs().unrecorded().path,
            order: *self.order(),
            homogenisation: *self.homogenisation(),
            material: self.material(),
            interface: self.interface(),
            phase_field: self.phase_field().as_ref(),
            test: self.test(),
            steps: None,
            conditions: self.conditions().as_ref(),
            solver: *self.solver(),
            device: None,
            ranks: None,
            derivatives: false,
        }
    }

    /// Returns `[simulator]`, if the case has it. The caller records the keys that it reads.
    fn unrecorded_simulator(&self) -> Option<&SimulatorCase> {
        self.inputs().unrecorded().case.simulator.as_ref()
    }

    /// Whether this program simulates the runs. Records the source of the runs if it is outside this program.
    fn is_built_in(&self) -> bool {
        let is_built_in = self.inputs().unrecorded().case.is_built_in();
        if !is_built_in {
            self.simulator();
            self.inputs().reads("design.import");
        }
        is_built_in
    }

    /// Whether the runs are imported, so that no further run can be made.
    fn imports_runs(&self) -> bool {
        !self.is_built_in() && self.inputs().unrecorded().case.design.import.is_some()
    }

    /// The geometry of the specimen.
    fn geometry(&self) -> Result<SpecimenGeometry, WorkflowError> {
        self.inputs().reads("specimen");
        let geometry = self.inputs().unrecorded().geometry()?;
        if let Some(name) = self.geometry_file(&geometry) {
            self.inputs().reads_file(&name);
        }
        Ok(geometry)
    }

    /// Name of the file or folder that contains a geometry; `None` for a geometry of numbers or of an image.
    fn geometry_file(&self, geometry: &SpecimenGeometry) -> Option<String> {
        match geometry {
            // a file in the results folder has its relative name
            SpecimenGeometry::Mesh { file, .. } => Some(
                file.strip_prefix(self.inputs().folder())
                    .unwrap_or(file)
                    .to_string_lossy()
                    .into_owned(),
            ),
            // the content of a folder is the content of all its files, so that an additional file counts as a change
            SpecimenGeometry::Surfaces { import, .. } => {
                Some(import.surfaces.to_string_lossy().into_owned())
            }
            _ => None,
        }
    }

    /// The tests of a case with several tests, each as a complete case.
    fn tests(&self) -> Result<Vec<SingleTest>, WorkflowError> {
        Ok(single_tests(self.inputs().unrecorded())?)
    }

    /// Rejects a mesh spacing that is larger than the radius or the height, or that gives too many elements.
    fn check_spacing(
        &self,
        spacing_mm: f64,
        radius_mm: f64,
        height_mm: f64,
    ) -> Result<(), WorkflowError> {
        Ok(self.inputs().unrecorded().check_spacing(
            "specimen.spacing_mm",
            spacing_mm,
            radius_mm,
            height_mm,
        )?)
    }

    /// The prior with all extensions in `[[extend]]`.
    fn whole_prior(&self) -> Option<PriorCase> {
        self.prior_table();
        self.extend();
        self.inputs().unrecorded().case.whole_prior()
    }

    /// Returns the calibrated parameters as inputs of the surrogate, with ranges that include the extensions.
    fn prior(&self) -> Result<Vec<Input>, WorkflowError> {
        let prior = self.whole_prior().ok_or_else(|| self.missing_prior())?;
        Ok(prior.inputs()?)
    }

    /// The priors of the calibrated parameters, with the ranges of extensions.
    fn priors(&self) -> Result<Vec<Prior>, WorkflowError> {
        let prior = self.whole_prior().ok_or_else(|| self.missing_prior())?;
        Ok(prior.priors())
    }

    /// Returns the priors without extensions. Their ranges are the box of the runs of `[design]`.
    fn first_prior(&self) -> Result<&PriorCase, WorkflowError> {
        self.prior_table().as_ref().ok_or_else(|| self.missing_prior())
    }

    /// The calibrated parameters, with the units of free parameters.
    fn parameters_in_units(&self) -> Result<Vec<Parameter>, WorkflowError> {
        if !self.inputs().unrecorded().case.parameters.is_empty() {
            self.inputs().reads("parameters");
        }
        self.parameters()
    }

    /// The calibrated parameters.
    fn parameters(&self) -> Result<Vec<Parameter>, WorkflowError> {
        Ok(self.first_prior()?.parameters().cloned().collect())
    }

    /// Number of runs per batch, if runs are added in batches. This number is part of the identity of the runs. The
    /// other keys of `[sequential]` only determine the number of batches.
    fn sequential_batch(&self) -> Option<usize> {
        self.inputs().reads("sequential.batch");
        self.inputs().unrecorded().case.sequential.as_ref().map(|sequential| sequential.batch)
    }

    /// Accepted share of the surrogate in the posterior variance (`sequential.share`), if runs are added in batches.
    fn sequential_share(&self) -> Option<f64> {
        self.inputs().reads("sequential.share");
        self.inputs().unrecorded().case.sequential.as_ref().map(|sequential| sequential.share)
    }

    /// Rejects a number of load steps that is too small to read the quantities of interest from the curves, and materials
    /// with which no curve has the peak that the quantities need.
    fn check_steps(&self) -> Result<(), WorkflowError> {
        self.inputs().unrecorded().check_steps()?;
        Ok(refuse_without_peak(self.inputs().unrecorded())?)
    }

    fn missing_prior(&self) -> WorkflowError {
        self.inputs().missing("prior", "what is calibrated")
    }
}

impl CaseInputs for Inputs<'_> {
    fn inputs(&self) -> &Inputs<'_> {
        self
    }
}
