//! Rigid bodies in contact with a specimen.

use nalgebra::{Matrix3, Vector3};

use crate::boundary::function::Function;
use crate::error::FemError;

/// Shape of a platen, with its position at time zero, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Shape {
    Plane { point: [f64; 3], normal: [f64; 3] },
    Sphere { centre: [f64; 3], radius: f64 },
}

/// Rigid platen that a surface can touch, slide on, and leave.
///
/// With the gap g (mm) between platen and specimen, the contact pressure p (MPa) satisfies p ≥ 0, g ≥ 0, p g = 0.
/// Sliding with the velocity v_t (mm/s) causes the traction −(μ p s_ε + F_v) v_t on the specimen, with
/// s_ε = 1/√(|v_t|² + ε²). The first term is Coulomb friction with the coefficient μ; below the slip velocity ε, the specimen creeps
/// instead of sticking. The second term is a viscous drag F_v. Pressures and tractions are per reference area. Without
/// friction and drag, the default, a platen is a roller: it presses along its normal, and the surface slides freely.
///
/// # Example
/// ```
/// // presses down on z = 4.4 mm at 0.22 mm/s, with a coefficient of friction of 0.1
/// let platen = fem::Platen::plane([0.0, 0.0, 4.4], [0.0, 0.0, -1.0])
///     .moving(|time_s| [0.0, 0.0, -0.22 * time_s])
///     .friction(0.1, 1e-3);
/// # let _ = platen;
/// ```
///
/// References: Wriggers, Computational Contact Mechanics, 2nd ed. (2006), doi:10.1007/978-3-540-32609-0,
/// ch. 5 and 6; Chouly & Hild, Appl. Numer. Math. 65 (2013) 27, doi:10.1016/j.apnum.2012.10.003.
#[derive(Clone, Debug)]
pub struct Platen {
    shape: Shape,
    travel: Option<Function<[f64; 3]>>,
    pub(super) friction: f64,
    pub(super) slip_velocity: f64,
    pub(super) drag: f64,
}

/// Gap between a point and a platen, with the derivatives of the gap with respect to the position of the point.
pub(super) struct Proximity {
    /// Distance of the point from the platen, mm; negative inside the platen.
    pub(super) gap: f64,
    /// First derivative ∂gap/∂x, the unit normal of the platen.
    pub(super) normal: Vector3<f64>,
    /// Second derivative ∂²gap/∂x², 1/mm.
    pub(super) curvature: Matrix3<f64>,
}

impl Platen {
    /// Creates a half-space bounded by the plane through `point_mm`; `normal` (any length) points towards the
    /// specimen.
    pub fn plane(point_mm: [f64; 3], normal: [f64; 3]) -> Self {
        Self::at_rest(Shape::Plane { point: point_mm, normal })
    }

    /// Creates a sphere, which the specimen touches from outside.
    pub fn sphere(centre_mm: [f64; 3], radius_mm: f64) -> Self {
        Self::at_rest(Shape::Sphere { centre: centre_mm, radius: radius_mm })
    }

    fn at_rest(shape: Shape) -> Self {
        Self { shape, travel: None, friction: 0.0, slip_velocity: 1.0, drag: 0.0 }
    }

    /// Sets the motion: the displacement (mm) as a function of time (s), which must be zero at time zero.
    pub fn moving(mut self, travel_mm: impl Fn(f64) -> [f64; 3] + Send + Sync + 'static) -> Self {
        self.travel = Some(Function::new(move |_, time_s| travel_mm(time_s)));
        self
    }

    /// Sets Coulomb's coefficient μ, and the slip velocity ε (mm/s) below which friction decreases to zero.
    pub fn friction(mut self, coefficient: f64, slip_velocity_mm_per_s: f64) -> Self {
        self.friction = coefficient;
        self.slip_velocity = slip_velocity_mm_per_s;
        self
    }

    /// Sets the viscous drag F_v at the nodes in contact, MPa s/mm.
    pub fn drag(mut self, drag_mpa_s_per_mm: f64) -> Self {
        self.drag = drag_mpa_s_per_mm;
        self
    }

    /// Returns whether the platen has friction or drag.
    pub(crate) fn resists_sliding(&self) -> bool {
        self.friction > 0.0 || self.drag > 0.0
    }

    /// Returns the displacement at a time, mm.
    pub(super) fn travel(&self, time_s: f64) -> Vector3<f64> {
        self.travel.as_ref().map_or([0.0; 3], |f| f.at([0.0; 3], time_s)).into()
    }

    pub(crate) fn validate(&self, surface: &str) -> Result<(), FemError> {
        let entity = format!("platen on surface '{surface}'");
        let check = |holds: bool, field, value, requirement| {
            if holds {
                Ok(())
            } else {
                Err(FemError::parameter(&entity, field, value, requirement))
            }
        };
        match self.shape {
            Shape::Plane { normal, .. } => {
                let length = Vector3::from(normal).norm();
                check(
                    length > 0.0 && length.is_finite(),
                    "normal",
                    length,
                    "a vector of positive, finite length",
                )?;
            }
            Shape::Sphere { radius, .. } => {
                let holds = radius > 0.0 && radius.is_finite();
                check(holds, "radius_mm", radius, "a positive radius in mm")?;
            }
        }
        let not_negative = |x: f64| x >= 0.0 && x.is_finite();
        check(
            not_negative(self.friction),
            "friction",
            self.friction,
            "zero or positive, such as 0.2",
        )?;
        check(not_negative(self.drag), "drag_mpa_s_per_mm", self.drag, "zero or positive")?;
        let slip = self.slip_velocity;
        check(
            slip > 0.0 && slip.is_finite(),
            "slip_velocity_mm_per_s",
            slip,
            "a positive velocity in mm/s",
        )
    }

    /// Returns the length (mm) to which the rounding error of a gap is proportional, in addition to the
    /// rounding errors of the displacements. The length is zero for a plane.
    pub(super) fn rounded_mm(&self) -> f64 {
        match self.shape {
            Shape::Plane { .. } => 0.0,
            Shape::Sphere { centre, radius } => Vector3::from(centre).norm() + radius,
        }
    }

    /// Returns gap, normal and curvature at a point. `x` is the reference position of the point, and `moved` its
    /// displacement relative to the platen, mm.
    ///
    /// The gap of a plane is computed as initial gap plus motion along the normal. This sum retains the digits of a
    /// small motion, which would be lost if position and motion were added first.
    pub(super) fn proximity(&self, x: Vector3<f64>, moved: Vector3<f64>) -> Proximity {
        match self.shape {
            Shape::Plane { point, normal } => {
                let normal = Vector3::from(normal).normalize();
                let gap = normal.dot(&(x - Vector3::from(point))) + normal.dot(&moved);
                Proximity { gap, normal, curvature: Matrix3::zeros() }
            }
            Shape::Sphere { centre, radius } => {
                let from = x - Vector3::from(centre) + moved;
                let distance = from.norm().max(f64::MIN_POSITIVE);
                let normal = from / distance;
                let curvature = (Matrix3::identity() - normal * normal.transpose()) / distance;
                Proximity { gap: distance - radius, normal, curvature }
            }
        }
    }
}
