//! Basis of the expansion: coordinates, one-dimensional polynomials and their products.

pub(crate) mod legendre;
pub(crate) mod multi_index;
pub(crate) mod scale;
