//! A grain: a sphere or a convex polyhedron.

use std::f64::consts::PI;

use super::polyhedron::ConvexPolyhedron;
use crate::mesh::vector::{norm, scale, sub};

/// A grain with exact volume and exact signed distance.
#[derive(Clone, Debug, PartialEq)]
pub struct Grain {
    /// A point inside the grain (mm), which is the centre of the grain's bounding sphere.
    pub centre: [f64; 3],
    /// Shape of the grain.
    pub shape: GrainShape,
}

/// The shape of a grain.
#[derive(Clone, Debug, PartialEq)]
pub enum GrainShape {
    /// A sphere about the grain's centre.
    Sphere {
        /// Radius of the sphere (mm).
        radius_mm: f64,
    },
    /// A convex polyhedron around the grain's centre.
    Polyhedron(ConvexPolyhedron),
}

impl Grain {
    /// Creates a spherical grain from its centre and radius (mm).
    ///
    /// # Example
    /// ```
    /// let grain = fem_mesh::Grain::sphere([0.0, 0.0, 2.0], 0.5);
    /// assert_eq!(grain.signed_distance_mm([0.0, 0.0, 3.0]), 0.5);
    /// ```
    pub fn sphere(centre: [f64; 3], radius_mm: f64) -> Grain {
        Grain { centre, shape: GrainShape::Sphere { radius_mm } }
    }

    /// Returns the exact volume (mm³).
    pub fn volume_mm3(&self) -> f64 {
        match &self.shape {
            GrainShape::Sphere { radius_mm } => 4.0 / 3.0 * PI * radius_mm.powi(3),
            GrainShape::Polyhedron(polyhedron) => polyhedron.volume(),
        }
    }

    /// Returns the exact surface area (mm²).
    pub fn area_mm2(&self) -> f64 {
        match &self.shape {
            GrainShape::Sphere { radius_mm } => 4.0 * PI * radius_mm.powi(2),
            GrainShape::Polyhedron(polyhedron) => polyhedron.area(),
        }
    }

    /// Returns the radius of a sphere around `centre` that contains the grain (mm).
    pub fn bounding_radius_mm(&self) -> f64 {
        match &self.shape {
            GrainShape::Sphere { radius_mm } => *radius_mm,
            GrainShape::Polyhedron(polyhedron) => polyhedron.reach(self.centre),
        }
    }

    /// Returns whether the entire grain lies in a cylinder with its bottom at z = 0 and its axis on z (dimensions in
    /// mm).
    pub(crate) fn is_inside(&self, radius: f64, height: f64) -> bool {
        let tolerance = 1e-9 * radius;
        let holds = |[x, y, z]: [f64; 3], reach: f64| {
            x.hypot(y) + reach <= radius + tolerance
                && z >= reach - tolerance
                && z + reach <= height + tolerance
        };
        match &self.shape {
            GrainShape::Sphere { radius_mm } => holds(self.centre, *radius_mm),
            GrainShape::Polyhedron(polyhedron) => polyhedron.corners().all(|p| holds(p, 0.0)),
        }
    }

    /// Returns the signed distance to the grain's surface (mm), negative inside.
    pub fn signed_distance_mm(&self, point: [f64; 3]) -> f64 {
        self.nearest_below_mm(point, f64::INFINITY).map_or(f64::INFINITY, |(distance, _)| distance)
    }

    /// Returns the signed distance to the grain's surface (mm) and its gradient. To save time, the result may be `None`
    /// if the distance is not less than `limit`.
    pub(crate) fn nearest_below_mm(&self, point: [f64; 3], limit: f64) -> Option<(f64, [f64; 3])> {
        match &self.shape {
            GrainShape::Sphere { radius_mm } => {
                let apart = sub(point, self.centre);
                let length = norm(apart);
                let gradient = if length > 0.0 { scale(apart, 1.0 / length) } else { [0.0; 3] };
                Some((length - radius_mm, gradient))
            }
            GrainShape::Polyhedron(polyhedron) => polyhedron.nearest_below(point, limit),
        }
    }
}
