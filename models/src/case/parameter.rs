//! Parameters by path, as `matrix.young_mpa`: what `[prior]` and the virtual specimens name.

use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

use ::surrogate::{Input, SurrogateError};
use serde::de::{Error, MapAccess, Visitor, value::MapAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::MaterialCase;

/// A number of `[material.<region>]`.
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
    /// Fraction of the stiffness that full damage leaves.
    #[serde(rename = "residual_stiffness")]
    ResidualStiffness,
}

impl Property {
    /// All of them, in the order in which parameters are listed.
    pub const ALL: [Self; 5] =
        [Self::Young, Self::Poisson, Self::Toughness, Self::Viscosity, Self::ResidualStiffness];

    /// Its key in the case.
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

    /// Its unit; 1 without one.
    pub fn unit(self) -> &'static str {
        self.label().split_once(" (").map_or("1", |(_, unit)| unit.trim_end_matches(')'))
    }

    /// What to know before writing it.
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

    /// Whether it means nothing where there is no damage.
    pub(crate) fn is_of_damage(self) -> bool {
        matches!(self, Self::Toughness | Self::Viscosity | Self::ResidualStiffness)
    }

    /// How much it differs from one virtual specimen to the next, unless the case says otherwise:
    /// standard deviation of the logarithm.
    pub(crate) fn usual_scatter(self) -> f64 {
        match self {
            Self::Young => 0.03,
            Self::Toughness => 0.1,
            Self::Viscosity => 0.05,
            Self::Poisson | Self::ResidualStiffness => 0.0,
        }
    }

    /// Gives a material another value of it.
    pub(crate) fn set(self, material: &mut MaterialCase, value: f64) {
        match self {
            Self::Young => material.young_mpa = Some(value),
            Self::Poisson => material.poisson = Some(value),
            Self::Toughness => material.toughness_n_per_mm = Some(value),
            Self::Viscosity => material.viscosity_mpa_s = value,
            Self::ResidualStiffness => material.residual_stiffness = value,
        }
    }
}

/// A parameter: a property of a region, written `matrix.young_mpa`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MaterialParameter {
    /// The region of the mesh.
    pub region: String,
    /// Which of its numbers.
    pub property: Property,
}

impl MaterialParameter {
    /// Symbol and unit, with the region unless that is `alone`.
    pub(crate) fn label(&self, alone: bool) -> String {
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

/// One value a parameter, ordered by region and [`Property`].
///
/// In TOML `matrix.young_mpa = 280.0`, or the same as tables.
#[derive(Clone, Debug, PartialEq)]
pub struct ByParameter<T>(BTreeMap<MaterialParameter, T>);

/// `[prior]`: the box of the uniform priors, also the surrogate's.
///
/// # Example
/// ```
/// let prior = models::CaseFile::default_case().case.prior.expect("the default case has one");
/// let names: Vec<String> = prior.names().collect();
/// assert_eq!(names, ["matrix.young_mpa", "matrix.toughness_n_per_mm", "matrix.viscosity_mpa_s"]);
/// ```
pub type PriorCase = ByParameter<PriorBounds>;

/// Lower and upper bound.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PriorBounds(#[serde(deserialize_with = "two_numbers")] pub [f64; 2]);

impl<T> ByParameter<T> {
    /// The parameters in order.
    pub fn parameters(&self) -> impl ExactSizeIterator<Item = &MaterialParameter> {
        self.0.keys()
    }

    /// Their paths.
    pub fn names(&self) -> impl ExactSizeIterator<Item = String> {
        self.0.keys().map(MaterialParameter::to_string)
    }

    /// Parameters with their values.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&MaterialParameter, &T)> {
        self.0.iter()
    }

    /// The value of a parameter.
    pub fn get(&self, parameter: &MaterialParameter) -> Option<&T> {
        self.0.get(parameter)
    }

    /// Sets the value of a parameter.
    pub fn insert(&mut self, parameter: MaterialParameter, value: T) {
        self.0.insert(parameter, value);
    }
}

impl PriorCase {
    /// The box as a surrogate's inputs, named by their paths.
    ///
    /// # Errors
    /// Bounds that are not finite and increasing.
    pub fn inputs(&self) -> Result<Vec<Input>, SurrogateError> {
        self.iter()
            .map(|(p, &PriorBounds([lower, upper]))| Input::new(p.to_string(), lower, upper))
            .collect()
    }
}

impl<T> Default for ByParameter<T> {
    fn default() -> Self {
        Self(BTreeMap::new())
    }
}

impl<T> FromIterator<(MaterialParameter, T)> for ByParameter<T> {
    fn from_iter<I: IntoIterator<Item = (MaterialParameter, T)>>(entries: I) -> Self {
        Self(entries.into_iter().collect())
    }
}

impl<T: Serialize> Serialize for ByParameter<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut regions = BTreeMap::<&str, BTreeMap<Property, &T>>::new();
        for (MaterialParameter { region, property }, value) in &self.0 {
            regions.entry(region).or_default().insert(*property, value);
        }
        regions.serialize(serializer)
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for ByParameter<T> {
    fn deserialize<D: Deserializer<'de>>(source: D) -> Result<Self, D::Error> {
        let regions = BTreeMap::<String, Region<T>>::deserialize(source)?;
        let entries = regions.into_iter().flat_map(|(region, Region(values))| {
            values.into_iter().map(move |(property, value)| {
                (MaterialParameter { region: region.clone(), property }, value)
            })
        });
        Ok(entries.collect())
    }
}

/// The values of a region's parameters.
struct Region<T>(BTreeMap<Property, T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Region<T> {
    fn deserialize<D: Deserializer<'de>>(source: D) -> Result<Self, D::Error> {
        source.deserialize_any(RegionVisitor(PhantomData))
    }
}

/// Takes a table, and says of anything else how it is written now.
struct RegionVisitor<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for RegionVisitor<T> {
    type Value = Region<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a parameter with its region, such as matrix.young_mpa")
    }

    fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Region<T>, A::Error> {
        BTreeMap::deserialize(MapAccessDeserializer::new(map)).map(Region)
    }

    fn visit_seq<A>(self, _: A) -> Result<Region<T>, A::Error>
    where
        A: serde::de::SeqAccess<'de>,
    {
        Err(A::Error::custom(
            "a region is missing; expected a parameter with it, such as matrix.young_mpa",
        ))
    }

    fn visit_str<E: Error>(self, _: &str) -> Result<Region<T>, E> {
        Err(E::custom(
            "is no region; expected a parameter with its region, such as matrix.young_mpa",
        ))
    }
}

/// Exactly two numbers: a plain array would pass over what follows them.
fn two_numbers<'de, D: Deserializer<'de>>(source: D) -> Result<[f64; 2], D::Error> {
    let numbers = Vec::<f64>::deserialize(source)?;
    let count = numbers.len();
    numbers.try_into().map_err(|_| {
        serde::de::Error::custom(format!("{count} numbers, expected two: [lower, upper]"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_read_as_they_are_written() {
        for property in Property::ALL {
            let parameter = MaterialParameter { region: "grain".into(), property };
            assert_eq!(parameter.to_string().parse(), Ok(parameter));
            let key = toml::Value::try_from(property).unwrap();
            assert_eq!(key.as_str(), Some(property.key()));
        }
        assert!("matrix.young".parse::<MaterialParameter>().is_err());
    }

    #[test]
    fn parameters_are_ordered_by_region_and_property_however_they_are_written() {
        let text = "matrix.viscosity_mpa_s = 0.3\nmatrix.young_mpa = 275.0\ngrain.poisson = 0.2\n";
        let values: ByParameter<f64> = toml::from_str(text).unwrap();
        let names: Vec<String> = values.names().collect();
        assert_eq!(names, ["grain.poisson", "matrix.young_mpa", "matrix.viscosity_mpa_s"]);
        let again = toml::to_string(&values).unwrap();
        assert_eq!(toml::from_str::<ByParameter<f64>>(&again).unwrap(), values);
    }
}
