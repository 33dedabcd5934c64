//! What the page of a study tells, as plain numbers.

use super::super::results::{CalibratedParameter, Qoi};

/// Everything that the page of a study shows.
#[derive(Clone, Debug, Default)]
pub(crate) struct StudyResults {
    /// The headline.
    pub(crate) title: String,
    /// Sentences on cases that share specimens and disagree; the page begins with them.
    pub(crate) contradictions: Vec<String>,
    /// The calibrations, in order.
    pub(crate) cases: Vec<ComparedCase>,
    /// Those that could not be made.
    pub(crate) missing: Vec<String>,
    /// The same under other settings.
    pub(crate) variants: Vec<Variant>,
    /// What the calibrations say, and whether it is said under the other settings too.
    pub(crate) conclusions: Vec<Conclusion>,
    /// Every two of them, parameter by parameter.
    pub(crate) pairs: Vec<Pair>,
    /// The file of the study.
    pub(crate) text: String,
}

/// One calibration of a study.
#[derive(Clone, Debug, Default)]
pub(crate) struct ComparedCase {
    /// Its name, also of the folder with its own report.
    pub(crate) name: String,
    /// The laboratory whose specimens it is calibrated against, if it has not its own.
    pub(crate) laboratory: Option<String>,
    /// What its specimens are read from, where another case may have the same ones: a laboratory, or a table.
    pub(crate) specimens_from: Option<String>,
    /// What the case says of its specimen, to be compared with that of others.
    pub(crate) specimen: String,
    /// Paths of the parameters.
    pub(crate) names: Vec<String>,
    /// The parameters.
    pub(crate) parameters: Vec<CalibratedParameter>,
    /// The published mode of each, where there is one.
    pub(crate) reference: Vec<Option<f64>>,
    /// The quantities of interest with the simulation at the mode.
    pub(crate) qois: Vec<Qoi>,
    /// Published differences of that simulation to the experiments in per cent; empty without.
    pub(crate) reference_errors: Vec<f64>,
    /// Warnings in words.
    pub(crate) warnings: Vec<String>,
}

/// Two calibrations of one parameter.
#[derive(Clone, Debug)]
pub(crate) struct Pair {
    /// Their names.
    pub(crate) cases: [String; 2],
    /// Label of the parameter.
    pub(crate) label: String,
    /// The mass that the posteriors have in common.
    pub(crate) overlap: f64,
    /// Ratio of the second to the first: median, 5 and 95 % quantiles.
    pub(crate) ratio: [f64; 3],
}

impl Pair {
    /// Whether the 90 % interval of the ratio leaves out 1.
    pub(crate) fn differ(&self) -> bool {
        self.ratio[1] > 1.0 || self.ratio[2] < 1.0
    }
}

/// The calibrations of a study under another setting.
#[derive(Clone, Debug, Default)]
pub(crate) struct Variant {
    /// Its headline.
    pub(crate) title: String,
    /// Its folder, with a report of its own.
    pub(crate) folder: String,
    /// The calibrations, in the order of the study.
    pub(crate) cases: Vec<ComparedCase>,
    /// Those that could not be made.
    pub(crate) missing: Vec<String>,
}

/// A sentence that a study says under its first setting.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Conclusion {
    /// The sentence.
    pub(crate) claim: String,
    /// Under each setting what was found, and whether it bears the sentence out.
    pub(crate) found: Vec<(String, bool)>,
}

/// Within so many per cent of the experimental mean a simulation is said to reproduce it (the paper).
pub(crate) const REPRODUCED: f64 = 10.0;
