//! Figures of the report, as functions from plain numbers to SVG.
//!
//! Adjacent panels are separate figures, so that a narrow page can place them one below another.

mod chains;
mod curves;
mod density;
mod draw;
mod further;
mod overlay;
mod pairs;
mod quantities;
mod surrogate;
mod validation;

pub(super) use chains::{ranks, traces};
pub(super) use curves::{confirmation, curves, predicted};
pub(super) use further::further;
pub(super) use overlay::{colour_of, overlaid};
pub(super) use pairs::{Place, design, posterior};
pub(super) use quantities::{map_beside_experiments, of_the_ensemble, predictive};
pub(super) use surrogate::orders;
pub(super) use validation::{validated, validated_curves};
