//! Boundary conditions: prescribed values, symmetry, loads, rigid platens.
//!
//! The modules, in the order of their layers:
//!
//! 1. `function`, `gauge`, `reaction`, `rigid`: functions of place and time, points, supports, rigid motions
//! 2. `constraint`, `contact`, `loads`, `node_set`, `pressure`: single conditions
//! 3. `conditions`: conditions as the user states them
//! 4. `compiled`: conditions on the nodes of a mesh
//! 5. `external`: loads and contact of an increment

mod compiled;
mod conditions;
mod constraint;
mod contact;
mod external;
mod function;
mod gauge;
mod loads;
mod node_set;
mod pressure;
mod reaction;
mod rigid;

pub use conditions::{Axis, Conditions};
pub use contact::{ContactPoint, Platen};
pub use node_set::NodeSet;

pub(crate) use compiled::{Boundary, DrivenPlaten};
pub(crate) use contact::Contact;
pub(crate) use external::ExternalForces;
