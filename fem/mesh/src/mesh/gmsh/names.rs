//! Which physical groups are which regions and surfaces.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

/// A physical group of the file, by its number or by its name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum PhysicalGroup {
    /// The group's number.
    Number(i32),
    /// The group's name.
    Name(String),
}

impl From<i32> for PhysicalGroup {
    fn from(number: i32) -> Self {
        PhysicalGroup::Number(number)
    }
}

impl From<&str> for PhysicalGroup {
    fn from(name: &str) -> Self {
        PhysicalGroup::Name(name.into())
    }
}

impl fmt::Display for PhysicalGroup {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            PhysicalGroup::Number(number) => write!(f, "{number}"),
            PhysicalGroup::Name(name) => write!(f, "\"{name}\""),
        }
    }
}

/// Which physical groups of the file are which regions and surfaces of the mesh.
///
/// An empty map takes all groups of that dimension, under the names that the file gives them (or
/// their numbers, where it gives none).
///
/// # Example
/// ```
/// use fem_mesh::gmsh::GmshNames;
///
/// let names = GmshNames::new([("matrix", 1), ("grain", 2)], [("bottom", 11), ("top", 12)]);
/// assert_eq!(names.surfaces["top"], 12.into());
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GmshNames {
    /// Region names, with physical volumes.
    pub regions: BTreeMap<String, PhysicalGroup>,
    /// Surface names, with physical surfaces.
    pub surfaces: BTreeMap<String, PhysicalGroup>,
}

impl GmshNames {
    /// Names with their groups, given by number (`1`) or by name (`"binder"`).
    pub fn new<N: Into<String>, G: Into<PhysicalGroup>>(
        regions: impl IntoIterator<Item = (N, G)>,
        surfaces: impl IntoIterator<Item = (N, G)>,
    ) -> GmshNames {
        let map = |(name, group): (N, G)| (name.into(), group.into());
        GmshNames {
            regions: regions.into_iter().map(map).collect(),
            surfaces: surfaces.into_iter().map(map).collect(),
        }
    }
}
