//! Specimens with labels given by the user: drawn by hand or computed by another program.

mod corners;
pub(crate) mod parts;
pub(crate) mod rules;
pub(crate) mod specimen;
