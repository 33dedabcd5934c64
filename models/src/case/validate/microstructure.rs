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
            let help =
                "Remove one of the two: with microstructure = \"one\" there is only one packing.";
            return refuse("cannot be combined with design.microstructure = \"one\"", help);
        }
        let is_packing = |geometry: &SpecimenGeometry| matches!(geometry, SpecimenGeometry::Cylinder { grains: Some(packing), .. } if packing.fraction > 0.0);
        if !is_packing(geometry) {
            let help = "Leave it out. Images of several specimens are named in specimen.image.further_stacks.";
            return refuse("needs a specimen that is described by a packing", help);
        }
        let help = "At least two packings are needed to estimate their scatter, better more. Without this key each run \
                    has its own packing. For a single packing write design.microstructure = \"one\".";
        self.within(key, packings as f64, 2.0, runs, whole, help)
    }
}
