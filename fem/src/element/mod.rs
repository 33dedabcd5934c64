//! Linear and quadratic tetrahedra: shape functions, integration rules, and the space on a mesh.

mod domain;
mod geometry;
mod quadrature;
mod rule;
mod space;
mod tetrahedron;
mod triangle;

pub use domain::PointValues;
pub use tetrahedron::Order;

pub(crate) use domain::Domain;
pub(crate) use geometry::Geometry;
pub(crate) use rule::{DamageRule, Rule};
pub(crate) use space::Space;
pub(crate) use tetrahedron::{Linear, Quadratic, Tetrahedron};
