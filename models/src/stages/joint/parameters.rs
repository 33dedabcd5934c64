//! Parameters of a joint calibration, for verdict and report.

use ppl::diagnostics::{mcse_mean, mcse_quantile, mcse_sd};
use serde::{Deserialize, Serialize};

use crate::case::Parameter;
use crate::error::InputError;
use crate::pipeline::inputs::Inputs;
use crate::prior::Prior;
use crate::report::CalibratedParameter;
use crate::results_folder::error::WorkflowError;
use crate::table::CsvTable;

/// File with the parameters of the joint model.
pub(super) const FILE: &str = "joint/parameters.json";

/// A parameter of the joint model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct JointParameter {
    /// Path of the parameter, followed by the name of the test in parentheses for a parameter of one test, or by the end
    /// of the trend, such as `(at 20 °C)`.
    pub(super) name: String,
    pub(super) prior: Prior,
}

/// Path of the parameter, and the name of its test or the end of its trend.
pub(super) fn path_and_test(name: &str) -> (&str, Option<&str>) {
    match name.strip_suffix(')').and_then(|rest| rest.split_once(" (")) {
        Some((path, test)) => (path, Some(test)),
        None => (name, None),
    }
}

/// Symbol and unit of a parameter, with its region and the name of its test.
pub(super) fn label(name: &str) -> String {
    let (path, test) = path_and_test(name);
    let parameter: Result<Parameter, _> = path.parse();
    let label = parameter.map_or_else(|_| path.to_owned(), |p| p.label_and_unit(true));
    match test {
        Some(test) => format!("{label}, {test}"),
        None => label,
    }
}

/// Parameters of the joint posterior with their draws, labelled by their names.
///
/// # Errors
/// Fails if a result is missing or cannot be read.
pub(super) fn parameters(inputs: &Inputs<'_>) -> Result<Vec<CalibratedParameter>, WorkflowError> {
    let joint_parameters: Vec<JointParameter> = inputs.json(FILE)?;
    let [draws, summary, map] = ["posterior.csv", "summary.csv", "map.csv"].map(|f| inputs.file(f));
    let (draws, summary, map) = (draws?, summary?, map?);
    let draws = CsvTable::read(&draws, &["chain"])?;
    let summary = CsvTable::read(&summary, &["parameter", "contraction"])?;
    let map = CsvTable::read(&map, &["parameter", "map"])?;
    let parameter = |JointParameter { name, prior }: JointParameter| {
        let chains = chains(&draws, &name)?;
        let slices: Vec<&[f64]> = chains.iter().map(Vec::as_slice).collect();
        let row = summary.named("parameter", &name)?;
        let point = map.named("parameter", &name)?;
        Ok(CalibratedParameter {
            label: name.clone(),
            prior,
            mean: (row.number("mean")?, mcse_mean(&slices)),
            sd: (row.number("sd")?, mcse_sd(&slices)),
            q05: (row.number("q05")?, mcse_quantile(&slices, 0.05)),
            q95: (row.number("q95")?, mcse_quantile(&slices, 0.95)),
            contraction: row.number("contraction")?,
            map: point.number("map")?,
            truth: point.text("truth").parse().ok(),
            chains,
            ..CalibratedParameter::default()
        })
    };
    Ok(joint_parameters.into_iter().map(parameter).collect::<Result<_, InputError>>()?)
}

/// Draws of one column, for each chain.
fn chains(draws: &CsvTable<'_>, name: &str) -> Result<Vec<Vec<f64>>, InputError> {
    let mut chains: Vec<Vec<f64>> = Vec::new();
    for row in draws.rows() {
        let chain = row.number("chain")? as usize;
        chains.resize(chains.len().max(chain + 1), Vec::new());
        chains[chain].push(row.number(name)?);
    }
    Ok(chains)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_parameter_of_one_test_is_labelled_with_the_test() {
        assert_eq!(path_and_test("test.friction (slow)"), ("test.friction", Some("slow")));
        assert_eq!(path_and_test("matrix.young_mpa"), ("matrix.young_mpa", None));
        assert_eq!(label("matrix.young_mpa (slow)"), "matrix E (MPa), slow");
        assert_eq!(label("matrix.young_mpa (at 20 °C)"), "matrix E (MPa), at 20 °C");
        assert_eq!(label("sd[slope (slow)]"), "sd[slope (slow)]");
    }
}
