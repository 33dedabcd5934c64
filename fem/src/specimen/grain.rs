//! One grain: a sphere or a convex polyhedron.

use std::f64::consts::PI;

use super::ConvexPolyhedron;
use crate::mesh::vector::{norm, sub};

/// A grain with exact volume and signed distance.
#[derive(Clone, Debug, PartialEq)]
pub struct Grain {
    /// A point inside, from which `bounding_radius_mm` is measured (mm).
    pub centre: [f64; 3],
    /// The shape.
    pub shape: GrainShape,
}

/// The shape of a grain.
#[derive(Clone, Debug, PartialEq)]
pub enum GrainShape {
    /// A sphere about the grain's centre.
    Sphere {
        /// Its radius (mm).
        radius_mm: f64,
    },
    /// A convex polyhedron around the grain's centre.
    Polyhedron(ConvexPolyhedron),
}

impl Grain {
    /// A spherical grain.
    ///
    /// # Example
    /// ```
    /// let grain = fem::Grain::sphere([0.0, 0.0, 2.0], 0.5);
    /// assert_eq!(grain.signed_distance_mm([0.0, 0.0, 3.0]), 0.5);
    /// ```
    pub fn sphere(centre: [f64; 3], radius_mm: f64) -> Grain {
        Grain { centre, shape: GrainShape::Sphere { radius_mm } }
    }

    /// Exact volume (mm³).
    pub fn volume_mm3(&self) -> f64 {
        match &self.shape {
            GrainShape::Sphere { radius_mm } => 4.0 / 3.0 * PI * radius_mm.powi(3),
            GrainShape::Polyhedron(polyhedron) => polyhedron.volume(),
        }
    }

    /// Exact surface area (mm²).
    pub fn area_mm2(&self) -> f64 {
        match &self.shape {
            GrainShape::Sphere { radius_mm } => 4.0 * PI * radius_mm.powi(2),
            GrainShape::Polyhedron(polyhedron) => polyhedron.area(),
        }
    }

    /// Radius of a sphere about the centre that contains the grain (mm).
    pub fn bounding_radius_mm(&self) -> f64 {
        match &self.shape {
            GrainShape::Sphere { radius_mm } => *radius_mm,
            GrainShape::Polyhedron(polyhedron) => polyhedron.reach(self.centre),
        }
    }

    /// Distance to the grain's surface (mm), negative inside.
    pub fn signed_distance_mm(&self, point: [f64; 3]) -> f64 {
        self.distance_below_mm(point, f64::INFINITY).unwrap_or(f64::INFINITY)
    }

    /// The signed distance, or nothing where it cannot be less than `limit`, which costs less.
    pub(crate) fn distance_below_mm(&self, point: [f64; 3], limit: f64) -> Option<f64> {
        match &self.shape {
            GrainShape::Sphere { radius_mm } => Some(norm(sub(point, self.centre)) - radius_mm),
            GrainShape::Polyhedron(polyhedron) => polyhedron.distance_below(point, limit),
        }
    }
}
