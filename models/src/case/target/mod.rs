//! Targets: numbers of a case that can be calibrated. Each target is a type that implements [`Target`], and an entry of
//! the registry.
//!
//! In layers, lowest first:
//! 1. `definition`: the interface of a target, and the parts of a case that it can change
//! 2. `material`, `inelastic`, `interface`, `number`: targets that are constants of materials, toughnesses of interfaces,
//!    and other numbers of a case
//! 3. `registry`: the registry, which finds the target of a path
//! 4. `free`: parameters of a simulator outside this program

mod definition;
mod free;
mod inelastic;
mod interface;
mod material;
mod number;
mod registry;

pub use definition::{SimulationParts, Target, TargetError};
pub(crate) use free::FreeParameter;
pub(crate) use inelastic::InelasticConstant;
pub(crate) use interface::TOUGHNESS;
pub(crate) use material::Property;
pub use registry::Parameter;
pub(crate) use registry::TargetRegistry;
