//! `calibration.between_tests`: relation between the values of a parameter in several tests.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use toml::Value;

/// Relation between the values of a parameter in several tests.
///
/// # Example
/// ```
/// use models::case::{BetweenTestsCase, TrendCase, TrendVariable};
///
/// let table: toml::Table = "relation = { trend = \"temperature\", deviation-percent = 2.0 }".parse()?;
/// let relation: BetweenTestsCase = table["relation"].clone().try_into()?;
/// let trend = TrendCase { trend: TrendVariable::Temperature, deviation_percent: 2.0 };
/// assert_eq!(relation, BetweenTestsCase::Trend(trend));
/// # Ok::<(), toml::de::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum BetweenTestsCase {
    /// All tests have the same value.
    Shared,
    /// Each test has a separate value.
    Own,
    /// The value varies between tests about a common centre. The number is the scale in % of the prior of the standard
    /// deviation between tests.
    VariesPercent(f64),
    /// The logarithm of the value is linear in a variable of the tests.
    Trend(TrendCase),
}

/// Trend of a parameter over a variable of the tests.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct TrendCase {
    /// The variable.
    pub trend: TrendVariable,
    /// Scale in % of the prior of the standard deviation with which the value in each test deviates from the trend; 0: no
    /// deviations.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(!skip_serializing_if)]
    #[schemars(range(min = 0, max = 100))]
    pub deviation_percent: f64,
}

fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// Variable of the tests that a trend is a function of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum TrendVariable {
    /// `test.temperature_celsius`: the logarithm of the parameter is linear in the temperature.
    Temperature,
    /// First speed of the platen, divided by the height of the specimen: the parameter is a power of the rate.
    Rate,
}

/// Table with the key `varies-percent`.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Varies {
    /// Scale in % of the prior of the standard deviation between tests.
    #[schemars(range(min = 0.01, max = 100))]
    varies_percent: f64,
}

impl Serialize for BetweenTestsCase {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match *self {
            Self::Shared => serializer.serialize_str("shared"),
            Self::Own => serializer.serialize_str("own"),
            Self::VariesPercent(varies_percent) => Varies { varies_percent }.serialize(serializer),
            Self::Trend(trend) => trend.serialize(serializer),
        }
    }
}

impl JsonSchema for BetweenTestsCase {
    fn schema_name() -> Cow<'static, str> {
        "BetweenTestsCase".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let tables = [generator.subschema_for::<Varies>(), generator.subschema_for::<TrendCase>()];
        let [varies, trend] = tables;
        json_schema!({
            "description": "Relation between the values of the parameter in the tests.",
            "anyOf": [{ "type": "string", "enum": ["shared", "own"] }, varies, trend],
        })
    }
}

impl<'de> Deserialize<'de> for BetweenTestsCase {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        const FORMS: [&str; 4] = ["shared", "own", "varies-percent", "trend"];
        let error = |e: toml::de::Error| D::Error::custom(e.message());
        match Value::deserialize(deserializer)? {
            Value::String(word) if word == "shared" => Ok(Self::Shared),
            Value::String(word) if word == "own" => Ok(Self::Own),
            Value::Table(table) if table.contains_key("trend") => {
                table.try_into().map(Self::Trend).map_err(error)
            }
            Value::Table(table) if table.contains_key("varies-percent") => {
                let Varies { varies_percent } = table.try_into().map_err(error)?;
                Ok(Self::VariesPercent(varies_percent))
            }
            Value::String(word) => Err(D::Error::unknown_variant(&word, &FORMS)),
            Value::Table(table) => {
                let key = table.keys().next().map_or("", String::as_str);
                Err(D::Error::unknown_field(key, &FORMS[2..]))
            }
            _ => Err(D::Error::custom(
                "expected \"shared\", \"own\", { varies-percent = 5.0 }, { trend = \"temperature\" } or { trend = \
                 \"rate\" }",
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relations_are_read_as_they_are_written() {
        let rate = TrendCase { trend: TrendVariable::Rate, deviation_percent: 0.0 };
        for relation in [
            BetweenTestsCase::Shared,
            BetweenTestsCase::Own,
            BetweenTestsCase::VariesPercent(5.0),
            BetweenTestsCase::Trend(rate),
            BetweenTestsCase::Trend(TrendCase { deviation_percent: 1.5, ..rate }),
        ] {
            let value = Value::try_from(relation).unwrap();
            assert_eq!(value.try_into::<BetweenTestsCase>().unwrap(), relation);
        }
        let read = |text: &str| {
            let table: toml::Table = text.parse().unwrap();
            table["r"].clone().try_into::<BetweenTestsCase>().unwrap_err().to_string()
        };
        for (text, part) in [
            ("r = \"both\"", "expected one of `shared`, `own`"),
            ("r = 5.0", "expected \"shared\", \"own\""),
            ("r = { varies = 5.0 }", "`varies-percent` or `trend`"),
            ("r = { trend = \"pressure\" }", "`temperature` or `rate`"),
            ("r = { trend = \"rate\", deviation = 5.0 }", "deviation-percent"),
            ("r = { varies-percent = 5.0, trends = 1 }", "varies-percent"),
        ] {
            assert!(read(text).contains(part), "{text}: {}", read(text));
        }
    }
}
