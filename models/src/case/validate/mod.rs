//! Ranges, units and agreement between the keys of a case.

mod calibration;
mod simulation;

use super::{CaseFile, SpecimenGeometry};
use crate::error::{InputError, closest};

impl CaseFile {
    /// Names of the regions whose materials the case must give.
    fn regions(&self, geometry: &SpecimenGeometry) -> Vec<String> {
        match geometry {
            SpecimenGeometry::Mesh { regions, .. } => regions.keys().cloned().collect(),
            SpecimenGeometry::Cylinder { grains: None, .. } => vec!["matrix".into()],
            SpecimenGeometry::Cylinder { .. } | SpecimenGeometry::Image { .. } => {
                vec!["matrix".into(), "grain".into()]
            }
        }
    }

    /// Checks every value.
    pub(super) fn validate(&self) -> Result<(), InputError> {
        let geometry = self.geometry()?;
        self.check_specimen(&geometry)?;
        for region in self.regions(&geometry) {
            if !self.case.material.contains_key(&region) {
                let given: Vec<&str> = self.case.material.keys().map(String::as_str).collect();
                let hint = closest(&region, given.iter().copied())
                    .map(|slip| format!("Is material.{slip} meant? "))
                    .unwrap_or_default();
                return Err(self.error(
                    &format!("material.{region}"),
                    "",
                    "is missing: the specimen has this region",
                    format!("{hint}Add a table [material.{region}]."),
                ));
            }
        }
        for (region, material) in &self.case.material {
            self.check_material(region, material)?;
        }
        self.check_test()?;
        self.check_calibration()?;
        self.check_experiments(&geometry)
    }

    /// Refuses a value outside `lower..=upper`, NaN included.
    fn within(
        &self,
        key: &str,
        value: f64,
        lower: f64,
        upper: f64,
        unit: &str,
        help: &str,
    ) -> Result<(), InputError> {
        if (lower..=upper).contains(&value) {
            return Ok(());
        }
        let problem = format!("must lie between {lower} and {upper} {unit}");
        Err(self.error(key, value.to_string(), problem.trim_end(), help))
    }
}
