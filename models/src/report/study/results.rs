//! Contents of the page of a study, as plain numbers.

use super::super::results::{CalibratedParameter, Qoi};

/// All data that the page of a study shows.
#[derive(Clone, Debug, Default)]
pub(crate) struct StudyResults {
    /// Title of the page.
    pub(crate) title: String,
    /// Sentences on cases that share specimens but disagree; they are at the top of the page.
    pub(crate) contradictions: Vec<String>,
    /// The calibrations, in order.
    pub(crate) cases: Vec<ComparedCase>,
    /// Names of the cases that could not be calibrated.
    pub(crate) missing: Vec<String>,
    /// The same calibrations under other settings.
    pub(crate) variants: Vec<Variant>,
    /// Comparisons of all pairs of calibrations, parameter by parameter.
    pub(crate) pairs: Vec<Pair>,
    /// Text of the study file.
    pub(crate) text: String,
}

/// One calibration of a study.
#[derive(Clone, Debug, Default)]
pub(crate) struct ComparedCase {
    /// Name of the case, and of the folder with its report.
    pub(crate) name: String,
    /// Source of the specimens, a laboratory or a table; `None` if no other case can share the specimens.
    pub(crate) specimens_from: Option<String>,
    /// Paths of the parameters.
    pub(crate) names: Vec<String>,
    /// The calibrated parameters.
    pub(crate) parameters: Vec<CalibratedParameter>,
    /// Published mode of each parameter, if there is one.
    pub(crate) reference: Vec<Option<f64>>,
    /// The quantities of interest, including the simulation at the mode.
    pub(crate) qois: Vec<Qoi>,
    /// Leave-one-out log density of each specimen, by its name.
    pub(crate) densities: Vec<(String, f64)>,
    /// Logarithm of the evidence and its standard error; `None` if it was not estimated.
    pub(crate) evidence: Option<[f64; 2]>,
    /// Published differences between simulation and experiments in per cent; empty if there are none.
    pub(crate) reference_errors: Vec<f64>,
    /// Text of the warnings.
    pub(crate) warnings: Vec<String>,
}

/// Comparison of two calibrations of one parameter.
#[derive(Clone, Debug)]
pub(crate) struct Pair {
    /// Names of the two cases.
    pub(crate) cases: [String; 2],
    /// Label of the parameter.
    pub(crate) label: String,
    /// Probability mass that the two posteriors have in common.
    pub(crate) overlap: f64,
    /// Ratio of the second case to the first: median, 5 and 95 % quantiles.
    pub(crate) ratio: [f64; 3],
}

impl Pair {
    /// Whether the 90 % interval of the ratio excludes 1.
    pub(crate) fn differ(&self) -> bool {
        self.ratio[1] > 1.0 || self.ratio[2] < 1.0
    }
}

/// The calibrations of a study under another setting.
#[derive(Clone, Debug, Default)]
pub(crate) struct Variant {
    /// Title of the setting.
    pub(crate) title: String,
    /// Folder of the setting, with its own report.
    pub(crate) folder: String,
    /// The calibrations, in the order of the study.
    pub(crate) cases: Vec<ComparedCase>,
    /// Names of the cases that could not be calibrated.
    pub(crate) missing: Vec<String>,
}

/// Largest difference from the experimental mean, in per cent, at which a simulation counts as reproducing the
/// experiment. This is the criterion of the paper.
pub(crate) const REPRODUCED: f64 = 10.0;
