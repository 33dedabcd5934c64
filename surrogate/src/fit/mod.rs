//! Fit of an expansion: least squares, its leave-one-out error, and the choice of order, scale and terms.

pub(crate) mod design_matrix;
pub(crate) mod leave_out;
pub(crate) mod options;
pub(crate) mod orders;
pub(crate) mod regression;
pub(crate) mod report;
pub(crate) mod scale_choice;
pub(crate) mod select;
pub(crate) mod sparse;
pub(crate) mod weights;
