//! Number types: single numbers, SIMD lanes, and terms that are recorded for a device.

mod jet;
mod over_scalars;
mod recording;
mod scalar;
mod simd;

pub use jet::Jet;
pub(crate) use over_scalars::{Family, MemberOf, OverScalars};
pub use recording::{Term, begin, functions, statements};
pub use scalar::{Computation, Lanes, Number, POINTS, Round, Scalar, dot};
pub use simd::{REGISTERS, SimdF32, SimdF64, dispatch};
