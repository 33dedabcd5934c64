//! `calibration.between_tests`: relation between the values of a parameter in several tests.

use std::collections::BTreeMap;

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use toml::Value;

use super::SingleTest;

/// Relation between the values of a parameter in several tests.
///
/// # Example
/// ```
/// use models::{BetweenTestsCase, TrendCase, TrendVariable};
///
/// let read = |text: &str| toml::from_str::<toml::Table>(text)?["relation"].clone().try_into();
/// let trend = TrendCase { trend: TrendVariable::Temperature, deviation_percent: 2.0 };
/// let relation = read("relation = { trend = \"temperature\", deviation-percent = 2.0 }")?;
/// assert_eq!(BetweenTestsCase::Trend(trend), relation);
/// assert_eq!(BetweenTestsCase::Own, read("relation = \"own\"")?);
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
pub struct TrendCase {
    /// The variable.
    pub trend: TrendVariable,
    /// Scale in % of the prior of the standard deviation with which the value in each test deviates from the trend; 0: no
    /// deviations.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub deviation_percent: f64,
}

fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// Variable of the tests that a trend is a function of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum TrendVariable {
    /// `test.temperature_celsius`: the logarithm of the parameter is linear in the temperature.
    Temperature,
    /// First speed of the platen, divided by the height of the specimen: the parameter is a power of the rate.
    Rate,
}

/// Values of the variable of a trend in the tests.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct TrendValues {
    /// Value in each test, by the name of the test.
    pub(crate) at: BTreeMap<String, f64>,
    pub(crate) unit: &'static str,
}

impl TrendVariable {
    /// Returns the values of the variable in the tests. The rate is the strain rate if every test has
    /// `specimen.height_mm`, or else the speed of the platen.
    ///
    /// # Errors
    /// The name of a test without a value.
    pub(crate) fn values(self, tests: &[SingleTest]) -> Result<TrendValues, String> {
        let height = |test: &SingleTest| test.file.case.specimen.height_mm;
        let is_strain = tests.iter().all(|test| height(test).is_some());
        let value = |test: &SingleTest| match self {
            Self::Temperature => test.file.case.test.temperature_celsius,
            Self::Rate => {
                let speed = test.file.case.test.first_speed_mm_per_s()?;
                Some(if is_strain { speed / height(test)? } else { speed })
            }
        };
        let named = |test: &SingleTest| {
            let value = value(test).filter(|x| x.is_finite());
            value.map(|x| (test.name.clone(), x)).ok_or_else(|| test.name.clone())
        };
        let unit = match self {
            Self::Temperature => "°C",
            Self::Rate if is_strain => "1/s",
            Self::Rate => "mm/s",
        };
        Ok(TrendValues { at: tests.iter().map(named).collect::<Result<_, _>>()?, unit })
    }

    /// Returns the value of the variable in a validation, in the unit of the values of the tests.
    ///
    /// # Errors
    /// The reason why the validation has no value in this unit.
    pub(crate) fn value_in(
        self,
        validation: &SingleTest,
        tests: &[SingleTest],
    ) -> Result<f64, String> {
        let no_value = |test: String| format!("{test} has no value of the trend");
        let unit = self.values(tests).map_err(no_value)?.unit;
        let all: Vec<SingleTest> = tests.iter().cloned().chain([validation.clone()]).collect();
        let values = self.values(&all).map_err(no_value)?;
        match values.unit == unit {
            true => Ok(values.at.get(&validation.name).copied().unwrap_or(f64::NAN)),
            false => {
                Err(format!("{} has no specimen.height_mm, and so no strain rate", validation.name))
            }
        }
    }
}

/// Table with the key `varies-percent`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct Varies {
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
    use crate::case::CaseFile;

    /// The rate is a strain rate, unless a test has no height; a validation needs the unit of the tests.
    #[test]
    fn rates_have_the_unit_of_the_tests() {
        let test = |name: &str, speed: f64, height_mm: Option<f64>| {
            let mut file = CaseFile::default_case();
            file.case.test.displacement_mm = Some(speed);
            file.case.test.duration_s = Some(1.0);
            file.case.specimen.height_mm = height_mm;
            SingleTest { name: name.to_owned(), file, own: Vec::new() }
        };
        let rate = TrendVariable::Rate;
        let tests = [test("a", 0.5, Some(5.0)), test("b", 0.01, Some(4.0))];
        let values = rate.values(&tests).unwrap();
        assert_eq!((values.at["a"], values.at["b"], values.unit), (0.1, 0.0025, "1/s"));
        assert_eq!(rate.value_in(&test("c", 0.8, Some(4.0)), &tests).unwrap(), 0.2);
        let error = rate.value_in(&test("c", 0.8, None), &tests).unwrap_err();
        assert!(error.contains("c has no specimen.height_mm"), "{error}");
        let tests = [test("a", 0.5, None), test("b", 0.01, Some(4.0))];
        assert_eq!(
            (rate.values(&tests).unwrap().unit, rate.values(&tests).unwrap().at["b"]),
            ("mm/s", 0.01)
        );
        assert_eq!(TrendVariable::Temperature.values(&tests).unwrap_err(), "a");
    }

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
