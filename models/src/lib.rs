//! Experiments, quantities of interest, calibration models, cases and the workflow of Breccia.
//!
//! This crate connects the other crates. Simulations (`fem`) give a dataset. A surrogate is fitted to the dataset. The
//! surrogate and the measured curves give a posterior (`ppl`). The program `breccia` is the command line of this crate.
//!
//! A calibration without the program: runs of a simulation, a surrogate, and the measured quantities of specimens.
//!
//! ```
//! use models::{Evidence, Prior, calibrate};
//! use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, Input};
//!
//! // in practice a finite-element simulation: slope and peak force of a test, from stiffness and strength
//! let simulate = |x: &[f64]| [x[0], x[1] * (x[0] / 1000.0).sqrt()];
//! let inputs = vec![Input::new("stiffness", 800.0, 1200.0)?, Input::new("strength", 40.0, 60.0)?];
//! let points = DesignMethod::LatinHypercube.sample(&inputs, 30, 1)?;
//! let mut runs = Dataset::new(inputs, vec!["slope_N_per_mm".into(), "peak_force_N".into()], "example")?;
//! points.iter().try_for_each(|x| runs.push(x, &simulate(x)))?;
//! let pce = DynPce::fit(&runs, &FitOptions::default())?.pce;
//! let measured = [[985.0, 50.8], [1012.0, 49.3], [1004.0, 50.9], [992.0, 49.6], [1021.0, 49.1], [986.0, 50.3]];
//! let evidence = Evidence { qois: measured.map(Vec::from).to_vec(), ..Evidence::default() };
//! let sampler = ppl::Nuts::default().seed(7);
//! let result = calibrate(&pce, &Prior::uniform_on(pce.inputs()), &evidence, &sampler, 7)?;
//! println!("{}", result.posterior.summary());
//! // the means of the specimens are 1000 N/mm and 50 N
//! assert!((result.map[0] - 1000.0).abs() < 20.0 && (result.map[1] - 50.0).abs() < 1.0);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! The program calibrates a case, which `breccia init` writes: see [`Workflow`]. [`program`] is the program with quantities
//! of interest ([`Qoi`]), parameters ([`Target`]), stages ([`Stage`]) and sections of the report ([`ReportSection`]) of your own. The keys of a case are in [`case`], studies in [`study`],
//! stages in [`workflow`], and further calibration models in [`calibration`].
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
//! 7. `results_folder`: files of a results folder, and who wrote them
//! 8. `simulation`: one simulation of the test of a case
//! 9. `pipeline`: inputs and products of a running stage; each key and file that a stage reads is recorded as its input
//! 10. `experiments`: measured and virtual specimens
//! 11. `specimen`: image, grains and mesh of a simulation
//! 12. `runs`: the simulations of an ensemble
//! 13. `forward`: surrogate, its errors, and predictions from the posterior
//! 14. `rules`: rules on results that restrict the verdict "identified"
//! 15. `stages`: the stages, and their table
//! 16. `check`: what `breccia check` reports
//! 17. `workflow`: a case and its results folder; commands that continue, report, copy and share it
//! 18. `study`: several calibrations, and jobs of a cluster
//! 19. `registry`, `cli`: extensions for programs that a user writes, and the command line
//!
//! The modules depend on the crate [`breccia_calibration`], which is the module [`calibration`]: curves, quantities of
//! interest and calibration models.

pub mod case;
mod check;
mod cli;
pub mod coverage;
mod experiments;
mod forward;
mod pipeline;
mod progress;
pub mod prony;
mod registry;
pub mod report;
mod results_folder;
mod rules;
mod runs;
mod simulation;
mod specimen;
mod stages;
pub mod study;
mod virtual_specimen;
pub mod workflow;

pub use breccia_calibration as calibration;
pub use breccia_calibration::{
    Calibration, CalibrationError, Evidence, InputError, PeakedCurve, Pooling, Population, Prior,
    Qoi, QoiError, Qois, Quantity, Specimens, TestCurve, TestGroup, Trend, Unit, calibrate,
    calibrate_groups, calibration_on, hyperelastic, tension, viscoplastic,
};
use breccia_calibration::{
    bridge, budget, curve_check, error, experiment, fracture, further_test, machine,
    predicted_curve, prior, qoi, record, same_test, specimen_files, table, table_format,
    validation,
};
pub use case::{Case, CaseFile, SimulationParts, Target, TargetError, VirtualCase};
pub use cli::program;
pub use pipeline::extensions::ReportSection;
pub use pipeline::task::Task;
pub use registry::Registry;
pub use study::{Study, StudyCase, StudyFile};
pub use workflow::{
    FolderAccess, JointWorkflow, STAGES, Stage, Workflow, WorkflowError, simulate_laboratories,
};
