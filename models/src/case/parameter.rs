//! Values of parameters that are named by paths such as `matrix.young_mpa`: `[prior]` and the virtual specimens.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::marker::PhantomData;

use ::surrogate::{Input, SurrogateError};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::value::SeqAccessDeserializer;
use serde::de::{DeserializeSeed, Error, IntoDeserializer, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::BetweenTestsCase;
use super::target::{
    FreeParameter, InelasticConstant, Parameter, Property, TOUGHNESS, TargetRegistry,
};
use crate::prior::{Prior, PriorBounds};

/// A value for each of several parameters, in the order of the parameters.
///
/// Written in TOML as `matrix.young_mpa = 280.0`, or as nested tables.
#[derive(Clone, Debug, PartialEq)]
pub struct ByParameter<T>(BTreeMap<Parameter, T>);

/// `[prior]`: the priors. Their ranges are the bounds of the surrogate's inputs.
///
/// # Example
/// ```
/// let prior = models::CaseFile::default_case().case.prior.expect("the default case has one");
/// let names: Vec<String> = prior.names().collect();
/// assert_eq!(names, ["matrix.young_mpa", "matrix.toughness_n_per_mm", "matrix.viscosity_mpa_s"]);
/// ```
pub type PriorCase = ByParameter<Prior>;

/// `[[extend]]`: bounds of parameters.
pub type BoundsCase = ByParameter<PriorBounds>;

impl<T> ByParameter<T> {
    /// Iterates over the parameters in order.
    pub fn parameters(&self) -> impl ExactSizeIterator<Item = &Parameter> {
        self.0.keys()
    }

    /// Iterates over the paths of the parameters in order.
    pub fn names(&self) -> impl ExactSizeIterator<Item = String> {
        self.0.keys().map(Parameter::to_string)
    }

    /// Iterates over the parameters with their values.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&Parameter, &T)> {
        self.0.iter()
    }

    /// Returns the value of a parameter, if there is one.
    pub fn get(&self, parameter: &Parameter) -> Option<&T> {
        self.0.get(parameter)
    }

    /// Sets the value of a parameter.
    pub fn insert(&mut self, parameter: Parameter, value: T) {
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

    /// Returns the priors with the given bounds; parameters without bounds keep their ranges.
    pub(crate) fn within(&self, bounds: &BoundsCase) -> Self {
        let widened = |(parameter, prior): (&Parameter, &Prior)| {
            let PriorBounds([lower, upper]) =
                bounds.get(parameter).copied().unwrap_or(PriorBounds(prior.range()));
            (parameter.clone(), prior.within(lower, upper))
        };
        self.iter().map(widened).collect()
    }
}

impl<T> Default for ByParameter<T> {
    fn default() -> Self {
        Self(BTreeMap::new())
    }
}

impl<T> FromIterator<(Parameter, T)> for ByParameter<T> {
    fn from_iter<I: IntoIterator<Item = (Parameter, T)>>(entries: I) -> Self {
        Self(entries.into_iter().collect())
    }
}

impl<T: Serialize> Serialize for ByParameter<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tables = Entries(Vec::new());
        for (parameter, value) in &self.0 {
            // free parameters have no table
            let (table, key) = parameter.table_and_key();
            let names = table.split('.').filter(|name| !name.is_empty());
            names.fold(&mut tables, Entries::table).0.push((key, Entry::Value(value)));
        }
        tables.serialize(serializer)
    }
}

/// Entries of one table in the order of the parameters.
struct Entries<'a, T>(Vec<(&'a str, Entry<'a, T>)>);

/// Value of a parameter, or a table of further entries.
enum Entry<'a, T> {
    Value(&'a T),
    Table(Entries<'a, T>),
}

impl<'a, T> Entries<'a, T> {
    /// Returns the table with this name, which is added if it does not exist.
    fn table(&mut self, name: &'a str) -> &mut Self {
        let is_own = |(entry_name, entry): &(&str, Entry<'a, T>)| {
            *entry_name == name && matches!(entry, Entry::Table(_))
        };
        let position = self.0.iter().position(is_own).unwrap_or_else(|| {
            self.0.push((name, Entry::Table(Entries(Vec::new()))));
            self.0.len() - 1
        });
        match &mut self.0[position].1 {
            Entry::Table(table) => table,
            Entry::Value(_) => unreachable!("the entry at this position is a table"),
        }
    }
}

impl<T: Serialize> Serialize for Entries<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, entry)| (name, entry)))
    }
}

impl<T: Serialize> Serialize for Entry<'_, T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Entry::Value(value) => value.serialize(serializer),
            Entry::Table(table) => table.serialize(serializer),
        }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for ByParameter<T> {
    fn deserialize<D: Deserializer<'de>>(source: D) -> Result<Self, D::Error> {
        source.deserialize_map(Tables(PhantomData))
    }
}

impl<T: JsonSchema> JsonSchema for ByParameter<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("{}ByParameter", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let value = generator.subschema_for::<T>();
        let inelastic = generator.subschema_for::<InelasticTable<T>>();
        let number = |text: String| json_schema!({ "description": text, "allOf": [value] });
        let labelled = |parameter: &Parameter| number(parameter.label_and_unit(false));
        let table = |text: &str, properties: BTreeMap<&str, Schema>| {
            json_schema!({
                "description": text,
                "type": "object",
                "properties": properties,
                "additionalProperties": false,
            })
        };
        let constants = Property::ALL
            .into_iter()
            .map(|constant| (constant.key(), number(constant.help().into())));
        let tables = InelasticConstant::TABLES.into_iter().map(|name| (name, inelastic.clone()));
        let region = table("Parameters of a region.", constants.chain(tables).collect());
        let interface = [(TOUGHNESS, number("Toughness of the interface in N/mm.".into()))];
        let interface = table("Parameters of an interface.", interface.into());
        let mut properties: BTreeMap<String, Schema> = BTreeMap::new();
        for (name, parameters) in TargetRegistry::current().tables() {
            let keys = parameters.iter().map(|&(key, parameter)| (key, labelled(parameter)));
            properties.insert(name.to_owned(), table("Parameters of this table.", keys.collect()));
        }
        let interfaces = json_schema!({
            "description": "Parameters of interfaces, by the names of the interfaces.",
            "type": "object",
            "additionalProperties": interface,
        });
        properties.insert("interface".to_owned(), interfaces);
        // only in `calibration.between_tests`, the value of a free parameter may be a table
        let mut types = vec!["array", "number", "string"];
        types.extend((T::schema_name() == BetweenTestsCase::schema_name()).then_some("object"));
        let free = json_schema!({ "type": types, "allOf": [value] });
        json_schema!({
            "type": "object",
            "properties": properties,
            "additionalProperties": { "anyOf": [region, free] },
        })
    }
}

/// Schema of the tables `viscoelastic`, `plastic` and `strength` of a region and of all tables within them.
struct InelasticTable<T>(PhantomData<T>);

impl<T: JsonSchema> JsonSchema for InelasticTable<T> {
    fn schema_name() -> Cow<'static, str> {
        format!("{}InelasticTable", T::schema_name()).into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let value = generator.subschema_for::<T>();
        let own = generator.subschema_for::<Self>();
        let keys = InelasticConstant::symbols().map(|(key, [symbol, unit])| {
            // the key `rate` is also the name of a table
            let forms = if key == "rate" { vec![&value, &own] } else { vec![&value] };
            let text = match unit {
                "1" => symbol.to_owned(),
                unit => format!("{symbol} in {unit}"),
            };
            (key, json_schema!({ "description": text, "anyOf": forms }))
        });
        json_schema!({
            "description": "Numbers of the material, by their keys in [material].",
            "type": "object",
            "properties": keys.collect::<BTreeMap<_, _>>(),
            "additionalProperties": own,
        })
    }
}

/// Visitor that reads all tables.
struct Tables<T>(PhantomData<T>);

impl<'de, T: Deserialize<'de>> Visitor<'de> for Tables<T> {
    type Value = ByParameter<T>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("tables of parameters")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<ByParameter<T>, A::Error> {
        let mut all = BTreeMap::new();
        while let Some(table) = map.next_key::<String>()? {
            all.extend(map.next_value_seed(Table(&table, PhantomData))?);
        }
        Ok(ByParameter(all))
    }
}

/// Keys of a table that is the value of one parameter, as in `calibration.between_tests`. No parameter has such a name.
const KEYS_OF_VALUES: [&str; 3] = ["varies-percent", "trend", "deviation-percent"];

/// Reads the parameters of one table. If a key has a value and not a table, the key is a free parameter name, which
/// only `[parameters]` can declare.
struct Table<'a, T>(&'a str, PhantomData<T>);

impl<'de, T: Deserialize<'de>> DeserializeSeed<'de> for Table<'_, T> {
    type Value = Vec<(Parameter, T)>;

    fn deserialize<D: Deserializer<'de>>(self, source: D) -> Result<Self::Value, D::Error> {
        source.deserialize_any(self)
    }
}

impl<'de, T: Deserialize<'de>> Visitor<'de> for Table<'_, T> {
    type Value = Vec<(Parameter, T)>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a parameter with its region, such as matrix.young_mpa")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut entries = Vec::new();
        while let Some(key) = map.next_key_seed(Key(self.0))? {
            match key {
                Named::Parameter(parameter) => entries.push((parameter, map.next_value()?)),
                Named::Table(path) => {
                    entries.extend(map.next_value_seed(Table(&path, PhantomData))?);
                }
                Named::KeyOfValue(key) => {
                    let mut table = toml::Table::new();
                    table.insert(key, map.next_value()?);
                    while let Some((key, value)) = map.next_entry()? {
                        table.insert(key, value);
                    }
                    let value: T = table
                        .try_into()
                        .map_err(|error: toml::de::Error| A::Error::custom(error.message()))?;
                    entries.push((FreeParameter::named(self.0), value));
                }
            }
        }
        Ok(entries)
    }

    fn visit_seq<A>(self, sequence: A) -> Result<Self::Value, A::Error>
    where
        A: SeqAccess<'de>,
    {
        let value = T::deserialize(SeqAccessDeserializer::new(sequence))?;
        Ok(vec![(FreeParameter::named(self.0), value)])
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<Self::Value, E> {
        let value: Result<T, E> = T::deserialize(value.into_deserializer());
        value.map(|value| vec![(FreeParameter::named(self.0), value)]).map_err(without_region)
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<Self::Value, E> {
        let value: Result<T, E> = T::deserialize(value.into_deserializer());
        value.map(|value| vec![(FreeParameter::named(self.0), value)]).map_err(without_region)
    }

    fn visit_str<E: Error>(self, text: &str) -> Result<Self::Value, E> {
        let value: Result<T, E> = T::deserialize(text.into_deserializer());
        value.map(|value| vec![(FreeParameter::named(self.0), value)]).map_err(without_region)
    }
}

/// Creates the error of a value where the table of a region is expected.
fn without_region<E: Error>(_: impl fmt::Display) -> E {
    E::custom("is not a region; expected a parameter with its region, such as matrix.young_mpa")
}

/// Meaning of a key of a table.
enum Named {
    Parameter(Parameter),
    /// Key of a table that is the value of a free parameter.
    KeyOfValue(String),
    /// Path of a table within the table.
    Table(String),
}

/// Reads a key of a table and finds its parameter.
struct Key<'a>(&'a str);

impl<'de> DeserializeSeed<'de> for Key<'_> {
    type Value = Named;

    fn deserialize<D: Deserializer<'de>>(self, source: D) -> Result<Named, D::Error> {
        let key = String::deserialize(source)?;
        let registry = TargetRegistry::current();
        if KEYS_OF_VALUES.contains(&&*key) {
            return Ok(Named::KeyOfValue(key));
        }
        let path = format!("{}.{key}", self.0);
        if TargetRegistry::is_table(&path) {
            return Ok(Named::Table(path));
        }
        registry.find(&path).map(Named::Parameter).ok_or_else(|| {
            let allowed = registry.keys_of(self.0).join("`, `");
            D::Error::custom(format!("unknown variant `{key}`, expected one of `{allowed}`"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_read_as_they_are_written() {
        for path in [
            "grain.young_mpa",
            "grain.residual_stiffness",
            "phase_field.length_mm",
            "test.friction",
            "interface.matrix-grain.toughness_n_per_mm",
        ] {
            assert_eq!(path.parse::<Parameter>().unwrap().to_string(), path);
        }
        for path in [
            "matrix.young",
            "young_mpa",
            "phase_field.length",
            "interface.matrix-grain.young_mpa",
            "interface.toughness_n_per_mm",
        ] {
            assert!(path.parse::<Parameter>().is_err(), "{path}");
        }
    }

    #[test]
    fn free_names_have_no_table() {
        let text = "k1 = 0.5\nmatrix.young_mpa = 275.0\n";
        let values: ByParameter<f64> = toml::from_str(text).unwrap();
        assert_eq!(values.names().collect::<Vec<_>>(), ["k1", "matrix.young_mpa"]);
        let again = toml::to_string(&values).unwrap();
        assert_eq!(toml::from_str::<ByParameter<f64>>(&again).unwrap(), values);
        let bounds: BoundsCase = toml::from_str("k1 = [2.0, 3.0]").unwrap();
        assert_eq!(bounds.iter().next().unwrap().1.0, [2.0, 3.0]);
        let relations = "k1 = { varies-percent = 2.0 }\nk2 = \"own\"\nk3 = { trend = \"rate\" }\n";
        let relations: ByParameter<BetweenTestsCase> = toml::from_str(relations).unwrap();
        assert_eq!(relations.names().collect::<Vec<_>>(), ["k1", "k2", "k3"]);
        let [varying, own] = [BetweenTestsCase::VariesPercent(2.0), BetweenTestsCase::Own];
        assert_eq!(
            relations.iter().map(|(_, relation)| *relation).take(2).collect::<Vec<_>>(),
            [varying, own]
        );
        let error = toml::from_str::<PriorCase>("young_mpa = 3.0").unwrap_err().to_string();
        assert!(error.contains("with its region"), "{error}");
    }

    #[test]
    fn parameters_are_ordered_by_table_and_property_however_they_are_written() {
        let text = "test.friction = 0.1\nmatrix.viscosity_mpa_s = 0.3\nmatrix.young_mpa = 275.0\n\
                    grain.poisson = 0.2\ninterface.matrix-grain.toughness_n_per_mm = 0.001\n";
        let values: ByParameter<f64> = toml::from_str(text).unwrap();
        let names: Vec<String> = values.names().collect();
        let ordered = [
            "grain.poisson",
            "interface.matrix-grain.toughness_n_per_mm",
            "matrix.young_mpa",
            "matrix.viscosity_mpa_s",
            "test.friction",
        ];
        assert_eq!(names, ordered);
        let again = toml::to_string(&values).unwrap();
        assert_eq!(toml::from_str::<ByParameter<f64>>(&again).unwrap(), values);
    }
}
