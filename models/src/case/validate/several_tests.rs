//! Checks of a case with several tests: checks of each test, and of the keys that apply to all
//! tests.

use super::super::several_tests::{TestMistake, check_name, is_reserved, read_tests};
use super::super::validation::validation_case;
use super::super::{
    BetweenTestsCase, CaseFile, Mistakes, SingleTest, TestEntry, TrendCase, TrendValues,
    TrendVariable,
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
        let problem =
            "is a table of parameters; in a case with [[tests]] it is not the name of a region";
        let help = "Give the region another name.";
        mistakes.note(Err(file.error(&format!("material.{region}"), "", problem, help)));
    }
    // each test can name its own specimens instead
    let has_specimens = |test: &TestEntry| {
        let experiments =
            test.set.get("experiments").and_then(|experiments| experiments.as_table());
        let sources = ["table", "values", "virtual"];
        experiments.is_some_and(|own| sources.iter().any(|key| own.contains_key(*key)))
    };
    for (table, is_missing, help) in [
        ("prior", file.case.prior.is_none(), "Add [prior]: it names the parameters of all tests."),
        (
            "experiments",
            file.case.experiments.is_none() && !file.case.tests.iter().all(has_specimens),
            "Add [experiments] with a table that has the column test, or with virtual specimens; or write set.experiments.table \
             in each test.",
        ),
    ] {
        if is_missing {
            let problem = "is missing: several tests are calibrated together";
            mistakes.note(Err(file.error(table, "", problem, help)));
        }
    }
    check_entries_of_tests(file, &names, &mut mistakes);
    let read = read_tests(file);
    let mut all = mistakes.into_vec();
    all.extend(in_words(read.mistakes, file.case.tests.len()));
    if all.is_empty() {
        let mut mistakes = Mistakes::default();
        check_relations(file, &read.tests, &mut mistakes);
        check_candidates(file, &read.tests, &mut mistakes);
        all = mistakes.into_vec();
    }
    all
}

/// Checks that each validation and each candidate names one of the tests, and that the validations have different names.
fn check_entries_of_tests(file: &CaseFile, names: &[&str], mistakes: &mut Mistakes) {
    let validations = file.case.validation.iter().map(|own| ("validation", &own.name, &own.test));
    let candidates = file.case.further_tests.candidate.iter();
    let candidates = candidates.map(|own| ("further_tests.candidate", &own.name, &own.test));
    for (table, name, test) in validations.chain(candidates) {
        let key = format!("{table} ({name}).test");
        let help = format!("Write test = \"…\" beside name, with one of: {}.", names.join(", "));
        match test {
            Some(test) if names.contains(&test.as_str()) => {}
            Some(test) => {
                let problem = "is no name of a test";
                mistakes.note(Err(file.error(&key, format!("{test:?}"), problem, help)));
            }
            None => {
                let problem = "is missing: with [[tests]], it is the test whose keys are changed";
                mistakes.note(Err(file.error(&key, "", problem, help)));
            }
        }
    }
    let mut earlier: Vec<&str> = Vec::new();
    for entry in &file.case.validation {
        if earlier.contains(&entry.name.as_str()) {
            let problem = "is the name of two validations";
            let help = "Give each validation a name of its own.";
            let value = format!("{:?}", entry.name);
            mistakes.note(Err(file.error("validation.name", value, problem, help)));
        }
        earlier.push(&entry.name);
    }
    let prior = file.case.whole_prior().unwrap_or_default();
    for (parameter, width) in file.case.further_tests.width90.iter() {
        let of_test = |test: &TestEntry| test.prior.get(parameter).is_some();
        if prior.get(parameter).is_none() && !file.case.tests.iter().any(of_test) {
            let key = format!("further_tests.width90.{parameter}");
            let help = "Name a parameter of [prior], or of the prior of a test.";
            mistakes.note(Err(file.error(&key, width.to_string(), "is not calibrated", help)));
        }
    }
    for candidate in &file.case.further_tests.candidate {
        let key = format!("further_tests.candidate ({})", candidate.name);
        if !candidate.is_another_test() {
            let problem =
                "asks for further quantities of present curves, which several tests cannot answer";
            let help = "Add the quantity to the test (set.qoi.quantities) and calibrate, or name keys in set.";
            mistakes.note(Err(file.error(&key, "", problem, help)));
        }
    }
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

/// Refuses candidates that have the values of another test of the case. The check of each test refuses its own values.
fn check_candidates(file: &CaseFile, tests: &[SingleTest], mistakes: &mut Mistakes) {
    for test in tests {
        let candidates = test.file.case.further_tests.candidate.iter();
        for candidate in candidates.filter(|candidate| candidate.is_another_test()) {
            // the check of the test reports the mistakes of its candidates
            let Ok(own) = test.file.of_candidate(candidate) else { continue };
            let others = tests.iter().filter(|other| other.name != test.name);
            let same = { others }.find(|other| other.file.is_present_test(candidate, &own));
            if let Some(same) = same {
                let key = format!("further_tests.candidate ({}).set", candidate.name);
                let problem = format!("has the values of the test {}", same.name);
                let help =
                    "Change another value. More specimens of a present test need no candidate.";
                mistakes.note(Err(file.error(&key, "", problem, help)));
            }
        }
    }
}

/// Checks `calibration.between_tests`.
fn check_relations(file: &CaseFile, tests: &[SingleTest], mistakes: &mut Mistakes) {
    for (parameter, relation) in file.case.calibration.between_tests.iter() {
        let key = format!("calibration.between_tests.{parameter}");
        let prior = file.case.whole_prior();
        let Some(prior) = prior.as_ref().and_then(|prior| prior.get(parameter)) else {
            let problem = "is not a parameter of [prior]";
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

/// Checks that every validation has a value of the variable of a trend.
fn check_trend_in_validations(
    file: &CaseFile,
    trend: TrendVariable,
    tests: &[SingleTest],
    mistakes: &mut Mistakes,
) {
    for test in tests {
        for (place, entry) in test.file.case.validation.iter().enumerate() {
            // the check of the test reports the mistakes of its validations
            let Ok(own) = validation_case(&test.file, entry, place) else { continue };
            let own = SingleTest { name: entry.name.clone(), file: own, own: Vec::new() };
            if let Err(problem) = trend.value_in(&own, tests) {
                let key = format!("validation ({}).set", entry.name);
                let help = "The parameter that follows the trend has no value in this validation: give it the key.";
                mistakes.note(Err(file.error(&key, "", problem, help)));
            }
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
            check_trend_in_validations(file, trend, tests, mistakes);
            let first = at.values().next().copied().unwrap_or_default();
            if at.values().all(|x| *x == first) {
                let problem = format!("follows the {variable}, but all tests have {first} {unit}");
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
