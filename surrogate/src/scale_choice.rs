//! Which inputs and outputs are expanded in logarithms.

use faer::Mat;
use serde::{Deserialize, Serialize};

use crate::design_matrix::Regression;
use crate::error::SurrogateError;
use crate::scale::Scale;
use crate::select::{LeaveOneOutError, OrderRule, ROUNDING, Truth, error};
use crate::weights::{WeightedFit, fit_weighted};

/// A logarithm is taken only where it leaves less than this fraction of the squared error: below,
/// the choice would follow the noise of single rows.
const WORTHWHILE: f64 = 0.9;

/// Least ratio of an input's bounds at which its logarithm is curved enough to try.
const LEAST_RATIO: f64 = 1.1;

/// How the scales of inputs and outputs are chosen: see [`Scale`].
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scales {
    /// By the corrected leave-one-out error of the outputs themselves, which is one measure for
    /// all scales. Starting from linear scales, the input whose change of scale gains most is changed
    /// until none gains a tenth; each output takes the better of its two scales at each order. Candidates are
    /// inputs whose upper bound exceeds the lower one, above 0, by a tenth, and outputs above 0 in
    /// all rows.
    #[default]
    Auto,
    /// All linear.
    Linear,
    /// These.
    Given {
        /// One for each input.
        inputs: Vec<Scale>,
        /// One for each output.
        outputs: Vec<Scale>,
    },
}

/// The scales to fit on.
pub(crate) struct ChosenScales {
    pub(crate) inputs: Vec<Scale>,
    pub(crate) outputs: Vec<Scale>,
    /// The error with all scales linear, where there was a choice.
    pub(crate) linear_error: Option<f64>,
}

/// # Errors
/// Given scales of another number, or a logarithm of what is not above 0.
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

/// Scales of the inputs, with the best of the outputs on them.
struct Candidate {
    inputs: Vec<Scale>,
    outputs: Vec<Scale>,
    /// The corrected leave-one-out error at the best order.
    error: f64,
    /// The same with linear outputs.
    linear_error: f64,
}

impl Candidate {
    /// None where no order, or not the one asked for, can be estimated.
    fn new(
        regression: &Regression<'_>,
        inputs: Vec<Scale>,
        rule: OrderRule,
    ) -> Result<Option<Self>, SurrogateError> {
        let (y, outputs) = (&regression.y, regression.y.ncols());
        // every output linear, then the logarithms of those that have one
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
