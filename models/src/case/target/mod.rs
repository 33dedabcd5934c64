//! Numbers of a case that a calibration can determine. Each is a type that implements [`Target`] and a line in a
//! registry.
//!
//! In layers, lowest first:
//! 1. `definition`: the interface of a target, and the parts of a case that it can change
//! 2. `material`, `number`: constants of materials, and other numbers of a case
//! 3. `registry`: a target with its path, found in the registry

mod definition;
mod material;
mod number;
mod registry;

pub use definition::{SimulationParts, Target, TargetError};
pub(crate) use material::Property;
pub use registry::Parameter;
pub(crate) use registry::TargetRegistry;
