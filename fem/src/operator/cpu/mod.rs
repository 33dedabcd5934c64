//! Element equations on the processor: several elements per SIMD register, chunks of elements distributed to threads.

mod chunk;
mod element_product;
mod evaluate;
mod gather;
mod kinds;
mod lanes;
mod matrix_free;
mod regions;
mod registers;

pub(super) use element_product::ElementProduct;
pub(super) use evaluate::{
    ConfigurationalOf, PointDataOf, ResidualsOf, StatesOf, StressesOf, TangentsOf,
};
pub use gather::{Buffers, Gather};
pub(super) use kinds::{PerKind, for_kind};
#[cfg(test)]
pub(crate) use lanes::dispatch;
pub(super) use lanes::{Pack, Stored, lane_of_row};
pub(super) use matrix_free::MatrixFree;
pub use matrix_free::{SINGLE_FROM, product};
pub use regions::{ElementLaw, state_len};
pub(super) use regions::{Regions, Row};
pub(super) use registers::{Selection, each_register};
