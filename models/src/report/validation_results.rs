//! Contents of the report: comparisons of the posterior with held-out specimens.

use super::results::{Points, PredictedBand};

/// Conclusion from the held-out specimens about the prediction of a quantity.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ValidationVerdict {
    /// The measurements are significantly different from the prediction.
    Contradicted,
    /// Significantly more measurements than predicted are in the middle of the prediction.
    TooWide,
    /// The measurements do not contradict the prediction.
    Consistent,
    /// The measurements cannot be judged: there is one specimen, and the scatter between specimens is unknown.
    #[default]
    NotJudged,
}

impl ValidationVerdict {
    const ALL: [Self; 4] = [Self::Contradicted, Self::TooWide, Self::Consistent, Self::NotJudged];

    /// Name of the verdict in files.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Contradicted => "contradicted",
            Self::TooWide => "too wide",
            Self::Consistent => "consistent",
            Self::NotJudged => "not judged",
        }
    }

    /// The verdict with this name.
    pub(crate) fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|verdict| verdict.name() == name)
    }
}

/// Comparison with the held-out specimens of one validation.
#[derive(Clone, Debug, Default)]
pub(crate) struct ValidationResult {
    /// Name of the validation.
    pub(crate) name: String,
    /// Source of the predictions.
    pub(crate) method: String,
    /// Number of posterior draws.
    pub(crate) draws: usize,
    /// The compared quantities.
    pub(crate) quantities: Vec<ValidatedQuantity>,
    /// Predicted band of the curve of a new specimen; `None` if curves are not compared.
    pub(crate) band: Option<PredictedBand>,
    /// Measured curves.
    pub(crate) curves: Vec<Points>,
}

/// Prediction and measurements of one quantity.
#[derive(Clone, Debug, Default)]
pub(crate) struct ValidatedQuantity {
    /// Label with unit.
    pub(crate) label: String,
    /// Median, and the ends of the 90 % and of the 50 % interval: q05, q25, q50, q75, q95. Only the median is known if the
    /// scatter between specimens is not predicted.
    pub(crate) quantiles: [Option<f64>; 5],
    /// Names of the specimens, and the measured values.
    pub(crate) specimens: Vec<(String, f64)>,
    /// Number of specimens inside the 50 % and the 90 % interval; `None` if the scatter is not predicted.
    pub(crate) inside: Option<[usize; 2]>,
    /// Mean continuous ranked probability score, in the unit of the quantity; `None` if the scatter is not predicted.
    pub(crate) crps: Option<f64>,
    /// Mean of the measurements and of the prediction.
    pub(crate) means: [f64; 2],
    /// Difference between the means, in standard deviations; `None` if it cannot be estimated.
    pub(crate) deviation: Option<f64>,
    /// Conclusion.
    pub(crate) verdict: ValidationVerdict,
}

/// Coverage of a predictive interval over all specimens and quantities.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ValidationCoverage {
    /// Level of the interval.
    pub(crate) level: f64,
    /// Number of measurements inside the interval, and number of all measurements.
    pub(crate) counts: [usize; 2],
    /// 95 % interval of the coverage, if the measurements are independent.
    pub(crate) interval: [f64; 2],
}
