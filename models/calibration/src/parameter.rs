//! Material parameters and their paths, such as `matrix.young_mpa`.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// Material constant of a region, a key of `[material.<region>]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Property {
    /// Young's modulus in MPa.
    #[serde(rename = "young_mpa")]
    Young,
    /// Poisson's ratio.
    #[serde(rename = "poisson")]
    Poisson,
    /// Critical energy release rate in N/mm.
    #[serde(rename = "toughness_n_per_mm")]
    Toughness,
    /// Viscosity of the damage in MPa s.
    #[serde(rename = "viscosity_mpa_s")]
    Viscosity,
    /// Fraction of the stiffness that remains at full damage.
    #[serde(rename = "residual_stiffness")]
    ResidualStiffness,
}

impl Property {
    /// All properties, in the order in which parameters are listed.
    pub const ALL: [Self; 5] =
        [Self::Young, Self::Poisson, Self::Toughness, Self::Viscosity, Self::ResidualStiffness];

    /// Key of the property in the case.
    pub fn key(self) -> &'static str {
        match self {
            Self::Young => "young_mpa",
            Self::Poisson => "poisson",
            Self::Toughness => "toughness_n_per_mm",
            Self::Viscosity => "viscosity_mpa_s",
            Self::ResidualStiffness => "residual_stiffness",
        }
    }

    /// Symbol and unit for figures.
    pub fn label(self) -> &'static str {
        match self {
            Self::Young => "E (MPa)",
            Self::Poisson => "ν",
            Self::Toughness => "Gc (N/mm)",
            Self::Viscosity => "ξ (MPa s)",
            Self::ResidualStiffness => "η",
        }
    }

    /// Unit of the property; `1` if it is dimensionless.
    pub fn unit(self) -> &'static str {
        self.label().split_once(" (").map_or("1", |(_, unit)| unit.trim_end_matches(')'))
    }

    /// Help for the user: unit or typical value.
    pub fn help(self) -> &'static str {
        match self {
            Self::Young => {
                "Young's modulus is in MPa: 275.0 for the paper's matrix, 22000.0 for its grains."
            }
            Self::Poisson => {
                "Incompressible solids need another element; 0.25 is the paper's value."
            }
            Self::Toughness => "It is in N/mm: 1 pJ/µm² = 0.001 N/mm.",
            Self::Viscosity => "The paper's matrix has 0.3 MPa s.",
            Self::ResidualStiffness => "It keeps full damage solvable; 0.01 is the paper's value.",
        }
    }

    /// Whether only the damage model uses the property.
    pub fn is_of_damage(self) -> bool {
        matches!(self, Self::Toughness | Self::Viscosity | Self::ResidualStiffness)
    }

    /// Default standard deviation of the logarithm of the property between virtual specimens. The case can override it.
    pub fn usual_scatter(self) -> f64 {
        match self {
            Self::Young => 0.03,
            Self::Toughness => 0.1,
            Self::Viscosity => 0.05,
            Self::Poisson | Self::ResidualStiffness => 0.0,
        }
    }
}

/// Material parameter: a property of a region, written `matrix.young_mpa`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MaterialParameter {
    /// Name of the region of the mesh.
    pub region: String,
    /// Property of the region.
    pub property: Property,
}

impl MaterialParameter {
    /// Symbol and unit, preceded by the region unless all parameters belong to one region (`alone`).
    pub fn label(&self, alone: bool) -> String {
        match alone {
            true => self.property.label().to_owned(),
            false => format!("{} {}", self.region, self.property.label()),
        }
    }
}

impl fmt::Display for MaterialParameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.region, self.property.key())
    }
}

impl FromStr for MaterialParameter {
    type Err = String;

    fn from_str(path: &str) -> Result<Self, String> {
        path.rsplit_once('.')
            .and_then(|(region, key)| {
                let property = Property::ALL.into_iter().find(|p| p.key() == key)?;
                Some(Self { region: region.to_owned(), property })
            })
            .ok_or_else(|| format!("{path:?} is no parameter, such as matrix.young_mpa"))
    }
}
