//! Bands of elements with their own toughness around the surfaces between regions.
//!
//! The modules, in the order of their layers:
//!
//! 1. `toughness`: the toughness of a band that has a given effective toughness, in one dimension
//! 2. `interface`: the input data of an interface
//! 3. `bands`: the bands of a mesh

mod bands;
#[expect(clippy::module_inception, reason = "the module is named after its main type")]
mod interface;
mod toughness;

pub(crate) use bands::Bands;
pub use interface::Interface;
pub(crate) use interface::have_same_bands;
