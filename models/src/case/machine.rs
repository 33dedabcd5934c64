//! `[machine]`: the testing machine.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::machine::Machine;

/// `[machine]`: properties of the testing machine. The measured curves are corrected by these properties. A property that
/// `[prior]` calibrates is not corrected: instead, the machine with the property of the run is applied to the curve of
/// each run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MachineCase {
    /// Compliance of frame, platens and load cell in mm/N. Default: 0, a rigid machine.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1))]
    pub compliance_mm_per_n: Option<f64>,
    /// Force in N that the load cell shows without load. Default: 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -1e6, max = 1e6))]
    pub force_offset_n: Option<f64>,
}

impl MachineCase {
    /// Path of the compliance in `[prior]`.
    pub(crate) const COMPLIANCE: &str = "machine.compliance_mm_per_n";
    /// Path of the force offset in `[prior]`.
    pub(crate) const FORCE_OFFSET: &str = "machine.force_offset_n";

    /// Whether a path in `[prior]` names a property of the machine.
    pub(crate) fn is_path(path: &str) -> bool {
        [Self::COMPLIANCE, Self::FORCE_OFFSET].contains(&path)
    }

    /// Returns the properties of the machine that are among the inputs of a run, given by names and values.
    pub(crate) fn of_inputs<'a>(inputs: impl IntoIterator<Item = (&'a str, f64)>) -> Self {
        let mut machine = Self::default();
        for (name, value) in inputs {
            match name {
                Self::COMPLIANCE => machine.compliance_mm_per_n = Some(value),
                Self::FORCE_OFFSET => machine.force_offset_n = Some(value),
                _ => {}
            }
        }
        machine
    }

    /// Returns the machine without the properties that `other` states.
    pub(crate) fn without(self, other: Self) -> Self {
        let rest = |value: Option<f64>, other: Option<f64>| value.filter(|_| other.is_none());
        Self {
            compliance_mm_per_n: rest(self.compliance_mm_per_n, other.compliance_mm_per_n),
            force_offset_n: rest(self.force_offset_n, other.force_offset_n),
        }
    }

    /// Whether the table states no property.
    pub(super) fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Returns the machine with its default properties.
    pub(crate) fn machine(self) -> Machine {
        Machine {
            compliance_mm_per_n: self.compliance_mm_per_n.unwrap_or(0.0),
            force_offset_n: self.force_offset_n.unwrap_or(0.0),
        }
    }
}
