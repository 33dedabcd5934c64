//! Boundary conditions of a body that is not compressed between platens.

use fem::{Axis, Conditions};
use serde::{Deserialize, Serialize};

/// `[conditions]`: boundary conditions on named surfaces, instead of platens. Displacements and loads are values at the
/// end of the test; they grow in proportion to the time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ConditionsCase {
    /// Surfaces with prescribed displacement or damage.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub prescribe: Vec<PrescribeCase>,
    /// Plane surfaces normal to an axis whose nodes stay in the plane.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub symmetry: Vec<String>,
    /// Surfaces with a dead load.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub traction: Vec<TractionCase>,
    /// Force per reference volume in N/mm³.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body_force_n_per_mm3: Option<[f64; 3]>,
    /// Whether to fix single nodes so that the remaining rigid motions are prevented. The loads must balance along
    /// these motions.
    #[serde(default)]
    pub remove_rigid_motions: bool,
    /// Surface and direction for which the curve of force and displacement is recorded.
    pub measure: MeasureCase,
}

/// An entry of `conditions.prescribe`. Components without a value remain free.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PrescribeCase {
    /// The surface.
    pub surface: String,
    /// Displacement along x in mm at the end of the test.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub x_mm: Option<f64>,
    /// Displacement along y in mm at the end of the test.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub y_mm: Option<f64>,
    /// Displacement along z in mm at the end of the test.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub z_mm: Option<f64>,
    /// Damage, constant during the test.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damage: Option<f64>,
}

/// An entry of `conditions.traction`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TractionCase {
    /// The surface.
    pub surface: String,
    /// Force per reference area in MPa at the end.
    pub vector_mpa: [f64; 3],
}

/// `conditions.measure`: force and mean displacement of a surface along a direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MeasureCase {
    /// The surface.
    pub surface: String,
    /// The direction: a vector of any length.
    pub direction: [f64; 3],
}

impl PrescribeCase {
    /// Prescribed displacement along each axis in mm; `None` for a free component.
    pub(super) fn components(&self) -> [Option<f64>; 3] {
        [self.x_mm, self.y_mm, self.z_mm]
    }
}

impl ConditionsCase {
    /// Converts to the conditions of `fem` for a test of the given duration in seconds.
    pub(crate) fn in_fem(&self, duration_s: f64) -> Conditions {
        // this order of operations gives exactly the full value at the end of the test
        let grown = move |full: [f64; 3], time_s: f64| full.map(|f| time_s / duration_s * f);
        let mut all = Conditions::new().described_as(format!("{self:?} in {duration_s} s"));
        for entry in &self.prescribe {
            let components = entry.components();
            let axes = Axis::ALL.into_iter().filter(|&axis| components[axis as usize].is_some());
            let full = components.map(|c| c.unwrap_or(0.0));
            all = all.prescribe(&entry.surface, axes, move |_, time_s| grown(full, time_s));
            if let Some(damage) = entry.damage {
                all = all.prescribe_damage(&entry.surface, move |_, _| damage);
            }
        }
        for surface in &self.symmetry {
            all = all.symmetry(surface);
        }
        for TractionCase { surface, vector_mpa } in &self.traction {
            let full = *vector_mpa;
            all = all.traction(surface, move |_, time_s| grown(full, time_s));
        }
        if let Some(full) = self.body_force_n_per_mm3 {
            all = all.body_force(move |_, time_s| grown(full, time_s));
        }
        if self.remove_rigid_motions {
            all = all.remove_rigid_motions();
        }
        all.measure(&self.measure.surface, self.measure.direction)
    }
}
