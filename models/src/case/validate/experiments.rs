//! Checks of the specimens, measured or virtual.

use super::super::{CaseFile, Mistakes, Parameter, SpecimenGeometry, VirtualCase};
use crate::error::InputError;

impl CaseFile {
    pub(super) fn check_experiments(&self, geometry: &SpecimenGeometry, mistakes: &mut Mistakes) {
        let Some(experiments) = &self.case.experiments else {
            return;
        };
        if let Some(read) = &experiments.read {
            for (key, factor) in [
                ("displacement_factor", read.displacement_factor),
                ("force_factor", read.force_factor),
            ] {
                if factor.is_some_and(|factor| !(factor.is_finite() && factor > 0.0)) {
                    mistakes.note(Err(self.error(
                        &format!("experiments.read.{key}"),
                        factor.unwrap_or_default().to_string(),
                        "must be positive",
                        "It is what 1 in the file is in mm or N; signs are detected, or stated by compression.",
                    )));
                }
            }
            if read.stop_at.as_ref().is_some_and(|text| text.trim().is_empty()) {
                let help = "Write the text at the start of the first line after the readings, or remove the key.";
                let key = "experiments.read.stop_at";
                mistakes.note(Err(self.error(key, "", "is empty", help)));
            }
            if experiments.virtual_specimens.is_some() {
                mistakes.note(Err(self.error(
                    "experiments.read",
                    "",
                    "cannot be combined with experiments.virtual",
                    "Virtual specimens are not read from files: remove one of the two.",
                )));
            }
        }
        let are_others = experiments.table.is_some() || experiments.virtual_specimens.is_some();
        if let Some(values) = experiments.values.as_ref().filter(|_| are_others) {
            mistakes.note(Err(self.error(
                "experiments.values",
                values.display().to_string(),
                "cannot be combined with another kind of specimens",
                "Keep one of values (measured quantities), table (measured curves) and virtual.",
            )));
        }
        mistakes.note(match (&experiments.table, &experiments.virtual_specimens) {
            // `check_values` checks the table of measured quantities
            (None, None) if experiments.values.is_some() => Ok(()),
            (None, None) => Err(self.error(
                "experiments",
                "",
                "neither table nor virtual is given",
                "Write table = \"specimens.csv\" or virtual = { … }.",
            )),
            (Some(table), Some(_)) => Err(self.error(
                "experiments.table",
                table.display().to_string(),
                "cannot be combined with experiments.virtual",
                "Specimens are either measured or virtual: remove one of the two.",
            )),
            // the existence of the file is checked in `CaseFile::table`, because only the stage `experiments` needs the
            // file
            (Some(_), None) => Ok(()),
            (None, Some(specimens)) => self.check_virtual(specimens, geometry),
        });
    }

    fn check_virtual(
        &self,
        v: &VirtualCase,
        geometry: &SpecimenGeometry,
    ) -> Result<(), InputError> {
        let size = match geometry {
            SpecimenGeometry::Cylinder { radius_mm, height_mm, .. } => {
                Some([*radius_mm, *height_mm])
            }
            SpecimenGeometry::Mesh { .. } | SpecimenGeometry::Block { .. } => None,
            _ => {
                return Err(self.error(
                    "experiments.virtual",
                    "",
                    "needs a cylinder, in which each virtual specimen has its own packing, or a block or a mesh file, \
                     which all virtual specimens share",
                    "Give specimen.radius_mm, height_mm and spacing_mm, or specimen.mesh, instead of an image or STL \
                     files, or test real specimens (experiments.table).",
                ));
            }
        };
        let Some(prior) = &self.case.prior else {
            return Err(self.error(
                "prior",
                "",
                "is missing",
                "Virtual specimens vary the parameters that [prior] calibrates.",
            ));
        };
        self.within(
            "experiments.virtual.specimens",
            v.specimens as f64,
            2.0,
            1000.0,
            "specimens",
            "The paper has 8 curves at 50 °C.",
        )?;
        if v.scans && !matches!(geometry, SpecimenGeometry::Cylinder { scan: Some(_), .. }) {
            return Err(self.error(
                "experiments.virtual.scans",
                "true",
                "there is no scanner",
                "Add a table [specimen.scan], or leave out scans.",
            ));
        }
        if let Some(spacing) = v.spacing_mm {
            let key = "experiments.virtual.spacing_mm";
            let Some([radius_mm, height_mm]) = size else {
                let help = "Remove this key: the virtual specimens have the mesh of [specimen].";
                let problem = "cannot change the elements of a block or of specimen.mesh";
                return Err(self.error(key, spacing.to_string(), problem, help));
            };
            self.check_spacing(key, spacing, radius_mm, height_mm)?;
        }
        if let Some(parameter) = prior.parameters().find(|p| v.truth.get(p).is_none()) {
            return Err(self.error(
                &format!("experiments.virtual.truth.{parameter}"),
                "",
                "is missing",
                "Give the true value of every parameter that [prior] calibrates.",
            ));
        }
        let given = |table: &str, parameter: &Parameter| {
            let key = format!("experiments.virtual.{table}.{parameter}");
            match prior.get(parameter) {
                Some(_) => Ok(key),
                None => Err(self.error(
                    &key,
                    "",
                    "is not calibrated",
                    format!("[prior] has: {}.", prior.names().collect::<Vec<_>>().join(", ")),
                )),
            }
        };
        for (parameter, &value) in v.truth.iter() {
            let key = given("truth", parameter)?;
            self.check_value(&key, &value.to_string(), parameter, value)?;
        }
        for (parameter, &value) in v.scatter.iter() {
            let key = given("scatter", parameter)?;
            self.within(&key, value, 0.0, 1.0, "", "It is relative: 0.03 is 3 %.")?;
        }
        self.within(
            "experiments.virtual.noise.force_n",
            v.noise.force_n,
            0.0,
            1e6,
            "N",
            "It is the standard deviation of one reading.",
        )?;
        self.within(
            "experiments.virtual.noise.displacement_mm",
            v.noise.displacement_mm,
            0.0,
            1.0,
            "mm",
            "It is the standard deviation of one reading.",
        )
    }
}
