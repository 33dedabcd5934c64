//! Priors as they are written in a case: `[250.0, 300.0]`, or a table with the name of a distribution.

use std::collections::BTreeMap;
use std::fmt;

use serde::de::value::SeqAccessDeserializer;
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::Prior;

/// Defines a list of words of a case file.
macro_rules! words {
    ($(#[$doc:meta])* $Name:ident: $($Word:ident = $word:literal),* $(,)?) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
        pub enum $Name {$(
            #[doc = concat!("`", $word, "`")]
            #[serde(rename = $word)]
            $Word
        ),*}

        impl fmt::Display for $Name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.pad(match self { $(Self::$Word => $word),* })
            }
        }
    };
}

words! {
    /// PriorFamily of distributions of a [`Prior`].
    PriorFamily:
    Uniform = "uniform",
    Normal = "normal",
    LogNormal = "lognormal",
    Gamma = "gamma",
    Beta = "beta",
    StudentT = "student-t",
    Exponential = "exponential",
    Weibull = "weibull",
    InverseGamma = "inverse-gamma",
    Triangular = "triangular",
}

words! {
    /// PriorKey of a prior in a case.
    PriorKey:
    Distribution = "distribution",
    Range = "range",
    Mean = "mean",
    Sd = "sd",
    Median = "median",
    Factor = "factor",
    Shape = "shape",
    Rate = "rate",
    A = "a",
    B = "b",
    DegreesOfFreedom = "degrees_of_freedom",
    Location = "location",
    Scale = "scale",
    Lower = "lower",
    Mode = "mode",
    Upper = "upper",
}

impl PriorFamily {
    /// Keys of the family's parameters. The lognormal distribution has a median and the factor exp(σ), where σ is the
    /// standard deviation of the logarithm.
    pub fn keys(self) -> &'static [PriorKey] {
        match self {
            Self::Uniform => &[],
            Self::Normal => &[PriorKey::Mean, PriorKey::Sd],
            Self::LogNormal => &[PriorKey::Median, PriorKey::Factor],
            Self::Gamma => &[PriorKey::Shape, PriorKey::Rate],
            Self::Beta => &[PriorKey::A, PriorKey::B],
            Self::StudentT => &[PriorKey::DegreesOfFreedom, PriorKey::Location, PriorKey::Scale],
            Self::Exponential => &[PriorKey::Rate],
            Self::Weibull | Self::InverseGamma => &[PriorKey::Shape, PriorKey::Scale],
            Self::Triangular => &[PriorKey::Lower, PriorKey::Mode, PriorKey::Upper],
        }
    }
}

/// Error of a key, with the help for the user.
fn error<E: Error>(problem: impl fmt::Display, help: impl fmt::Display) -> E {
    E::custom(format!("{problem}; help: {help}"))
}

impl Serialize for Prior {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if self.is_uniform() {
            return self.range.serialize(serializer);
        }
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry(&PriorKey::Distribution, &self.family)?;
        for (key, value) in self.family.keys().iter().zip(self.values) {
            map.serialize_entry(key, &value)?;
        }
        map.serialize_entry(&PriorKey::Range, &self.range)?;
        map.end()
    }
}

impl<'de> Deserialize<'de> for Prior {
    fn deserialize<D: Deserializer<'de>>(source: D) -> Result<Self, D::Error> {
        source.deserialize_any(PriorVisitor)
    }
}

/// Visitor that reads a range or a table.
struct PriorVisitor;

impl<'de> Visitor<'de> for PriorVisitor {
    type Value = Prior;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("[lower, upper] or a table with a distribution")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, numbers: A) -> Result<Prior, A::Error> {
        let [lower, upper] = two_numbers(SeqAccessDeserializer::new(numbers))?;
        Ok(Prior::uniform(lower, upper))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Prior, A::Error> {
        let (mut family, mut range, mut values) = (None, None, BTreeMap::new());
        while let Some(key) = map.next_key::<PriorKey>()? {
            match key {
                PriorKey::Distribution => family = Some(map.next_value::<PriorFamily>()?),
                PriorKey::Range => range = Some(map.next_value::<PriorBounds>()?.0),
                key => drop(values.insert(key, map.next_value::<f64>()?)),
            }
        }
        let family = family.ok_or_else(|| {
            let help = "Name it: distribution = \"lognormal\", or write [lower, upper].";
            error("the prior names no distribution", help)
        })?;
        let keys = family.keys();
        let names: Vec<String> = keys.iter().map(|key| format!("{key} = …")).collect();
        let write = || {
            let names: String = names.iter().map(|name| format!("{name}, ")).collect();
            format!("Write {{ distribution = \"{family}\", {names}range = [lower, upper] }}.")
        };
        if let Some(key) = values.keys().find(|key| !keys.contains(key)) {
            return Err(error(format!("the distribution {family} has no key {key}"), write()));
        }
        let is_missing = |key: &&PriorKey| !values.contains_key(key);
        if let Some(key) = keys.iter().find(is_missing) {
            return Err(error(format!("the distribution {family} needs the key {key}"), write()));
        }
        let values: Vec<f64> = keys.iter().map(|key| values[key]).collect();
        let prior = Prior::new(family, &values);
        match range {
            Some([lower, upper]) => Ok(prior.within(lower, upper)),
            None if prior.is_uniform() => Err(error("a uniform prior needs a range", write())),
            None => Ok(prior),
        }
    }
}

/// Lower and upper bound of a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct PriorBounds(#[serde(deserialize_with = "two_numbers")] pub [f64; 2]);

/// Reads exactly two numbers. Deserialising an array `[f64; 2]` would ignore further numbers.
fn two_numbers<'de, D: Deserializer<'de>>(source: D) -> Result<[f64; 2], D::Error> {
    let numbers = Vec::<f64>::deserialize(source)?;
    let count = numbers.len();
    numbers
        .try_into()
        .map_err(|_| D::Error::custom(format!("{count} numbers, expected two: [lower, upper]")))
}
