//! Results of a run: the curve, its file, and the end of the run.

mod file;
mod outcome;
mod point;

pub use file::{CurveWriter, read_curve, write_curve};
pub use outcome::{End, Outcome};
pub use point::{CurvePoint, Sensitivities};
