//! Specimens that the user has labelled, in a program for segmentation or by hand.

pub(crate) mod parts;
pub(crate) mod rules;
pub(crate) mod specimen;
