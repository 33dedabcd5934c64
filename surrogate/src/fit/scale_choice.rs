//! Chooses which inputs and outputs are on logarithmic scales.

use faer::Mat;
use serde::{Deserialize, Serialize};

use crate::error::SurrogateError;
use crate::fit::design_matrix::Regression;
use crate::fit::select::{LeaveOneOutError, OrderRule, ROUNDING, Truth, error};
use crate::fit::weights::{WeightedFit, fit_weighted};
use crate::scale::Scale;

/// A logarithmic scale is chosen only if it reduces the squared error to less than this fraction. Smaller
/// improvements can be caused by the noise of single rows.
const WORTHWHILE: f64 = 0.9;

/// Smallest ratio of an input's bounds at which a logarithmic scale is tried. For a smaller ratio, the logarithm is
/// almost linear.
const LEAST_RATIO: f64 = 1.1;

/// Method by which a linear or logarithmic [`Scale`] is chosen for each input and output.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scales {
    /// The scales are chosen by the corrected leave-one-out error of the outputs in the units of the outputs. In
    /// these units, errors are comparable between scales. The search starts from linear scales. Each step changes
    /// one input to a logarithmic scale, namely the input whose change reduces the error most. The search stops when
    /// no such change reduces the error by a tenth. At each order, an output is on a logarithmic scale if the
    /// logarithmic scale reduces the error of the output by a tenth. Candidates are inputs with a lower bound above
    /// 0 and an upper bound at least a tenth larger, and outputs that are above 0 in all rows.
    #[default]
    Auto,
    /// All scales are linear.
    Linear,
    /// The given scales.
    Given {
        /// One scale per input.
        inputs: Vec<Scale>,
        /// One scale per output.
        outputs: Vec<Scale>,
    },
}

/// The scales of a fit.
pub(crate) struct ChosenScales {
    pub(crate) inputs: Vec<Scale>,
    pub(crate) outputs: Vec<Scale>,
    /// The corrected leave-one-out error of the best order with all scales linear; None if the scales were not chosen
    /// automatically.
    pub(crate) linear_error: Option<f64>,
}

/// Returns the scales that the user has specified, or chooses the scales automatically.
///
/// # Errors
/// The errors of [`Regression::equations_for`]. Scales that the user has specified are not checked here.
pub(crate) fn choose(
    regression: &Regression<'_>,
    scales: &Scales,
    rule: OrderRule,
) -> Result<ChosenScales, SurrogateError> {
    let data = regression.data;
    let linear = |n: usize| vec![Scale::Linear; n];
    let all_linear = ChosenScales {
        inputs: linear(data.inputs().len()),
        outputs: linear(data.outputs().len()),
        linear_error: None,
    };
    match scales {
        Scales::Linear => return Ok(all_linear),
        Scales::Given { inputs, outputs } => {
            let (inputs, outputs) = (inputs.clone(), outputs.clone());
            return Ok(ChosenScales { inputs, outputs, linear_error: None });
        }
        Scales::Auto => {}
    }
    let Some(mut best) = Candidate::new(regression, all_linear.inputs.clone(), rule)? else {
        return Ok(all_linear);
    };
    let linear_error = Some(best.linear_error);
    let mut flippable: Vec<usize> = (0..data.inputs().len())
        .filter(|&i| {
            let input = &data.inputs()[i];
            input.lower > 0.0 && input.upper >= LEAST_RATIO * input.lower
        })
        .collect();
    while !flippable.is_empty() {
        let mut better: Option<(usize, Candidate)> = None;
        for &i in &flippable {
            let mut inputs = best.inputs.clone();
            inputs[i] = Scale::Log;
            if let Some(candidate) = Candidate::new(regression, inputs, rule)?
                && better.as_ref().is_none_or(|(_, other)| candidate.error < other.error)
            {
                better = Some((i, candidate));
            }
        }
        match better {
            Some((i, candidate)) if candidate.error < WORTHWHILE * best.error => {
                flippable.retain(|&j| j != i);
                best = candidate;
            }
            _ => break,
        }
    }
    Ok(ChosenScales { inputs: best.inputs, outputs: best.outputs, linear_error })
}

/// Candidate scales of the inputs, with the best scales of the outputs for these input scales.
struct Candidate {
    inputs: Vec<Scale>,
    outputs: Vec<Scale>,
    /// The corrected leave-one-out error at the best order.
    error: f64,
    /// The corrected leave-one-out error at the best order with all outputs linear.
    linear_error: f64,
}

impl Candidate {
    /// Finds the best output scales for the given input scales. None if no order can be estimated, or if `rule` fixes
    /// an order that cannot be estimated.
    fn new(
        regression: &Regression<'_>,
        inputs: Vec<Scale>,
        rule: OrderRule,
    ) -> Result<Option<Self>, SurrogateError> {
        let (y, outputs) = (&regression.y, regression.y.ncols());
        // targets: every output on the linear scale, then every positive output on the logarithmic scale
        let logs: Vec<usize> = (0..outputs).filter(|&m| regression.least(m) > 0.0).collect();
        let linear = (0..outputs).map(|m| (m, Scale::Linear));
        let source: Vec<(usize, Scale)> =
            linear.chain(logs.iter().map(|&m| (m, Scale::Log))).collect();
        let scales: Vec<Scale> = source.iter().map(|(_, scale)| *scale).collect();
        let truth = Mat::from_fn(y.nrows(), source.len(), |i, k| y[(i, source[k].0)]);
        let variance: Vec<f64> = source.iter().map(|&(m, _)| regression.variance[m]).collect();
        let truth = Truth { y: &truth, scales: &scales, variance: &variance };

        let equations = regression.equations_for(&inputs, &source)?;
        let WeightedFit { prefixes, .. } = fit_weighted(regression, &equations, &truth, rule);
        let (mut best, mut linear_error): (Option<(f64, Vec<Scale>)>, _) = (None, f64::INFINITY);
        for (order, prefix) in prefixes.iter().enumerate() {
            if matches!(rule, OrderRule::Fixed(fixed) if fixed != order) {
                continue;
            }
            let Some(loo) = LeaveOneOutError::new(prefix, &truth) else { continue };
            let mut errors = loo.corrected[..outputs].to_vec();
            let mut chosen = vec![Scale::Linear; outputs];
            linear_error = linear_error.min(error(&errors));
            for (&m, &logarithmic) in logs.iter().zip(&loo.corrected[outputs..]) {
                if logarithmic.max(ROUNDING) < WORTHWHILE * errors[m].max(ROUNDING) {
                    errors[m] = logarithmic;
                    chosen[m] = Scale::Log;
                }
            }
            if best.as_ref().is_none_or(|(least, _)| error(&errors) < *least) {
                best = Some((error(&errors), chosen));
            }
        }
        Ok(best.map(|(error, outputs)| Self { inputs, outputs, error, linear_error }))
    }
}
