//! Checks of the interfaces between regions.

use fem::FemError;

use super::super::{CaseFile, InterfaceCase, Mistakes};
use crate::error::InputError;

impl CaseFile {
    pub(super) fn check_interfaces(&self, mistakes: &mut Mistakes) {
        for (name, interface) in &self.case.interface {
            mistakes.note(self.check_interface(name, interface));
        }
    }

    /// Checks that the regions exist, that one of them can break, and that the values are in their ranges.
    pub(super) fn check_interface(
        &self,
        name: &str,
        interface: &InterfaceCase,
    ) -> Result<(), InputError> {
        let (case, key) = (&self.case, format!("interface.{name}"));
        let Some(regions) = InterfaceCase::regions(name, &case.material) else {
            let known = case.material.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
            let help = format!(
                "Write [interface.matrix-grain]: two materials joined by a hyphen. The materials are: {known}."
            );
            return Err(self.error(&key, "", "does not name two materials", help));
        };
        match interface.validate(regions) {
            Ok(()) => {}
            Err(FemError::OutOfRange { field, value, requirement, .. }) => {
                let help = match field {
                    "width_mm" => "Four elements, or two phase_field.length_mm, are a start.",
                    _ => "It is in N/mm: 1 pJ/µm² = 0.001 N/mm.",
                };
                let key = format!("{key}.{field}");
                let problem = format!("must be {requirement}");
                return Err(self.error(&key, value.to_string(), problem, help));
            }
            Err(other) => {
                return Err(self.error(&key, "", other.to_string(), "Name two different regions."));
            }
        }
        let can_break = |region: &str| case.material[region].toughness_n_per_mm.is_some();
        if case.phase_field.is_none() || !regions.into_iter().any(can_break) {
            let [first, second] = regions;
            let help = format!(
                "Add [phase_field] and material.{first}.toughness_n_per_mm or \
                 material.{second}.toughness_n_per_mm, or leave the interface out."
            );
            let problem = "has a toughness, but neither of its regions can break";
            return Err(self.error(&key, "", problem, help));
        }
        Ok(())
    }
}
