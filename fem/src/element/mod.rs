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

pub use domain::Domain;
pub use geometry::Geometry;
pub use rule::{DamageRule, ExtraTerms, Rule};
pub use space::Space;
pub use tetrahedron::{Linear, Quadratic, Tetrahedron};
pub(crate) use triangle::seven;
