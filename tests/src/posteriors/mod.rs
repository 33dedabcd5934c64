//! Published posteriors: their data, the models rewritten in `model!`, and reference moments.
//!
//! Data and references are in `fixtures/posteriors`, each with its source. A flat prior of the original model is
//! replaced by a normal prior (half-normal for scales). This prior is so wide that no moment changes by more than a
//! thousandth of its standard deviation.

pub mod exact;
pub mod hierarchy;
pub mod process;
pub mod regression;
pub mod series;

use ppl::Posterior;
use ppl::check::{CheckFailure, Estimate};
use serde_json::Value;

use crate::number;

/// A data set of the fixtures.
#[derive(Debug)]
pub struct Data(Value);

impl Data {
    /// Parses the text of a fixture.
    ///
    /// # Panics
    /// If the text is not JSON.
    pub fn parse(text: &str) -> Self {
        Self(serde_json::from_str(text).expect("the fixture is JSON"))
    }

    /// Returns a column of numbers.
    ///
    /// # Panics
    /// If there is no such column.
    pub fn column(&self, name: &str) -> Vec<f64> {
        self.list(name).iter().map(number).collect()
    }

    /// Returns a column of counts or indices.
    ///
    /// # Panics
    /// If there is no such column.
    pub fn counts(&self, name: &str) -> Vec<u64> {
        self.list(name).iter().map(|v| v.as_u64().expect("a count")).collect()
    }

    fn list(&self, name: &str) -> &[Value] {
        self.0[name].as_array().unwrap_or_else(|| panic!("the fixture has no column `{name}`"))
    }
}

/// Combines columns to the rows of a design matrix.
pub fn rows<const D: usize>(columns: [&[f64]; D]) -> Vec<[f64; D]> {
    (0..columns[0].len()).map(|i| columns.map(|column| column[i])).collect()
}

/// Reference moments of one published posterior.
#[derive(Debug)]
pub struct Reference {
    /// Name, as in the test's table.
    pub name: String,
    rows: Vec<Value>,
}

/// Returns all references of the fixtures.
///
/// # Panics
/// If the fixture is damaged.
pub fn references() -> Vec<Reference> {
    let text = include_str!("../../fixtures/posteriors/references.json");
    let all: Vec<Value> = serde_json::from_str(text).expect("the fixture is JSON");
    let read = |v: &Value| Reference {
        name: v["name"].as_str().expect("a name").to_owned(),
        rows: v["rows"].as_array().expect("rows").clone(),
    };
    all.iter().map(read).collect()
}

impl Reference {
    /// Compares the means, and the second moments or standard deviations, of all quantities of the reference with the
    /// moments of `posterior`. Returns the number of comparisons, and the comparisons that differ by more than 4
    /// standard errors of the difference.
    ///
    /// # Panics
    /// If the posterior lacks a quantity.
    pub fn compare(&self, posterior: &Posterior) -> (usize, Vec<CheckFailure>) {
        let mut results = Vec::new();
        for row in &self.rows {
            let name = row["of"].as_str().expect("a name");
            let trace = posterior.trace(name).unwrap_or_else(|| panic!("no `{name}`"));
            let chains: Vec<&[f64]> = trace.iter().map(Vec::as_slice).collect();
            let (mean, error) = (number(&row["mean"][0]), number(&row["mean"][1]));
            results.push(Estimate::of_mean(name, &chains, mean).reference_error(error).check(4.0));
            if !row["square"].is_null() {
                let squares: Vec<Vec<f64>> =
                    trace.iter().map(|c| c.iter().map(|x| x * x).collect()).collect();
                let squares: Vec<&[f64]> = squares.iter().map(Vec::as_slice).collect();
                let (square, error) = (number(&row["square"][0]), number(&row["square"][1]));
                let estimate = Estimate::of_mean(&format!("{name}²"), &squares, square);
                results.push(estimate.reference_error(error).check(4.0));
            }
            if !row["sd"].is_null() {
                let [sd, rounding, draws] = [0, 1, 2].map(|i| number(&row["sd"][i]));
                let error = rounding.hypot(sd * relative_error_of_sd(&chains, draws));
                let estimate = Estimate::of_sd(name, &chains, sd).reference_error(error);
                results.push(estimate.check(4.0));
            }
        }
        (results.len(), results.into_iter().filter_map(Result::err).collect())
    }
}

/// Relative standard error √((κ − 1)/(4n)) of the standard deviation of n = `effective` independent draws, where κ is
/// the kurtosis of `chains`.
fn relative_error_of_sd(chains: &[&[f64]], effective: f64) -> f64 {
    let all = chains.concat();
    let n = all.len() as f64;
    let mean = all.iter().sum::<f64>() / n;
    let moment = |p: i32| all.iter().map(|x| (x - mean).powi(p)).sum::<f64>() / n;
    ((moment(4) / moment(2).powi(2) - 1.0) / (4.0 * effective)).sqrt()
}
