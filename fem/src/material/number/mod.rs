//! Number types: single numbers, SIMD lanes, and terms that are recorded for a device.

mod recording;
mod scalar;
mod simd;

pub use recording::{Term, begin, functions, statements};
pub use scalar::{Lanes, Number, POINTS, Round, Scalar, dot};
pub use simd::{REGISTERS, SimdF32, SimdF64, dispatch};
