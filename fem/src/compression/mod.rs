//! The unconfined compression test: mesh and parameters in, curve and fields out.

mod arc_length;
mod checkpoint;
mod curve;
mod curve_file;
mod discretisation;
mod loading;
mod march;
mod memory;
mod test;
mod timing;

pub use checkpoint::Checkpoint;
pub use curve::{CurvePoint, End, Fields, Observer, Outcome};
pub use curve_file::{CurveWriter, read_curve, write_curve};
pub use loading::{Loading, Schedule, Stepping};
pub use test::{CompressionTest, Friction, Platens};
pub use timing::{PartTimes, ProductTimes};

pub(crate) use arc_length::check_arc_length;
pub(crate) use checkpoint::Fingerprint;
pub(crate) use discretisation::Discretisation;
pub(crate) use march::March;
