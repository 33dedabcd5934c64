//! Experiments, quantities of interest, calibration models, cases and the workflow of Breccia.
//!
//! This crate connects the other crates. Simulations (`fem`) give a dataset. A surrogate is fitted to the dataset. The
//! surrogate and the measured curves give a posterior (`ppl`). The program `breccia` is the command line of this crate.
//!
//! ```
//! use models::{CaseFile, TestCurve, Qois};
//!
//! let file = CaseFile::default_case();                      // what `breccia init` writes
//! let displacement_mm: Vec<f64> = (0..=20).map(|i| 0.01 * i as f64).collect();
//! let force_n = displacement_mm.iter().map(|u| 2000.0 * u - 10_000.0 * u * u).collect();
//! let curve = TestCurve::new(displacement_mm, force_n);
//! let qois = Qois::of(&curve, file.case.qoi.slope_fraction)?;
//! assert!((qois.peak_force_n - 100.0).abs() < 1e-9);
//! # Ok::<(), models::QoiError>(())
//! ```
//!
//! # Modules
//!
//! The list is in the order of the layers. A module imports only from modules earlier in this list, and no two files import
//! each other.
//!
//! 1. `progress`: progress bars
//! 2. `case`: the case file in TOML; its values have types of `fem` where possible
//! 3. `virtual_specimen`: simulated specimens with known parameters
//! 4. `coverage`: coverage of intervals, measured in simulated experiments with known parameters
//! 5. `report`: figures and the HTML report; depends on results, but not on the workflow
//! 6. `prony`: Prony series, fitted to relaxation tests and dynamic tests
//! 7. `workflow`: the stages, which are listed in a table; each key and file that a stage reads is recorded as its
//!    input
//! 8. `study`: several calibrations, and jobs of a cluster
//! 9. `registry`, `cli`: extensions for programs that a user writes, and the command line
//!
//! The modules depend on the crate [`breccia_calibration`]: curves, quantities of interest and calibration models.

mod case;
mod cli;
mod coverage;
mod progress;
mod prony;
mod registry;
pub mod report;
mod study;
mod virtual_specimen;
mod workflow;

pub use breccia_calibration::{
    Belief, BetweenTests, Branch, BranchKind, Calibration, CalibrationError, Compression, Coverage,
    CreepDisplacement, CurveRates, Decimal, Deviation, DisplacementAtPeak, DisplacementAtTime,
    Encoding, EnergyToPeak, Evidence, Expected, Extent, ForceAt, ForceAtTime, FurtherTest,
    FurtherTestError, Goal, Groups, HomogeneousCylinder, HysteresisEnergy, InputError,
    JointCalibration, JointTest, JointTests, Machine, Needed, PeakForce, PeakedCurve, Pooling,
    Population, PostPeakSlope, Prediction, PredictionError, Prior, PriorBounds, PriorFamily,
    PriorKey, Qoi, QoiError, QoiRegistry, Qois, Quantity, ReadOptions, RelativeForce,
    RelaxedFraction, Separator, Slope, Specimen, SpecimenTable, Specimens, TableColumn, TestAtDraw,
    TestCurve, TestDraws, TestGroup, Trend, Unit, UnloadingSlope, calibrate, calibrate_after,
    calibrate_groups, calibrate_tests, calibration_of_draws, calibration_on,
    calibration_over_groups, calibration_over_tests, hyperelastic, tension, viscoplastic,
};
use breccia_calibration::{
    budget, curve_check, error, experiment, fracture, further_test, machine, predicted_curve,
    prior, qoi, record, specimen_files, table, table_format, validation,
};
pub use case::{
    AdaptiveCase, ArcLengthCase, BetweenTestsCase, BoundsCase, ByParameter, CalibrationCase,
    CandidateCase, Case, CaseFile, ConditionsCase, ConfirmCase, DesignCase, DesignSample,
    DiscrepancyCase, ExperimentsCase, ExtendCase, ExtensometerCase, FidelityCase,
    FreeParameterCase, FurtherTestsCase, HardeningCase, HardeningTable, ImageCase, InterfaceCase,
    LevelCase, Likelihood, MachineCase, MaterialCase, MeasureCase, Microstructure, NoiseCase,
    OutputCase, Parameter, PlasticCase, PrescribeCase, PressureCase, PressureKind, PriorCase,
    ProgramPointCase, QoiCase, SequentialCase, SimulationParts, SimulatorCase, SingleTest,
    SpecimenCase, SpecimenGeometry, SurrogateCase, Target, TargetError, TestCase, TestEntry,
    TimeTable, Toe, TractionCase, ValidationCase, VirtualCase, YieldRow,
};
pub use cli::program;
pub use coverage::{CoverageRow, CoverageStudy, Emulated, KnownStiffness, Laboratory, Setting};
pub use prony::{MeasuredModuli, PronyFit, PronySeries, PronyTerm, prony_picture};
pub use registry::Registry;
pub use study::{
    PartCheck, PartStatus, Reference, SlurmError, SlurmJobs, Study, StudyCase, StudyCheck,
    StudyFile, StudyJob, StudyLaboratory, StudyPart, StudySetting, Submitted, study_status,
};
pub use virtual_specimen::VirtualSpecimen;
pub use workflow::{
    CaseCheck, DeviceChoice, ExpectedCost, FolderAccess, InputInPlace, JointWorkflow, RunCounts,
    STAGES, SimulatedLaboratories, Stage, StageState, StageStatus, SurfaceOptions, Workflow,
    WorkflowError, create_file, missing_case, simulate, simulate_laboratories, status,
};
