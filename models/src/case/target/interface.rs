//! Toughness of an interface, such as `interface.matrix-grain.toughness_n_per_mm`.

use std::borrow::Cow;

use super::definition::{SimulationParts, Target, TargetError};

/// Beginning of the path of every parameter of an interface, including the dot.
const TABLE: &str = "interface.";
/// Key of the toughness in the table of an interface.
pub(crate) const TOUGHNESS: &str = "toughness_n_per_mm";

/// Whether a path is the path of a table of an interface, as `interface.matrix-grain`.
pub(super) fn is_table(path: &str) -> bool {
    path.strip_prefix(TABLE).is_some_and(|name| !name.is_empty() && !name.contains('.'))
}

/// Whether a path begins with the table of all interfaces.
pub(super) fn is_of_interface(path: &str) -> bool {
    path.starts_with(TABLE)
}

/// Effective toughness of an interface.
#[derive(Debug)]
pub(super) struct InterfaceToughness {
    /// Name of the interface: two regions, joined by a hyphen.
    name: String,
}

impl InterfaceToughness {
    /// The toughness with a path such as `interface.matrix-grain.toughness_n_per_mm`.
    pub(super) fn of_path(path: &str) -> Option<Self> {
        let (table, key) = path.rsplit_once('.')?;
        let name = table.strip_prefix(TABLE)?;
        (key == TOUGHNESS && is_table(table)).then(|| Self { name: name.to_owned() })
    }
}

impl Target for InterfaceToughness {
    fn path(&self) -> Cow<'_, str> {
        format!("{TABLE}{}.{TOUGHNESS}", self.name).into()
    }

    fn label(&self) -> Cow<'_, str> {
        format!("{} Gc", self.name).into()
    }

    fn unit(&self) -> Cow<'_, str> {
        "N/mm".into()
    }

    fn set(&self, simulation: &mut SimulationParts, value: f64) -> Result<(), TargetError> {
        match simulation.interface.get_mut(&self.name) {
            Some(interface) => {
                interface.toughness_n_per_mm = value;
                Ok(())
            }
            None => Err(TargetError {
                problem: format!("the case has no table [{TABLE}{}]", self.name),
                help: format!(
                    "Add [{TABLE}{}] with {TOUGHNESS} and width_mm, or leave the parameter out.",
                    self.name
                ),
            }),
        }
    }

    fn usual_scatter(&self) -> f64 {
        0.1
    }
}
