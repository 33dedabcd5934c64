//! Parameters of a joint calibration, for verdict and report.

use std::collections::BTreeMap;

use ppl::diagnostics::{mcse_mean, mcse_quantile, mcse_sd};
use serde::{Deserialize, Serialize};

use crate::case::Parameter;
use crate::error::InputError;
use crate::fracture::{Scope, ScopedParameter};
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
    pub(super) parameter: ScopedParameter,
    pub(super) prior: Prior,
}

/// Reads the parameters of the joint model, in the order of the posterior.
///
/// # Errors
/// Fails if the file is missing or cannot be read.
pub(super) fn joint_parameters(inputs: &Inputs<'_>) -> Result<Vec<JointParameter>, WorkflowError> {
    inputs.json(FILE)
}

/// Symbol and unit of a parameter, with its region, and the name of its test or the end of its trend.
fn label_of(parameter: &ScopedParameter) -> String {
    let ScopedParameter { path, scope } = parameter;
    let parsed: Result<Parameter, _> = path.parse();
    let label = parsed.map_or_else(|_| path.clone(), |p| p.label_and_unit(true));
    match scope {
        Scope::Shared => label,
        Scope::Test(place) | Scope::TrendEnd(place) => format!("{label}, {place}"),
    }
}

/// Labels of the parameters of a joint calibration.
pub(super) struct Labels(BTreeMap<String, String>);

impl Labels {
    /// Reads the parameters of the joint model.
    ///
    /// # Errors
    /// The errors of [`joint_parameters`].
    pub(super) fn read(inputs: &Inputs<'_>) -> Result<Self, WorkflowError> {
        let parameters = joint_parameters(inputs)?.into_iter();
        Ok(Self(parameters.map(|p| (p.parameter.to_string(), label_of(&p.parameter))).collect()))
    }

    /// The label of the parameter with this name; the name itself for other quantities of the posterior.
    pub(super) fn of(&self, name: &str) -> String {
        self.0.get(name).cloned().unwrap_or_else(|| name.to_owned())
    }
}

/// Parameters of the joint posterior with their draws, labelled by their names.
///
/// # Errors
/// Fails if a result is missing or cannot be read.
pub(super) fn parameters(inputs: &Inputs<'_>) -> Result<Vec<CalibratedParameter>, WorkflowError> {
    let joint_parameters = joint_parameters(inputs)?;
    let [draws, summary, map] = ["posterior.csv", "summary.csv", "map.csv"].map(|f| inputs.file(f));
    let (draws, summary, map) = (draws?, summary?, map?);
    let draws = CsvTable::read(&draws, &["chain"])?;
    let summary = CsvTable::read(&summary, &["parameter", "contraction"])?;
    let map = CsvTable::read(&map, &["parameter", "map"])?;
    let parameter = |JointParameter { parameter, prior }: JointParameter| {
        let name = parameter.to_string();
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
        let young = |scope| ScopedParameter { path: "matrix.young_mpa".to_owned(), scope };
        for (scope, name, label) in [
            (Scope::Shared, "matrix.young_mpa", "matrix E (MPa)"),
            // a test may have any name
            (Scope::Test("a (b)".into()), "matrix.young_mpa (a (b))", "matrix E (MPa), a (b)"),
            (
                Scope::TrendEnd("at 20 °C".into()),
                "matrix.young_mpa (at 20 °C)",
                "matrix E (MPa), at 20 °C",
            ),
        ] {
            let parameter = young(scope);
            assert_eq!(parameter.to_string(), name);
            let labels = Labels([(parameter.to_string(), label_of(&parameter))].into());
            assert_eq!(labels.of(name), label);
            assert_eq!(labels.of("sd[slope (slow)]"), "sd[slope (slow)]");
        }
    }
}
