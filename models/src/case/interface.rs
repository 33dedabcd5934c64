//! The interface between two regions.

use std::collections::BTreeMap;

use fem::{FemError, Interface};
use schemars::JsonSchema;
use serde::de::IgnoredAny;
use serde::{Deserialize, Serialize};

use super::MaterialCase;

/// `[interface.<region>-<region>]`: toughness of a crack along the surface between two regions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "WrittenInterface")]
#[schemars(!try_from, deny_unknown_fields)]
pub struct InterfaceCase {
    /// Effective critical energy release rate of the interface in N/mm.
    #[schemars(range(min = 1e-9, max = 1e3))]
    pub toughness_n_per_mm: f64,
    /// Total width in mm of the band of elements to which the toughness of the interface applies.
    #[schemars(range(min = 1e-9, max = 1e3))]
    pub width_mm: f64,
}

/// The keys of the table, including keys for which a more helpful error is reported.
#[derive(Deserialize)]
#[serde(rename = "InterfaceCase", deny_unknown_fields)]
struct WrittenInterface {
    toughness_n_per_mm: f64,
    width_mm: f64,
    strength: Option<IgnoredAny>,
}

impl TryFrom<WrittenInterface> for InterfaceCase {
    type Error = &'static str;

    fn try_from(written: WrittenInterface) -> Result<Self, Self::Error> {
        let WrittenInterface { toughness_n_per_mm, width_mm, strength } = written;
        match strength {
            Some(_) => Err("strength is not a key of an interface: its strength follows from its \
                 toughness and from phase_field.length_mm; help: Leave strength out; a smaller \
                 toughness_n_per_mm makes the interface weaker."),
            None => Ok(Self { toughness_n_per_mm, width_mm }),
        }
    }
}

impl InterfaceCase {
    /// Returns the two regions of the table `interface.<name>`; `None` if `name` does not consist of two regions of the
    /// case, joined by a hyphen.
    pub(crate) fn regions<'a>(
        name: &'a str,
        material: &BTreeMap<String, MaterialCase>,
    ) -> Option<[&'a str; 2]> {
        let hyphens = name.match_indices('-').map(|(at, _)| [&name[..at], &name[at + 1..]]);
        let mut pairs = hyphens.filter(|pair| pair.iter().all(|&part| material.contains_key(part)));
        pairs.next()
    }

    /// Converts to the interface of `fem` between two regions.
    pub(crate) fn in_fem(&self, regions: [&str; 2]) -> Interface {
        Interface::new(regions, self.toughness_n_per_mm, self.width_mm)
    }

    /// Checks the values.
    ///
    /// # Errors
    /// If a value is out of its range, or both regions are the same.
    pub(crate) fn validate(&self, regions: [&str; 2]) -> Result<(), FemError> {
        self.in_fem(regions).validate()
    }
}
