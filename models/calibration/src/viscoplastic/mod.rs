//! Viscoplastic metals: round bars in tension through necking, and yield stresses at several strain rates.
//!
//! A bar of a ductile metal necks at its largest load. From then on a strain of the whole bar describes no
//! cross-section of the bar, and a forward model needs finite elements. This module contains the parts of such a
//! calibration that need no finite elements: [`read_bar_curves`] and [`read_rate_tests`] read the tests, [`BarCurve`]
//! computes quantities of interest of a measured or simulated curve, [`VoceJohnsonCook`] is the flow stress, and
//! [`UniformBar`] is the curve of a bar that does not neck. `models/examples/steel_304l.rs` combines these parts with
//! simulations:
//!
//! ```text
//! cargo run --release -p models --example steel_304l -- DIRECTORY
//! ```
//!
//! # Example
//! Largest load of a bar that does not neck, by Considère's condition:
//! ```
//! use breccia_calibration::viscoplastic::VoceJohnsonCook;
//!
//! let law = VoceJohnsonCook {
//!     yield_mpa: 233.2,
//!     saturation_mpa: 1101.0,
//!     rate: 1.946,
//!     c: 0.0398,
//!     reference_per_s: 1e-5,
//! };
//! let strain: f64 = law.uniform_strain(2.7e-4);
//! let engineering_mpa = law.flow_stress_mpa(strain, 2.7e-4) * (-strain).exp();
//! assert!((strain.exp_m1() - 0.560).abs() < 1e-3);
//! assert!((engineering_mpa - 577.7).abs() < 0.2);
//! ```

mod bar_curve;
mod law;
mod rate_test;
mod uniform_bar;

pub use bar_curve::{BarCurve, BarCurveError, BarPeak, read_bar_curves};
pub use law::VoceJohnsonCook;
pub use rate_test::{RateTest, read_rate_tests};
pub use uniform_bar::UniformBar;
