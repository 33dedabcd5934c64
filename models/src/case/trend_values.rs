//! Values of the variable of a trend in the tests of a case and in its validations.

use std::collections::BTreeMap;

use super::SingleTest;
use super::between_tests::TrendVariable;

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
}
