//! Constants of the materials, such as `matrix.young_mpa`.

use std::borrow::Cow;

use super::definition::{SimulationParts, Target, TargetError};

/// Material constant of a region, a key of `[material.<region>]`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Property {
    /// Young's modulus in MPa.
    Young,
    /// Poisson's ratio.
    Poisson,
    /// Critical energy release rate in N/mm.
    Toughness,
    /// Viscosity of the damage in MPa s.
    Viscosity,
    /// Fraction of the stiffness that remains at full damage.
    ResidualStiffness,
}

impl Property {
    /// All properties, in the order in which parameters are listed.
    pub(crate) const ALL: [Self; 5] =
        [Self::Young, Self::Poisson, Self::Toughness, Self::Viscosity, Self::ResidualStiffness];

    /// Key of the property in the case.
    pub(crate) fn key(self) -> &'static str {
        match self {
            Self::Young => "young_mpa",
            Self::Poisson => "poisson",
            Self::Toughness => "toughness_n_per_mm",
            Self::Viscosity => "viscosity_mpa_s",
            Self::ResidualStiffness => "residual_stiffness",
        }
    }

    /// Symbol in figures.
    fn label(self) -> &'static str {
        match self {
            Self::Young => "E",
            Self::Poisson => "ν",
            Self::Toughness => "Gc",
            Self::Viscosity => "ξ",
            Self::ResidualStiffness => "η",
        }
    }

    fn unit(self) -> &'static str {
        match self {
            Self::Young => "MPa",
            Self::Toughness => "N/mm",
            Self::Viscosity => "MPa s",
            Self::Poisson | Self::ResidualStiffness => "1",
        }
    }

    /// Help for the user: unit or typical value.
    pub(crate) fn help(self) -> &'static str {
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
    fn is_of_damage(self) -> bool {
        matches!(self, Self::Toughness | Self::Viscosity | Self::ResidualStiffness)
    }
}

/// Material constant of a region, with a path such as `matrix.young_mpa`.
#[derive(Debug)]
pub(super) struct MaterialConstant {
    region: String,
    property: Property,
}

impl MaterialConstant {
    /// Returns the constant that a path addresses, such as `matrix.young_mpa`.
    pub(super) fn of_path(path: &str) -> Option<Self> {
        let (region, key) = path.rsplit_once('.')?;
        let property = Property::ALL.into_iter().find(|property| property.key() == key)?;
        Some(Self { region: region.to_owned(), property })
    }
}

impl Target for MaterialConstant {
    fn path(&self) -> Cow<'_, str> {
        format!("{}.{}", self.region, self.property.key()).into()
    }

    fn label(&self) -> Cow<'_, str> {
        self.property.label().into()
    }

    fn unit(&self) -> Cow<'_, str> {
        self.property.unit().into()
    }

    fn region(&self) -> Option<&str> {
        Some(&self.region)
    }

    fn set(&self, simulation: &mut SimulationParts, value: f64) -> Result<(), TargetError> {
        let Self { region, property } = self;
        let error = |problem: String, help| Err(TargetError { problem, help });
        let has_phase_field = simulation.phase_field.is_some();
        let names: Vec<&str> = simulation.material.keys().map(String::as_str).collect();
        let names = format!("Choose one of: {}.", names.join(", "));
        let Some(material) = simulation.material.get_mut(region) else {
            return error(format!("there is no material {region:?}"), names);
        };
        let has_damage = has_phase_field && material.toughness_n_per_mm.is_some();
        if property.is_of_damage() && !has_damage {
            let help = format!("Add [phase_field] and material.{region}.toughness_n_per_mm.");
            return error("there is no damage to calibrate".to_owned(), help);
        }
        if !property.is_of_damage() && material.law.has_constants() {
            let problem =
                "the region's law has no Young's modulus and no Poisson's ratio to calibrate";
            let help = "Give the region a law with young_mpa, such as law = \"hencky\".";
            return error(problem.to_owned(), help.to_owned());
        }
        match property {
            Property::Young => material.young_mpa = Some(value),
            Property::Poisson => material.poisson = Some(value),
            Property::Toughness => material.toughness_n_per_mm = Some(value),
            Property::Viscosity => material.viscosity_mpa_s = value,
            Property::ResidualStiffness => material.residual_stiffness = value,
        }
        Ok(())
    }

    fn usual_scatter(&self) -> f64 {
        match self.property {
            Property::Young => 0.03,
            Property::Toughness => 0.1,
            Property::Viscosity => 0.05,
            Property::Poisson | Property::ResidualStiffness => 0.0,
        }
    }
}
