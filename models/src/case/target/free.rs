//! Parameters of `[parameters]`. Only a simulator outside this program, or an imported table, has these parameters.

use std::borrow::Cow;

use super::definition::{SimulationParts, Target, TargetError};
use super::registry::Parameter;

/// Parameter with a free name: its value is an input of the user's program, not a value in the
/// case.
#[derive(Debug)]
pub(crate) struct FreeParameter {
    pub(crate) name: String,
    pub(crate) label: String,
    /// `1` without a unit.
    pub(crate) unit: String,
}

impl FreeParameter {
    /// Creates a parameter with this name, for tables that contain only the name of the parameter.
    pub(crate) fn named(name: &str) -> Parameter {
        let [name, label] = [name, name].map(str::to_owned);
        Parameter::new(Self { name, label, unit: "1".to_owned() })
    }
}

impl Target for FreeParameter {
    fn path(&self) -> Cow<'_, str> {
        self.name.as_str().into()
    }

    fn label(&self) -> Cow<'_, str> {
        self.label.as_str().into()
    }

    fn unit(&self) -> Cow<'_, str> {
        self.unit.as_str().into()
    }

    fn set(&self, _: &mut SimulationParts, _: f64) -> Result<(), TargetError> {
        Err(TargetError {
            problem: "is not a number of the built-in simulation".to_owned(),
            help: "Add [simulator] or design.import, or name a number of the case in [prior]."
                .to_owned(),
        })
    }
}
