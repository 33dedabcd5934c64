//! Names of the folders and files of a case with several tests.

/// Folder of the results of a test, within the results folder of the case.
pub(crate) fn of_test(name: &str) -> String {
    format!("tests/{name}")
}

/// File with the draws of a test from the joint posterior.
pub(crate) fn draws_of(name: &str) -> String {
    format!("joint/{name}.json")
}

/// File with the draws of the joint posterior at which a validation simulates its test.
pub(crate) fn draws_of_validation(name: &str) -> String {
    format!("joint/validation/{name}.json")
}

/// File with the draws of the joint posterior for a candidate for a further test. `number` counts the candidates of a
/// test from 1.
pub(crate) fn draws_of_candidate(test: &str, number: usize) -> String {
    format!("joint/candidate/{test}-{number}.json")
}

/// Path of a file of the case's results folder, relative to the folder of a test.
pub(crate) fn from_test(file: &str) -> String {
    format!("../../{file}")
}
