//! Mapping of physical groups to regions and surfaces.

use std::collections::BTreeMap;
use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A physical group of the file, identified by number or name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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

/// One or several physical groups that form one region or surface, such as `10` or `[10, "stones"]`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(from = "OneOrSeveral", into = "OneOrSeveral")]
pub struct PhysicalGroups(Vec<PhysicalGroup>);

/// Form in which case files contain physical groups: one group or a list of groups.
#[derive(Clone, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
enum OneOrSeveral {
    One(PhysicalGroup),
    Several(Vec<PhysicalGroup>),
}

impl From<OneOrSeveral> for PhysicalGroups {
    fn from(groups: OneOrSeveral) -> Self {
        match groups {
            OneOrSeveral::One(group) => PhysicalGroups(vec![group]),
            OneOrSeveral::Several(groups) => PhysicalGroups(groups),
        }
    }
}

impl From<PhysicalGroups> for OneOrSeveral {
    fn from(PhysicalGroups(mut groups): PhysicalGroups) -> Self {
        match groups.len() {
            1 => OneOrSeveral::One(groups.remove(0)),
            _ => OneOrSeveral::Several(groups),
        }
    }
}

impl PhysicalGroups {
    /// Returns the groups.
    pub fn groups(&self) -> &[PhysicalGroup] {
        &self.0
    }
}

impl<G: Into<PhysicalGroup>> From<G> for PhysicalGroups {
    fn from(group: G) -> Self {
        PhysicalGroups(vec![group.into()])
    }
}

impl<G: Into<PhysicalGroup>, const N: usize> From<[G; N]> for PhysicalGroups {
    fn from(groups: [G; N]) -> Self {
        PhysicalGroups(groups.into_iter().map(Into::into).collect())
    }
}

/// Mapping of the physical groups of a file to the regions and surfaces of the mesh.
///
/// An empty map stands for all groups of its dimension. The regions or surfaces then have the names of the groups in
/// the file, or their numbers if the groups have no names.
///
/// # Example
/// ```
/// use fem_mesh::gmsh::GmshNames;
///
/// let names = GmshNames::new([("matrix", 1), ("grain", 2)], [("bottom", 11), ("top", 12)]);
/// assert_eq!(names.surfaces["top"], 12.into());
/// let mut names = names;
/// names.regions.insert("grain".into(), [10, 11].into());
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GmshNames {
    /// For each region name, the physical volumes of the file that form this region.
    pub regions: BTreeMap<String, PhysicalGroups>,
    /// For each surface name, the physical surfaces of the file that form this surface.
    pub surfaces: BTreeMap<String, PhysicalGroups>,
}

impl GmshNames {
    /// Creates a mapping from names to groups; each group is given by number (`1`), by name (`"binder"`) or as an
    /// array of numbers and names.
    pub fn new<N: Into<String>, G: Into<PhysicalGroups>>(
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
