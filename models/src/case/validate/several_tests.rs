//! Checks of a case with several tests: checks of each test, and of the keys that apply to all
//! tests.

use super::super::several_tests::{TestMistake, check_name, is_reserved, read_tests};
use super::super::{
    BetweenTestsCase, CaseFile, Mistakes, SingleTest, TrendCase, TrendValues, TrendVariable,
};
use crate::error::InputError;

/// Checks each test of a case as a complete case, and the keys that apply to all tests. Returns all errors.
pub(super) fn check_tests(file: &CaseFile) -> Vec<InputError> {
    let mut mistakes = Mistakes::default();
    let mut names: Vec<&str> = Vec::new();
    for (place, test) in file.case.tests.iter().enumerate() {
        let named = check_name(&test.name, &names).map_err(|(problem, help)| {
            file.error(&format!("tests[{place}].name"), format!("{:?}", test.name), problem, help)
        });
        mistakes.note(named);
        names.push(&test.name);
    }
    for region in file.case.material.keys().filter(|region| is_reserved(region)) {
        let problem = "is a table of parameters, beside [[tests]] no name of a region";
        let help = "Give the region another name.";
        mistakes.note(Err(file.error(&format!("material.{region}"), "", problem, help)));
    }
    for (table, is_missing, help) in [
        ("prior", file.case.prior.is_none(), "Add [prior]: it names the parameters of all tests."),
        (
            "experiments",
            file.case.experiments.is_none(),
            "Add [experiments] with a table that has the column test, or with virtual specimens.",
        ),
    ] {
        if is_missing {
            let problem = "is missing: several tests are calibrated together";
            mistakes.note(Err(file.error(table, "", problem, help)));
        }
    }
    if let Some(entry) = file.case.validation.first() {
        let problem = "needs the posterior of a single test, and this case has several";
        let help = "Write it in a case with one of the tests and no [[tests]], which calibrates this test alone.";
        mistakes.note(Err(file.error("validation", format!("{:?}", entry.name), problem, help)));
    }
    if let Some(candidate) = file.case.further_tests.candidate.first() {
        let problem = "looks at one further test of a single test, and this case has several";
        let help = "Write it in a case with one of the tests.";
        mistakes.note(Err(file.error("further_tests.candidate", &candidate.name, problem, help)));
    }
    let read = read_tests(file);
    let mut all = mistakes.into_vec();
    all.extend(in_words(read.mistakes, file.case.tests.len()));
    if all.is_empty() {
        let mut mistakes = Mistakes::default();
        check_relations(file, &read.tests, &mut mistakes);
        all = mistakes.into_vec();
    }
    all
}

/// Converts mistakes of tests to errors of the case. A mistake that all tests have is a mistake of the case itself. Every
/// other mistake is preceded by the names of its tests.
fn in_words(mistakes: Vec<TestMistake>, tests: usize) -> Vec<InputError> {
    let mut found: Vec<(InputError, Vec<String>)> = Vec::new();
    for TestMistake { test, error } in mistakes {
        match found.iter_mut().find(|(other, _)| *other == error) {
            Some((_, of)) => of.push(test),
            None => found.push((error, vec![test])),
        }
    }
    let named = |(error, of): (InputError, Vec<String>)| {
        if of.len() == tests {
            return error;
        }
        let place = format!("tests ({})", of.join(", "));
        let place = match error.place.is_empty() {
            true => place,
            false => format!("{place}.{}", error.place),
        };
        InputError { place, ..error }
    };
    found.into_iter().map(named).collect()
}

/// Checks `calibration.between_tests`.
fn check_relations(file: &CaseFile, tests: &[SingleTest], mistakes: &mut Mistakes) {
    for (parameter, relation) in file.case.calibration.between_tests.iter() {
        let key = format!("calibration.between_tests.{parameter}");
        let prior = file.case.whole_prior();
        let Some(prior) = prior.as_ref().and_then(|prior| prior.get(parameter)) else {
            let problem = "is no parameter of [prior]";
            let help = "Name a parameter that [prior] gives for all tests.";
            mistakes.note(Err(file.error(&key, "", problem, help)));
            continue;
        };
        let does = match *relation {
            BetweenTestsCase::Shared | BetweenTestsCase::Own => continue,
            BetweenTestsCase::VariesPercent(percent) => {
                let help = "It is the scale of the prior of its standard deviation between tests: 5.0 for some 5 %.";
                mistakes.note(file.within(&key, percent, 0.01, 100.0, "%", help));
                "varies"
            }
            BetweenTestsCase::Trend(trend) => {
                check_trend(file, &key, trend, tests, mistakes);
                "follows a trend"
            }
        };
        let [lower, _] = prior.range();
        if lower <= 0.0 {
            let problem = format!("{does} by factors, but its prior begins at {lower}");
            let help = "Begin its prior above 0.";
            mistakes.note(Err(file.error(&key, "", problem, help)));
        }
        let own = tests.iter().find(|test| test.own.contains(&parameter.to_string()));
        if let Some(test) = own {
            let problem = format!("{does} between tests, but {} has a prior of its own", test.name);
            let help = "Remove one of the two.";
            mistakes.note(Err(file.error(&key, "", problem, help)));
        }
    }
}

/// Checks that every test has a value of the variable of a trend, and that the values differ.
fn check_trend(
    file: &CaseFile,
    key: &str,
    TrendCase { trend, deviation_percent }: TrendCase,
    tests: &[SingleTest],
    mistakes: &mut Mistakes,
) {
    let help = "It is the scale of the prior of the deviations from the trend: 2.0 for some 2 %, 0.0 for none.";
    mistakes.note(file.within(key, deviation_percent, 0.0, 100.0, "%", help));
    let variable = match trend {
        TrendVariable::Temperature => "temperature",
        TrendVariable::Rate => "rate",
    };
    match trend.values(tests) {
        Err(test) => {
            let problem = format!("follows the {variable}, but {test} has none");
            let help = match trend {
                TrendVariable::Temperature => {
                    "Write set.test.temperature_celsius in each test, or temperature_celsius in [test]."
                }
                TrendVariable::Rate => {
                    "The rate is the first speed of the platen: test.displacement_mm / test.duration_s, or that of \
                     test.program."
                }
            };
            mistakes.note(Err(file.error(key, "", problem, help)));
        }
        Ok(TrendValues { at, unit }) => {
            let first = at.values().next().copied().unwrap_or_default();
            if at.values().all(|x| *x == first) {
                let problem =
                    format!("follows the {variable}, but all tests have {first} {unit}");
                let help = "Remove it, or give the tests different values.";
                mistakes.note(Err(file.error(key, "", problem, help)));
            }
            if trend == TrendVariable::Rate
                && let Some((test, x)) = at.iter().find(|(_, x)| **x <= 0.0)
            {
                let problem = format!("follows the rate, but {test} has {x} {unit}");
                let help = "A power law needs rates above 0.";
                mistakes.note(Err(file.error(key, "", problem, help)));
            }
        }
    }
}
