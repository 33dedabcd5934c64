//! Checks of the specimens that the runs of the design use.

use super::super::{CaseFile, Microstructure, SpecimenGeometry};
use crate::error::InputError;

impl CaseFile {
    pub(super) fn check_microstructures(
        &self,
        geometry: &SpecimenGeometry,
    ) -> Result<(), InputError> {
        let (design, whole) = (&self.case.design, "a whole number");
        let runs = design.runs as f64;
        if let SpecimenGeometry::Image { further, .. } = geometry
            && design.microstructure == Microstructure::PerRun
        {
            let images = 1 + further.len();
            let help = format!("The case names {images} images, each of which needs a run.");
            self.within("design.runs", runs, images as f64, 1e6, "runs", &help)?;
        }
        let Some(packings) = design.packings else { return Ok(()) };
        let key = "design.packings";
        let refuse =
            |problem: &str, help: &str| Err(self.error(key, packings.to_string(), problem, help));
        if design.microstructure == Microstructure::One {
            let help = "Remove one of the two: with microstructure = \"one\" there is one.";
            return refuse("stands beside design.microstructure = \"one\"", help);
        }
        let is_packing = |geometry: &SpecimenGeometry| matches!(geometry, SpecimenGeometry::Cylinder { grains: Some(own), .. } if own.fraction > 0.0);
        if !is_packing(geometry) {
            let help = "Leave it out. Images of several specimens are named in specimen.image.further_stacks.";
            return refuse("is of specimens that a packing describes", help);
        }
        let help = "From two on they show how they scatter, the more the better: leave the key out for a packing \
                    of its own for each run. One alone is design.microstructure = \"one\".";
        self.within(key, packings as f64, 2.0, runs, whole, help)
    }
}
