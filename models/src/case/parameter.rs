//! Parameters named by paths such as `matrix.young_mpa`, as used by `[prior]` and the virtual specimens.

use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

use ::surrogate::{Input, SurrogateError};
use serde::de::{Error, MapAccess, Visitor, value::MapAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::MaterialCase;
use crate::parameter::{MaterialParameter, Property};
use crate::prior::{Prior, PriorBounds};

impl MaterialCase {
    /// Sets the value of a property.
    pub(crate) fn set(&mut self, property: Property, value: f64) {
        match property {
            Property::Young => self.young_mpa = Some(value),
            Property::Poisson => self.poisson = Some(value),
            Property::Toughness => self.toughness_n_per_mm = Some(value),
            Property::Viscosity => self.viscosity_mpa_s = value,
            Property::ResidualStiffness => self.residual_stiffness = value,
        }
    }
}

/// A value for each of several parameters, ordered by region and [`Property`].
///
/// Written in TOML as `matrix.young_mpa = 280.0`, or as nested tables.
#[derive(Clone, Debug, PartialEq)]
pub struct ByParameter<T>(BTreeMap<MaterialParameter, T>);

/// `[prior]`: the priors. Their ranges are the bounds of the surrogate's inputs.
///
/// # Example
/// ```
/// let prior = models::CaseFile::default_case().case.prior.expect("the default case has one");
/// let names: Vec<String> = prior.names().collect();
/// assert_eq!(names, ["matrix.young_mpa", "matrix.toughness_n_per_mm", "matrix.viscosity_mpa_s"]);
/// ```
pub type PriorCase = ByParameter<Prior>;

/// `[extend]`: bounds of parameters.
pub type BoundsCase = ByParameter<PriorBounds>;

impl<T> ByParameter<T> {
    /// Iterates over the parameters in order.
    pub fn parameters(&self) -> impl ExactSizeIterator<Item = &MaterialParameter> {
        self.0.keys()
    }

    /// Iterates over the paths of the parameters in order.
    pub fn names(&self) -> impl ExactSizeIterator<Item = String> {
        self.0.keys().map(MaterialParameter::to_string)
    }

    /// Iterates over the parameters with their values.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&MaterialParameter, &T)> {
        self.0.iter()
    }

    /// Returns the value of a parameter, if there is one.
    pub fn get(&self, parameter: &MaterialParameter) -> Option<&T> {
        self.0.get(parameter)
    }

    /// Sets the value of a parameter.
    pub fn insert(&mut self, parameter: MaterialParameter, value: T) {
        self.0.insert(parameter, value);
    }
}

impl PriorCase {
    /// Converts the ranges to the inputs of a surrogate, named by the paths of the parameters.
    ///
    /// # Errors
    /// If a range is not finite, or the lower bound is not below the upper bound.
    pub fn inputs(&self) -> Result<Vec<Input>, SurrogateError> {
        self.iter().map(|(parameter, prior)| prior.input(parameter.to_string())).collect()
    }

    /// The priors of the parameters in order.
    pub(crate) fn priors(&self) -> Vec<Prior> {
        self.0.values().copied().collect()
    }

    /// The ranges of the priors.
    pub(crate) fn bounds(&self) -> BoundsCase {
        self.iter()
            .map(|(parameter, prior)| (parameter.clone(), PriorBounds(prior.range())))
            .collect()
    }

    /// The priors with the ranges of some parameters replaced.
    pub(crate) fn within(&self, bounds: &BoundsCase) -> Self {
        let of = |(parameter, prior): (&MaterialParameter, &Prior)| {
            let PriorBounds([lower, upper]) =
                bounds.get(parameter).copied().unwrap_or(PriorBounds(prior.range()));
            (parameter.clone(), prior.within(lower, upper))
        };
        self.iter().map(of).collect()
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

/// The values of the parameters of one region.
struct Region<T>(BTreeMap<Property, T>);

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Region<T> {
    fn deserialize<D: Deserializer<'de>>(source: D) -> Result<Self, D::Error> {
        source.deserialize_any(RegionVisitor(PhantomData))
    }
}

/// Visitor that reads a table; for other types of value it reports the expected syntax.
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
