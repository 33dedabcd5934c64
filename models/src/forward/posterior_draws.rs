//! Draws of the posterior, as the stage `calibrate` writes them.

use ::surrogate::Input;

use crate::error::InputError;
use crate::fracture::short_name;
use crate::pipeline::inputs::Inputs;
use crate::results_folder::error::WorkflowError;
use crate::table::CsvTable;

/// A draw of a posterior.
#[derive(Clone, Debug)]
pub(crate) struct Draw {
    /// The parameters.
    pub(crate) theta: Vec<f64>,
    /// Covariance (quantities × quantities) between specimens, relative to the means of the quantities.
    pub(crate) scatter: Vec<Vec<f64>>,
}

/// Reads the draws of `posterior.csv`, for the calibrated quantities with the columns `outputs`.
///
/// # Errors
/// Fails if the file is missing or has no column of a parameter or quantity.
pub(crate) fn posterior_draws(
    inputs: &Inputs<'_>,
    prior: &[Input],
    outputs: &[String],
) -> Result<Vec<Draw>, WorkflowError> {
    let short: Vec<String> = outputs.iter().map(|name| short_name(name)).collect();
    let sd: Vec<String> = short.iter().map(|name| format!("sd[{name}]")).collect();
    let correlation = |a: usize, b: usize| format!("correlation[{},{}]", short[a], short[b]);
    let size = outputs.len();
    let pairs: Vec<Vec<String>> =
        (0..size).map(|a| (0..size).map(|b| correlation(a, b)).collect()).collect();
    let path = inputs.file("posterior.csv")?;
    let table = CsvTable::read(&path, &["chain"])?;
    let mut draws = Vec::new();
    for row in table.rows() {
        let theta = prior.iter().map(|input| row.number(&input.name)).collect::<Result<_, _>>()?;
        let sd = sd.iter().map(|name| row.number(name)).collect::<Result<Vec<_>, InputError>>()?;
        let mut scatter = vec![vec![0.0; size]; size];
        for (a, b) in (0..size).flat_map(|a| (0..size).map(move |b| (a, b))) {
            scatter[a][b] = sd[a] * sd[b] * row.number(&pairs[a][b])?;
        }
        draws.push(Draw { theta, scatter });
    }
    Ok(draws)
}
