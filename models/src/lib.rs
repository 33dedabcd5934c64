//! Experiments, quantities of interest, calibration models, cases and the workflow of Breccia.
//!
//! This crate joins the others: simulations (`fem`) become a dataset, the dataset a surrogate, and the
//! surrogate with the experiments' curves a posterior (`ppl`). The program `breccia` is its front end.
//!
//! ```
//! use models::{CaseFile, TestCurve, Qois};
//!
//! let file = CaseFile::default_case();                      // what `breccia init` writes
//! let displacement_mm: Vec<f64> = (0..=20).map(|i| 0.01 * i as f64).collect();
//! let force_n = displacement_mm.iter().map(|u| 2000.0 * u - 10_000.0 * u * u).collect();
//! let curve = TestCurve { displacement_mm, force_n };
//! let qois = Qois::of(&curve, file.case.qoi.slope_fraction)?;
//! assert!((qois.peak_force_n - 100.0).abs() < 1e-9);
//! # Ok::<(), models::QoiError>(())
//! ```
//!
//! # Rooms
//!
//! From the ground up; an import goes down only, and no two files import each other.
//!
//! 1. `error`, `table`, `progress`, `record`: mistakes in files, small tables, bars, records of testing machines
//! 2. `experiment`, `qoi`: specimens with their curves, quantities of interest
//! 3. `curve_check`: what a look at a measured curve shows
//! 4. `case`: the TOML case, with fem's own types where they are the same
//! 5. `virtual_specimen`: specimens with a known truth
//! 6. `fracture`, `hyperelastic`, `tension`: calibration models, each the pattern that a user copies
//! 7. `coverage`, `budget`, `predicted_curve`: whether intervals hold what they promise, what widens them, and the
//!    curves that they predict
//! 8. `further_test`: what would make them narrower
//! 9. `report`: figures and the page; knows results, not the workflow
//! 10. `workflow`: stages, one row of a table each, whose inputs are what they read
//! 11. `study`: beyond one process and one case: several calibrations, jobs of a cluster

mod budget;
mod case;
mod coverage;
mod curve_check;
mod error;
mod experiment;
mod fracture;
mod further_test;
pub mod hyperelastic;
mod predicted_curve;
mod progress;
mod qoi;
mod record;
pub mod report;
mod study;
mod table;
pub mod tension;
mod virtual_specimen;
mod workflow;

pub use case::{
    AdaptiveCase, ArcLengthCase, ByParameter, CalibrationCase, CandidateCase, Case, CaseFile,
    ConditionsCase, ConfirmCase, DesignCase, DiscrepancyCase, ExperimentsCase, ExtendCase,
    FidelityCase, FurtherTestsCase, ImageCase, LevelCase, Likelihood, MaterialCase,
    MaterialParameter, MeasureCase, Microstructure, NoiseCase, OutputCase, PrescribeCase,
    PriorBounds, PriorCase, Property, QoiCase, SequentialCase, SpecimenCase, SpecimenGeometry,
    SurrogateCase, TestCase, Toe, TractionCase, VirtualCase,
};
pub use coverage::{CoverageRow, CoverageStudy, Emulated, KnownStiffness, Laboratory, Setting};
pub use error::InputError;
pub use experiment::{Specimen, SpecimenTable, TestCurve};
pub use fracture::{
    Calibration, CalibrationError, Evidence, Groups, Pooling, Population, Specimens, TestGroup,
    Trend, calibrate, calibrate_after, calibrate_groups, calibration, calibration_on,
    calibration_over_groups,
};
pub use further_test::{Belief, Expected, FurtherTest, FurtherTestError, Goal, Needed, TestAtDraw};
pub use qoi::{QoiError, Qois, Quantity};
pub use record::{Compression, Decimal, Encoding, ReadOptions, Separator};
pub use study::{
    PartStatus, Reference, SlurmError, SlurmJobs, Study, StudyCase, StudyFile, StudyJob,
    StudyLaboratory, StudyPart, StudySetting, Submitted, study_status,
};
pub use virtual_specimen::VirtualSpecimen;
pub use workflow::{
    DeviceChoice, RunCounts, STAGES, SimulatedLaboratories, Stage, StageState, StageStatus,
    Workflow, WorkflowError, simulate, simulate_laboratories, status,
};
