//! The figures of the report, each from plain numbers to SVG.
//!
//! Panels that stand beside each other are figures of their own, so that a narrow page can put them one
//! under the other.

mod chains;
mod curves;
mod density;
mod draw;
mod further;
mod overlay;
mod pairs;
mod quantities;
mod surrogate;

pub(super) use chains::{ranks, traces};
pub(super) use curves::{confirmation, curves};
pub(super) use further::further;
pub(super) use overlay::overlaid;
pub(super) use pairs::{Place, design, posterior};
pub(super) use quantities::{map_beside_experiments, of_the_ensemble, predictive};
pub(super) use surrogate::orders;
