//! Measured curves, their quantities of interest, and the calibration models of `models`.
//!
//! This crate calibrates material parameters: it uses curves, surrogates and priors, and computes posteriors. The crate
//! does not depend on cases or simulations. The crate is separate from `models`, which re-exports its interface,
//! because its densities must be compiled with all optimisations, whereas the stages, cases and reports of `models`
//! need none.
//!
//! ```
//! use breccia_calibration::{Qois, TestCurve};
//!
//! let displacement_mm: Vec<f64> = (0..=20).map(|i| 0.01 * i as f64).collect();
//! let force_n = displacement_mm.iter().map(|u| 2000.0 * u - 10_000.0 * u * u).collect();
//! let qois = Qois::of(&TestCurve::new(displacement_mm, force_n), 0.3)?;
//! assert!((qois.peak_force_n - 100.0).abs() < 1e-9);
//! # Ok::<(), breccia_calibration::QoiError>(())
//! ```
//!
//! # Modules
//!
//! The modules form layers, from the lowest to the highest. A module imports only modules of the same layer or of lower
//! layers, and no two files import each other.
//!
//! 1. `error`, `table`, `record`, `table_format`: errors in files, small tables, records of testing machines, tables
//!    saved from spreadsheets
//! 2. `branch`, `bridge`, `prior`, `experiment`, `same_test`, `specimen_files`, `qoi`, `machine`: priors of parameters, specimens with their
//!    curves and files, quantities of interest, testing machines
//! 3. `curve_check`: findings on a measured curve
//! 4. `fracture`, `hyperelastic`, `tension`, `viscoplastic`: calibration models, each the pattern that a user copies, and
//!    parts of a calibration model of metals that neck
//! 5. `budget`, `predicted_curve`: sources of the uncertainty, and the curves that a posterior predicts
//! 6. `further_test`, `validation`: expected benefit of a further test, predictions against held-out specimens

// hidden modules: `models` uses their items but does not re-export them, so that they are not part of the interface
#[doc(hidden)]
pub mod branch;
#[doc(hidden)]
pub mod bridge;
#[doc(hidden)]
pub mod budget;
#[doc(hidden)]
pub mod curve_check;
#[doc(hidden)]
pub mod error;
#[doc(hidden)]
pub mod experiment;
#[doc(hidden)]
pub mod fracture;
#[doc(hidden)]
pub mod further_test;
pub mod hyperelastic;
#[doc(hidden)]
pub mod machine;
#[doc(hidden)]
pub mod predicted_curve;
#[doc(hidden)]
pub mod prior;
#[doc(hidden)]
pub mod qoi;
#[doc(hidden)]
pub mod record;
#[doc(hidden)]
pub mod same_test;
#[doc(hidden)]
pub mod specimen_files;
#[doc(hidden)]
pub mod table;
#[doc(hidden)]
pub mod table_format;
pub mod tension;
#[doc(hidden)]
pub mod validation;
pub mod viscoplastic;

pub use branch::{Branch, BranchKind};
pub use bridge::{BridgeError, MarginalLikelihood, marginal_likelihood};
pub use error::InputError;
pub use experiment::{Specimen, SpecimenTable, TestCurve};
pub use fracture::{
    BetweenTests, Calibration, CalibrationError, Evidence, Groups, JointCalibration, JointTest,
    JointTests, Pooling, Population, PriorSensitivity, Specimens, TestDraws, TestGroup, Trend,
    TrendOverTests, calibrate, calibrate_after, calibrate_groups, calibrate_tests,
    calibration_of_draws, calibration_on, calibration_over_groups, calibration_over_tests,
};
pub use further_test::{
    AlikeTest, Belief, Expected, FurtherTest, FurtherTestError, Goal, Needed, TestAtDraw,
};
pub use machine::Machine;
pub use prior::{Prior, PriorBounds, PriorFamily, PriorKey};
pub use qoi::{
    CreepDisplacement, CurveRates, DisplacementAtPeak, DisplacementAtTime, EnergyToPeak, Extent,
    ForceAt, ForceAtTime, HomogeneousCylinder, HysteresisEnergy, PeakForce, PeakedCurve,
    PostPeakSlope, Qoi, QoiError, QoiRegistry, Qois, Quantity, RelativeForce, RelaxedFraction,
    Slope, TableColumn, Unit, UnloadingSlope,
};
pub use record::{Compression, Decimal, Encoding, ReadOptions, Separator};
pub use validation::{
    Coverage, Deviation, HeldOutScores, HeldOutValue, Prediction, PredictionError,
};
