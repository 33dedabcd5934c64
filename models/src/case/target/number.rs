//! Numbers of the tables `[phase_field]`, `[test]` and `[machine]` that can be calibrated. Each number has an entry
//! in [`NUMBERS`].

use std::borrow::Cow;

use super::super::MachineCase;
use super::definition::{SimulationParts, Target, TargetError};

/// A number of a case outside `[material]`.
#[derive(Debug)]
pub(super) struct CaseNumber {
    path: &'static str,
    label: &'static str,
    unit: &'static str,
    /// Returns the number within a case; `None` if the case does not have the table of this number.
    number: fn(&mut SimulationParts) -> Option<&mut f64>,
}

/// All numbers outside `[material]` that can be calibrated.
pub(super) const NUMBERS: [CaseNumber; 7] = [
    CaseNumber {
        path: "phase_field.length_mm",
        label: "l₀",
        unit: "mm",
        number: |simulation| Some(&mut simulation.phase_field.as_mut()?.length_mm),
    },
    CaseNumber {
        path: "test.friction",
        label: "μ",
        unit: "1",
        number: |simulation| Some(&mut simulation.test.friction),
    },
    CaseNumber {
        path: "test.drag_mpa_s_per_mm",
        label: "drag",
        unit: "MPa s/mm",
        number: |simulation| Some(&mut simulation.test.drag_mpa_s_per_mm),
    },
    CaseNumber {
        path: "test.slip_velocity_mm_per_s",
        label: "slip velocity",
        unit: "mm/s",
        number: |simulation| Some(&mut simulation.test.slip_velocity_mm_per_s),
    },
    CaseNumber {
        path: "test.temperature_celsius",
        label: "T",
        unit: "°C",
        number: |simulation| Some(simulation.test.temperature_celsius.get_or_insert_default()),
    },
    CaseNumber {
        path: MachineCase::COMPLIANCE,
        label: "C",
        unit: "mm/N",
        number: |simulation| Some(simulation.machine.compliance_mm_per_n.get_or_insert_default()),
    },
    CaseNumber {
        path: MachineCase::FORCE_OFFSET,
        label: "F₀",
        unit: "N",
        number: |simulation| Some(simulation.machine.force_offset_n.get_or_insert_default()),
    },
];

impl Target for CaseNumber {
    fn path(&self) -> Cow<'_, str> {
        self.path.into()
    }

    fn label(&self) -> Cow<'_, str> {
        self.label.into()
    }

    fn unit(&self) -> Cow<'_, str> {
        self.unit.into()
    }

    fn set(&self, simulation: &mut SimulationParts, value: f64) -> Result<(), TargetError> {
        let number = (self.number)(simulation).ok_or_else(|| {
            let table = self.path.split('.').next().unwrap_or_default();
            TargetError {
                problem: format!("the case has no table [{table}]"),
                help: format!("Add [{table}], or leave the parameter out."),
            }
        })?;
        *number = value;
        Ok(())
    }
}
