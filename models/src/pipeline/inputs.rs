//! Recorded access to the inputs of a stage. A stage reads every part of the case and every file through this module,
//! which records the hash of the content. The record therefore lists everything that the stage depends on.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use ::surrogate::Input;
use fem::{Homogenisation, Order, PhaseField, SolverOptions};

use crate::case::{
    CalibrationCase, CandidateCase, Case, CaseFile, ConditionsCase, ConfirmCase, DesignCase,
    ExtendCase, FidelityCase, FurtherTestsCase, InterfaceCase, MachineCase, MaterialCase,
    Microstructure, Parameter, PriorCase, QoiComparison, SequentialCase, SimulatorCase, SingleTest,
    SpecimenGeometry, SurrogateCase, TestCase, ValidationCase, has_surrogate_for, single_tests,
};
use crate::prior::Prior;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::sources::{Origin, Sources};
use crate::simulation::setup::Setup;

/// Check that returns an error for a file that the stage must not use, given the name of the file.
type Guard<'a> = &'a dyn Fn(&str) -> Result<(), WorkflowError>;

/// Access of a stage to the case and the results folder; records everything that is read.
pub(crate) struct Inputs<'a> {
    file: &'a CaseFile,
    dir: &'a Path,
    origin: Origin<'a>,
    comparison: QoiComparison,
    /// Returns the stage that writes the file of a given name, if there is one.
    writer: fn(&str) -> Option<&'static str>,
    /// Rejects result files that are out of date.
    guard: Option<Guard<'a>>,
    /// Smallest number of specimens: two for a calibration, which estimates the scatter between specimens.
    least_specimens: usize,
    /// Record of everything read so far. The record is a `RefCell`, which threads cannot share. Simulations that run
    /// on other threads therefore cannot read inputs.
    read: RefCell<Sources>,
}

impl<'a> Inputs<'a> {
    /// Creates the inputs of a stage from a case, the results folder, and a function that returns the stage that writes
    /// a given file.
    pub(crate) fn new(
        file: &'a CaseFile,
        dir: &'a Path,
        writer: fn(&str) -> Option<&'static str>,
    ) -> Self {
        let origin = Origin::of(&file.case, dir);
        let (comparison, read) = (file.case.qoi_comparison(), RefCell::default());
        Self { file, dir, origin, comparison, writer, guard: None, least_specimens: 2, read }
    }

    /// Creates the inputs of another case with the same results folder and an empty record.
    pub(crate) fn of<'b>(&self, file: &'b CaseFile) -> Inputs<'b>
    where
        'a: 'b,
    {
        Inputs::new(file, self.dir, self.writer)
    }

    /// Creates the inputs of another case in another results folder with an empty record.
    pub(crate) fn of_folder<'b>(&self, file: &'b CaseFile, dir: &'b Path) -> Inputs<'b> {
        Inputs::new(file, dir, self.writer)
    }

    /// Adds a guard: the stage gets a file only if the guard accepts the file.
    pub(crate) fn guarded(self, guard: Guard<'a>) -> Self {
        Self { guard: Some(guard), ..self }
    }

    /// Returns these inputs for held-out specimens, which the calibration does not use: a single specimen is
    /// sufficient.
    pub(crate) fn of_held_out(self) -> Self {
        Self { least_specimens: 1, ..self }
    }

    /// Smallest number of specimens.
    pub(crate) fn least_specimens(&self) -> usize {
        self.least_specimens
    }

    /// Parts of the case and files that have been read so far.
    pub(crate) fn sources(&self) -> Sources {
        self.read.borrow().clone()
    }

    /// Records keys of the case and files, and returns their fingerprints, one line `name = fingerprint` each.
    pub(crate) fn fingerprints(&self, keys: &[&str], files: &[&str]) -> String {
        keys.iter().for_each(|key| self.reads(key));
        files.iter().for_each(|name| drop(self.reads_file(name)));
        self.read.borrow().lines(keys, files)
    }

    /// Describes the first changed entry of `sources`, if there is one.
    pub(crate) fn change(&self, sources: &Sources) -> Option<String> {
        sources.change(&self.origin)
    }

    /// Hash of the table `[specimen]`. Cases with different specimens have different hashes.
    pub(crate) fn specimen(&self) -> String {
        self.origin.part("specimen")
    }

    /// The case, without recording. The caller records every key that it reads.
    pub(crate) fn unrecorded(&self) -> &'a CaseFile {
        self.file
    }

    /// Records a key of the case.
    pub(crate) fn reads(&self, key: &str) {
        self.read.borrow_mut().read_part(&self.origin, key);
    }

    /// Records all files of an image: a header file refers to a separate file of values.
    pub(crate) fn reads_image(&self, path: &Path) {
        for file in fem::image_files(&self.dir.join(path)) {
            let name = if path.is_absolute() { None } else { file.strip_prefix(self.dir).ok() };
            self.reads_file(&name.unwrap_or(&file).to_string_lossy());
        }
    }

    /// Records a file, and returns its path.
    pub(crate) fn reads_file(&self, name: &str) -> PathBuf {
        self.read.borrow_mut().read_file(&self.origin, name);
        self.dir.join(name)
    }
}

/// Defines a method for each listed part of the case. The method records the key of the part and returns the part.
macro_rules! case_keys {
    ($($name:ident: $first:ident $(. $rest:ident)* => $type:ty;)*) => {
        impl Inputs<'_> {$(
            pub(crate) fn $name(&self) -> &$type {
                self.reads(concat!(stringify!($first) $(, ".", stringify!($rest))*));
                &self.file.case.$first$(.$rest)*
            }
        )*}
    };
}

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

impl Inputs<'_> {
    /// The whole case. A stage that calls this method depends on every key.
    pub(crate) fn case(&self) -> &Case {
        self.reads("");
        &self.file.case
    }

    /// Quantities that are compared between specimens and simulations.
    pub(crate) fn qoi(&self) -> &QoiComparison {
        self.reads("qoi");
        self.reads("calibration.likelihood");
        &self.comparison
    }

    /// Returns the case that simulates a candidate for a further test. Inputs read from this case must be recorded with
    /// [`Self::reads_with`].
    pub(crate) fn candidate(&self, candidate: &CandidateCase) -> Result<CaseFile, WorkflowError> {
        Ok(self.file.of_candidate(candidate)?)
    }

    /// Whether the surrogate predicts the specimens of a validation.
    pub(crate) fn has_surrogate_for(&self, entry: &ValidationCase) -> bool {
        for key in ["specimen", "material", "interface", "phase_field", "test", "machine"] {
            self.reads(key);
        }
        for key in ["conditions", "solver", "simulator", "qoi", "calibration.likelihood"] {
            self.reads(key);
        }
        has_surrogate_for(self.file, entry)
    }

    /// Records all keys and files that `other` has read.
    pub(crate) fn reads_with(&self, other: &Inputs<'_>) {
        let sources = other.sources();
        sources.case_keys().for_each(|key| self.reads(key));
        sources.files().for_each(|name| drop(self.reads_file(name)));
    }

    /// Returns the parts of the case that define a simulation.
    pub(crate) fn setup(&self) -> Setup<'_> {
        Setup {
            path: &self.file.path,
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
    pub(crate) fn unrecorded_simulator(&self) -> Option<&SimulatorCase> {
        self.file.case.simulator.as_ref()
    }

    /// Whether this program simulates the runs. Records the source of the runs if it is outside this program.
    pub(crate) fn is_built_in(&self) -> bool {
        let is_built_in = self.file.case.is_built_in();
        if !is_built_in {
            self.simulator();
            self.reads("design.import");
        }
        is_built_in
    }

    /// Whether the runs are imported, so that no further run can be made.
    pub(crate) fn imports_runs(&self) -> bool {
        !self.is_built_in() && self.file.case.design.import.is_some()
    }

    /// Path of a file that the case names; records its content.
    pub(crate) fn named_file(&self, path: &Path) -> PathBuf {
        self.reads_file(&path.to_string_lossy())
    }

    /// The geometry of the specimen.
    pub(crate) fn geometry(&self) -> Result<SpecimenGeometry, WorkflowError> {
        self.reads("specimen");
        let geometry = self.file.geometry()?;
        if let Some(name) = self.geometry_file(&geometry) {
            self.reads_file(&name);
        }
        Ok(geometry)
    }

    /// Name of the file or folder that contains a geometry; `None` for a geometry of numbers or of an image.
    pub(crate) fn geometry_file(&self, geometry: &SpecimenGeometry) -> Option<String> {
        match geometry {
            // a file in the results folder has its relative name
            SpecimenGeometry::Mesh { file, .. } => {
                Some(file.strip_prefix(self.dir).unwrap_or(file).to_string_lossy().into_owned())
            }
            // the content of a folder is the content of all its files, so that an additional file counts as a change
            SpecimenGeometry::Surfaces { import, .. } => {
                Some(import.surfaces.to_string_lossy().into_owned())
            }
            _ => None,
        }
    }

    /// The tests of a case with several tests, each as a complete case.
    pub(crate) fn tests(&self) -> Result<Vec<SingleTest>, WorkflowError> {
        Ok(single_tests(self.file)?)
    }

    /// Records everything that `inner`, the inputs of a case in the subfolder `folder`, has read: its keys as keys of
    /// this case, and its files as files in `folder`. Also records the key `tests`.
    pub(crate) fn reads_in_folder(&self, inner: &Inputs<'_>, folder: &str) {
        let sources = inner.sources();
        sources.case_keys().for_each(|key| self.reads(key));
        self.reads("tests");
        sources.files().for_each(|name| drop(self.reads_file(&format!("{folder}/{name}"))));
    }

    /// The directory of the results.
    pub(crate) fn folder(&self) -> &Path {
        self.dir
    }

    /// Path of the case file, for messages.
    pub(crate) fn case_path(&self) -> &Path {
        &self.file.path
    }

    /// Rejects a mesh spacing that is larger than the radius or the height, or that gives too many elements.
    pub(crate) fn check_spacing(
        &self,
        spacing_mm: f64,
        radius_mm: f64,
        height_mm: f64,
    ) -> Result<(), WorkflowError> {
        Ok(self.file.check_spacing("specimen.spacing_mm", spacing_mm, radius_mm, height_mm)?)
    }

    /// The prior with all extensions in `[[extend]]`.
    pub(crate) fn whole_prior(&self) -> Option<PriorCase> {
        self.prior_table();
        self.extend();
        self.file.case.whole_prior()
    }

    /// Returns the calibrated parameters as inputs of the surrogate, with ranges that include the extensions.
    pub(crate) fn prior(&self) -> Result<Vec<Input>, WorkflowError> {
        let prior = self.whole_prior().ok_or_else(|| self.missing_prior())?;
        Ok(prior.inputs()?)
    }

    /// The priors of the calibrated parameters, with the ranges of extensions.
    pub(crate) fn priors(&self) -> Result<Vec<Prior>, WorkflowError> {
        let prior = self.whole_prior().ok_or_else(|| self.missing_prior())?;
        Ok(prior.priors())
    }

    /// Returns the priors without extensions. Their ranges are the box of the runs of `[design]`.
    pub(crate) fn first_prior(&self) -> Result<&PriorCase, WorkflowError> {
        self.prior_table().as_ref().ok_or_else(|| self.missing_prior())
    }

    /// The calibrated parameters, with the units of free parameters.
    pub(crate) fn parameters_in_units(&self) -> Result<Vec<Parameter>, WorkflowError> {
        if !self.file.case.parameters.is_empty() {
            self.reads("parameters");
        }
        self.parameters()
    }

    /// The calibrated parameters.
    pub(crate) fn parameters(&self) -> Result<Vec<Parameter>, WorkflowError> {
        Ok(self.first_prior()?.parameters().cloned().collect())
    }

    /// Number of runs per batch, if runs are added in batches. This number is part of the identity of the runs. The
    /// other keys of `[sequential]` only determine the number of batches.
    pub(crate) fn sequential_batch(&self) -> Option<usize> {
        self.reads("sequential.batch");
        self.file.case.sequential.as_ref().map(|sequential| sequential.batch)
    }

    /// Accepted share of the surrogate in the posterior variance (`sequential.share`), if runs are added in batches.
    pub(crate) fn sequential_share(&self) -> Option<f64> {
        self.reads("sequential.share");
        self.file.case.sequential.as_ref().map(|sequential| sequential.share)
    }

    /// Rejects a number of load steps that is too small to read the quantities of interest from the curves.
    pub(crate) fn check_steps(&self) -> Result<(), WorkflowError> {
        Ok(self.file.check_steps()?)
    }

    /// The name of the stage that writes a file of the results.
    pub(crate) fn writer_of(&self, name: &str) -> Option<&'static str> {
        (self.writer)(name)
    }

    /// Path of a file that an earlier stage has written.
    pub(crate) fn file(&self, name: &str) -> Result<PathBuf, WorkflowError> {
        let path = self.reads_file(name);
        match self.writer_of(name) {
            Some(stage) if !path.is_file() => Err(WorkflowError::Missing { path, stage }),
            _ => self.guard.map_or(Ok(()), |guard| guard(name)).map(|()| path),
        }
    }

    /// Text of a file that an earlier stage has written.
    pub(crate) fn text(&self, name: &str) -> Result<String, WorkflowError> {
        let path = self.file(name)?;
        fem::read_regular_text(&path).map_err(|e| WorkflowError::io(&path, e))
    }

    /// Content of a JSON file that an earlier stage has written.
    pub(crate) fn json<T: serde::de::DeserializeOwned>(
        &self,
        name: &str,
    ) -> Result<T, WorkflowError> {
        let text = self.text(name)?;
        let stage = self.writer_of(name).unwrap_or("run");
        serde_json::from_str(&text).map_err(|source| WorkflowError::Json {
            path: self.dir.join(name),
            stage,
            source,
        })
    }

    /// Path of an optional file, if the file exists.
    pub(crate) fn file_if_there(&self, name: &str) -> Option<PathBuf> {
        Some(self.reads_file(name)).filter(|path| path.is_file())
    }

    fn missing_prior(&self) -> WorkflowError {
        self.missing("prior", "what is calibrated")
    }

    /// Creates an error about a missing table of the case.
    pub(crate) fn missing(&self, table: &str, what: &str) -> WorkflowError {
        let help = format!("Add a table [{table}]: it states {what}.");
        self.file.error(table, "", "is missing", help).into()
    }
}
