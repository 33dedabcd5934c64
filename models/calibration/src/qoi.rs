//! Quantities of interest of a force–displacement curve. Each quantity is a type that implements [`Qoi`] in a
//! separate file, with a line in [`QoiRegistry::standard`].
//!
//! In layers, lowest first:
//! 1. `unit`, `extent`, `error`: unit of a quantity, part of the curve that a quantity needs,
//!    errors
//! 2. `fits`, `noise`, `line`, `reading`, `peak_window`, `peak`: fits to readings
//! 3. `curve`, `definition`: a curve with its peak, and the interface of a quantity
//! 4. `slope`, `peak_force`, `displacement_at_peak`, `energy_to_peak`: quantities up to the peak
//! 5. `post_peak_slope`, `relative_force`, `force_at`: quantities of the branch past the peak and of the shape
//! 6. `force_at_time`, `relaxed_fraction`, `creep_displacement`, `unloading_slope`, `hysteresis_energy`: quantities of
//!    any branch of a load program, which need no peak
//! 7. `table_column`: quantities that are reported in tables, without a curve
//! 7. `quantity`, `qois`: the registry, and quantities of one curve

mod creep_displacement;
mod curve;
mod definition;
mod displacement_at_peak;
mod energy_to_peak;
mod error;
mod extent;
mod fits;
mod force_at;
mod force_at_time;
mod hysteresis_energy;
mod line;
pub mod noise;
mod peak;
mod peak_force;
mod peak_window;
mod post_peak_slope;
mod qois;
mod quantity;
mod reading;
mod relative_force;
mod relaxed_fraction;
mod slope;
mod table_column;
mod unit;
mod unloading_slope;

#[cfg(test)]
mod program_tests;

pub use creep_displacement::CreepDisplacement;
pub use curve::{CurveRates, PeakedCurve};
pub use definition::{HomogeneousCylinder, Qoi};
pub use displacement_at_peak::DisplacementAtPeak;
pub use energy_to_peak::EnergyToPeak;
pub use error::QoiError;
pub use extent::Extent;
pub use force_at::ForceAt;
pub use force_at_time::{DisplacementAtTime, ForceAtTime};
pub use hysteresis_energy::HysteresisEnergy;
pub use line::{Line, Window, slope_line};
pub use peak_force::PeakForce;
pub use post_peak_slope::PostPeakSlope;
pub use qois::Qois;
pub use quantity::{QoiRegistry, Quantity};
pub use relative_force::RelativeForce;
pub use relaxed_fraction::RelaxedFraction;
pub use slope::Slope;
pub use table_column::TableColumn;
pub use unit::Unit;
pub use unloading_slope::UnloadingSlope;
