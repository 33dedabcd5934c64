//! Boundary-value problems, followed through time: conditions and parameters in, curve and fields
//! out. The unconfined compression test is one of them.

mod arc_length;
mod checkpoint;
mod compression_test;
mod curve;
mod curve_file;
mod discretisation;
mod loading;
mod march;
mod memory;
#[expect(clippy::module_inception, reason = "the room is named after what it is for")]
mod problem;
mod timing;

pub use checkpoint::Checkpoint;
pub use compression_test::{CompressionTest, Friction, Platens};
pub use curve::{CurvePoint, End, Observer, Outcome};
pub use curve_file::{CurveWriter, read_curve, write_curve};
pub use loading::{Loading, Schedule, Stepping};
pub use problem::Problem;
pub use timing::{PartTimes, ProductTimes};
