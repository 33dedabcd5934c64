//! Checks of a case: ranges, units and consistency of its keys.

mod calibration;
mod conditions;
mod experiments;
mod interface;
mod machine;
mod microstructure;
mod outside;
mod prior;
mod program;
mod several_tests;
mod simulation;
mod test_kind;
mod validation;

use fem::VOID;

use interface::{WrongInterface, check_interface};

use super::{CaseFile, Mistakes, SpecimenGeometry};
use crate::error::{InputError, closest};
use machine::check_machine;
use several_tests::check_tests;
use validation::check_validation;

/// Regions that may have a material although the specimen does not have the region.
const USUAL_REGIONS: [&str; 2] = ["matrix", "grain"];

impl CaseFile {
    /// Names of the regions whose materials the case must give.
    pub(crate) fn regions(&self, geometry: &SpecimenGeometry) -> Vec<String> {
        match geometry {
            SpecimenGeometry::Absent => Vec::new(),
            SpecimenGeometry::Mesh { regions, .. } => regions.keys().cloned().collect(),
            SpecimenGeometry::Cylinder { grains: None, .. } | SpecimenGeometry::Block { .. } => {
                vec!["matrix".into()]
            }
            SpecimenGeometry::Image { labels: Some(rules), .. } => {
                let mut phases = rules.grain_phases();
                phases.retain(|phase| phase != VOID);
                [vec!["matrix".into()], phases].concat()
            }
            SpecimenGeometry::Cylinder { .. }
            | SpecimenGeometry::Image { .. }
            | SpecimenGeometry::Surfaces { .. } => vec!["matrix".into(), "grain".into()],
        }
    }

    /// Checks every value and returns all errors.
    pub(super) fn validate(&self) -> Vec<InputError> {
        if !self.case.tests.is_empty() {
            return check_tests(self);
        }
        let mut mistakes = Mistakes::default();
        if let Some(parameter) = self.case.calibration.between_tests.parameters().next() {
            let problem =
                "relates the values of a parameter in several tests, but the case has one test";
            let help = "Add the tests as [[tests]], or remove the key.";
            let key = "calibration.between_tests";
            mistakes.note(Err(self.error(key, parameter.to_string(), problem, help)));
        }
        let geometry = match self.geometry() {
            Ok(geometry) => Some(geometry),
            Err(mistake) => {
                mistakes.note(Err(mistake));
                None
            }
        };
        if let Some(geometry) = geometry.as_ref().filter(|_| self.case.is_built_in()) {
            self.check_specimen(geometry, &mut mistakes);
            let regions = self.regions(geometry);
            regions.iter().for_each(|region| mistakes.note(self.check_region(region)));
            let waiting = match geometry {
                // the keys of the image list all phases, so that no other materials are allowed
                SpecimenGeometry::Image { labels: Some(_), .. } => &[][..],
                _ => &USUAL_REGIONS[..],
            };
            mistakes.note(self.check_used(&regions, waiting));
        }
        if self.case.is_built_in() {
            for (region, material) in &self.case.material {
                self.check_material(region, material, &mut mistakes);
            }
            self.check_test(&mut mistakes);
        }
        for (name, interface_case) in &self.case.interface {
            if let Err(wrong) = check_interface(&self.case, name, interface_case) {
                let WrongInterface { key, value, problem, help } = wrong;
                mistakes.note(Err(self.error(&key, value, problem, help)));
            }
        }
        outside::check_outside(self, &mut mistakes);
        check_machine(self, &mut mistakes);
        self.check_calibration(&mut mistakes);
        if let Some(geometry) = &geometry {
            mistakes.note(self.check_microstructures(geometry));
            self.check_fidelity(geometry, &mut mistakes);
            mistakes.note(self.check_second_mesh(geometry));
            self.check_experiments(geometry, &mut mistakes);
        }
        mistakes.note(self.check_further_tests());
        // a mistake of the case is a mistake of each validation too: report it once
        if mistakes.is_empty() {
            check_validation(self, &mut mistakes);
        }
        mistakes.into_vec()
    }

    /// Refuses a case without a material for a region of the specimen.
    fn check_region(&self, region: &str) -> Result<(), InputError> {
        if self.case.material.contains_key(region) {
            return Ok(());
        }
        let given = self.case.material.keys().map(String::as_str);
        let hint = closest(region, given)
            .map(|slip| format!("Did you mean material.{slip}? "))
            .unwrap_or_default();
        Err(self.error(
            &format!("material.{region}"),
            "",
            "is missing: the specimen has this region",
            format!("{hint}Add a table [material.{region}]."),
        ))
    }

    /// Refuses materials that belong neither to a region in `regions` nor to a region in `waiting`, which may have a
    /// material although the specimen does not have the region.
    fn check_used(&self, regions: &[String], waiting: &[&str]) -> Result<(), InputError> {
        let regions_and_waiting = regions.iter().map(String::as_str).chain(waiting.iter().copied());
        let names: Vec<&str> = regions_and_waiting.collect();
        let mut given = self.case.material.keys();
        let Some(unknown) = given.find(|region| !names.contains(&region.as_str())) else {
            return Ok(());
        };
        let hint = closest(unknown, names.iter().copied())
            .map(|region| format!("Did you mean material.{region}? "))
            .unwrap_or_default();
        Err(self.error(
            &format!("material.{unknown}"),
            "",
            match unknown.as_str() {
                VOID => "has no region: voids are no part of the mesh",
                _ => "belongs to no region of the specimen",
            },
            format!("{hint}The regions are: {}.", regions.join(", ")),
        ))
    }

    /// Refuses a value outside `lower..=upper`, including NaN.
    pub(super) fn within(
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
