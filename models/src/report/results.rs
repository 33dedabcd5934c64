//! Contents of a report, as plain numbers.

pub(crate) use super::comparison::{BandEnd, Misfit, QuantityMisfit, SpecimenFacts};
pub(crate) use super::provenance::{ChangedKey, DamageModel, InputFile, Methods, Provenance};
pub(crate) use super::validation_results::{
    ValidatedQuantity, ValidationCoverage, ValidationResult, ValidationVerdict,
};
pub(crate) use super::verdict::{
    CalibratedParameter, IDENTIFIED, MARGIN, MOST_AT_BOUND, Qualifier, WEAKLY,
};

/// A curve of displacement in mm and force in N.
pub(crate) type Points = Vec<(f64, f64)>;

/// All data that the report shows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Results {
    /// Title of the report, which names the calibrated case.
    pub(crate) title: String,
    /// If not all stages are finished: name, state and explanation of each stage.
    pub(crate) unfinished: Vec<[String; 3]>,
    /// Date, version, machine and input files; `None` if they are not known.
    pub(crate) provenance: Option<Provenance>,
    /// Keys of the case that differ from their defaults.
    pub(crate) changed_keys: Vec<ChangedKey>,
    /// Title and HTML of each section that a program of the user adds.
    pub(crate) further_sections: Vec<(&'static str, String)>,
    /// Settings that the methods paragraph states; `None` if they are not known.
    pub(crate) methods: Option<Methods>,
    /// The effective case, as text.
    pub(crate) case_toml: String,
    /// Pictures of the specimen: its image and its mesh.
    pub(crate) pictures: Vec<Picture>,
    /// Facts about the image: name and value; empty if there is none.
    pub(crate) image_facts: Vec<(String, String)>,
    /// Facts about the mesh: name and value.
    pub(crate) mesh_facts: Vec<(String, String)>,
    /// Findings of the checks of the measured curves.
    pub(crate) findings: Vec<Finding>,
    /// Size and quantities of each specimen.
    pub(crate) specimens: Vec<SpecimenFacts>,
    /// Misfit of each compared quantity; empty without a calibration.
    pub(crate) misfits: Vec<QuantityMisfit>,
    /// Measured curves by specimen.
    pub(crate) experiments: Vec<(String, Points)>,
    /// Simulated curves of the ensemble.
    pub(crate) ensemble: Vec<Points>,
    /// Runs of the ensemble that failed, with their reasons.
    pub(crate) failures: Vec<(usize, String)>,
    /// Total processor time of the runs, s.
    pub(crate) ensemble_seconds: f64,
    /// Whether a simulation at the MAP was run.
    pub(crate) is_confirmed: bool,
    /// Curve of the simulation at the MAP; empty for a simulation that has quantities and no curve.
    pub(crate) map_curve: Points,
    /// Curve of the simulation with the materials of the case (not calibrated); `None` in results
    /// of older versions.
    pub(crate) baseline_curve: Option<Points>,
    /// Damage states of the simulation at the MAP, in order of increasing damage.
    pub(crate) damage: Vec<DamageState>,
    /// Curves of the simulations at posterior draws.
    pub(crate) posterior_curves: Vec<Points>,
    /// Predicted band of the curve of a new specimen; `None` if it is not predicted.
    pub(crate) predicted_curves: Option<PredictedBand>,
    /// The quantities of interest.
    pub(crate) qois: Vec<Qoi>,
    /// Errors of the surrogate for each order.
    pub(crate) orders: Vec<OrderErrors>,
    /// Order of the surrogate that was chosen.
    pub(crate) chosen_order: usize,
    /// Sentence on the choice of the order.
    pub(crate) order_rule: String,
    /// Inputs of the surrogate in addition to the parameters: known properties of each specimen.
    pub(crate) known_inputs: Vec<String>,
    /// The calibrated parameters.
    pub(crate) parameters: Vec<CalibratedParameter>,
    /// Contributions to the posterior variance of each parameter: its label, and the sources with their shares.
    pub(crate) budget: Vec<(String, Vec<(String, f64)>)>,
    /// Influence of the priors on each parameter; empty if it is not known.
    pub(crate) sensitivities: Vec<ParameterSensitivity>,
    /// Logarithm of the marginal likelihood and its standard error; `None` if it was not estimated.
    pub(crate) evidence: Option<[f64; 2]>,
    /// Summary of every sampled quantity.
    pub(crate) summary: Vec<Summarised>,
    /// Number of divergent transitions of all chains after warmup.
    pub(crate) divergences: u64,
    /// Leave-one-out predictions, specimen by specimen; empty if there are none.
    pub(crate) loo: Vec<LeftOut>,
    /// Comparisons with held-out specimens; empty if there are none.
    pub(crate) validations: Vec<ValidationResult>,
    /// Coverage of the predictive intervals over all held-out specimens and quantities.
    pub(crate) validation_coverage: Vec<ValidationCoverage>,
    /// Expected benefit of further tests for each parameter; empty if it was not computed.
    pub(crate) further: Vec<FurtherParameter>,
    /// Further tests that are omitted from the comparison: name and reason.
    pub(crate) failed_candidates: Vec<(String, String)>,
    /// Warnings of all stages and rules; empty if there are none.
    pub(crate) warnings: Vec<String>,
    /// Notes on the interpretation of the results: scaled displacements, mesh bias and similar.
    pub(crate) notes: Vec<String>,
    /// Settings of the run: name and value.
    pub(crate) settings: Vec<(String, String)>,
}

/// Expected benefit of further tests for one parameter.
#[derive(Clone, Debug, Default)]
pub(crate) struct FurtherParameter {
    /// Label with unit.
    pub(crate) label: String,
    /// Contraction of the parameter in the present posterior.
    pub(crate) now: f64,
    /// The tests, all with the same numbers of specimens and the same goals.
    pub(crate) tests: Vec<FurtherTestResult>,
}

/// Expected benefit of one further test for a parameter.
#[derive(Clone, Debug, Default)]
pub(crate) struct FurtherTestResult {
    /// Name of the test.
    pub(crate) name: String,
    /// Expected contraction for several numbers of further specimens.
    pub(crate) expected: Vec<FurtherExpected>,
    /// Number of further specimens that each goal needs.
    pub(crate) needed: Vec<FurtherNeeded>,
}

/// Expected contraction for a number of further specimens.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FurtherExpected {
    /// Number of further specimens.
    pub(crate) specimens: usize,
    /// Expected contraction: 1 − posterior variance / prior variance.
    pub(crate) contraction: f64,
}

/// Number of further specimens that a goal needs.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FurtherNeeded {
    /// Whether the goal is a width of the 90 % interval (and not a contraction).
    pub(crate) is_width: bool,
    /// Value of the goal: width of the interval in the parameter's unit, or contraction.
    pub(crate) value: f64,
    /// Number of further specimens; `None` if the goal is not reached with `FurtherTest::MOST` specimens.
    pub(crate) specimens: Option<usize>,
    /// Limit of the interval width or the contraction for infinitely many further specimens.
    pub(crate) limit: f64,
}

/// Posterior predictive band of the force of new specimens against displacement.
#[derive(Clone, Debug, Default)]
pub(crate) struct PredictedBand {
    /// Displacements in mm.
    pub(crate) displacement_mm: Vec<f64>,
    /// 5, 25, 50, 75 and 95 % quantiles of the force in N, each at all displacements.
    pub(crate) force_n: [Vec<f64>; 5],
    /// Reason of the end of the band; `None` if it is not known.
    pub(crate) end: Option<BandEnd>,
}

/// A finding in one measured curve.
#[derive(Clone, Debug)]
pub(crate) struct Finding {
    /// Name of the specimen.
    pub(crate) specimen: String,
    /// Name of the finding.
    pub(crate) finding: String,
    /// Magnitude of the finding, and advice.
    pub(crate) help: String,
}

/// Leave-one-out prediction of a specimen.
#[derive(Clone, Debug, Default)]
pub(crate) struct LeftOut {
    /// Name of the specimen.
    pub(crate) specimen: String,
    /// Log predictive density of the specimen, given the other specimens.
    pub(crate) elpd: f64,
    /// Shape parameter k̂ of the generalised Pareto tail of the importance weights.
    pub(crate) pareto_k: f64,
    /// The parameter whose posterior mean shifts most without the specimen, and the shift in posterior standard
    /// deviations.
    pub(crate) moved: Option<(String, f64)>,
    /// Whether the posterior without the specimen was sampled (and not estimated with importance weights).
    pub(crate) is_sampled: bool,
}

/// Largest shift of a posterior mean, in posterior standard deviations, at which the specimen is not flagged.
pub(crate) const MOST_SHIFT: f64 = 1.0;

/// Damage at one state of a simulation.
#[derive(Clone, Debug, Default)]
pub(crate) struct DamageState {
    /// Displacement in mm.
    pub(crate) displacement_mm: f64,
    /// Force in N.
    pub(crate) force_n: f64,
    /// Picture of the damage in the specimen, cut along its axis; bytes of a PNG file.
    pub(crate) picture: Vec<u8>,
}

/// Posterior summary of one sampled quantity: moments and diagnostics.
#[derive(Clone, Debug, Default)]
pub(crate) struct Summarised {
    /// Name of the quantity.
    pub(crate) name: String,
    /// Mean, sd, 5, 50 and 95 % quantiles, each with its Monte Carlo error (NaN if unknown).
    pub(crate) moments: [(f64, f64); 5],
    /// R-hat: 1 if the chains agree.
    pub(crate) rhat: f64,
    /// Effective sample size of the bulk.
    pub(crate) ess_bulk: f64,
    /// Effective sample size of the tails.
    pub(crate) ess_tail: f64,
}

/// A picture with its caption.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    /// Caption: a sentence that describes the picture.
    pub(crate) caption: String,
    /// Advice if the picture looks wrong.
    pub(crate) if_wrong: &'static str,
    /// Contents of the picture file.
    pub(crate) content: PictureContent,
}

/// Contents of a picture file.
#[derive(Clone, Debug)]
pub(crate) enum PictureContent {
    /// Bytes of a PNG file.
    Png(Vec<u8>),
    /// Text of an SVG figure.
    Svg(String),
}

/// One quantity of interest.
#[derive(Clone, Debug, Default)]
pub(crate) struct Qoi {
    /// Name with unit.
    pub(crate) label: String,
    /// Experimental values, one per specimen.
    pub(crate) experiments: Vec<f64>,
    /// Values of the ensemble, one per run.
    pub(crate) ensemble: Vec<f64>,
    /// Posterior predictive draws for a new specimen.
    pub(crate) predictive: Vec<f64>,
    /// Value of the simulation at the MAP.
    pub(crate) map: f64,
    /// Relative difference of `map` to the experimental mean, in per cent.
    pub(crate) percent_error: f64,
    /// Estimated relative error of the quantity due to the mesh, in per cent; `None` if unknown.
    pub(crate) mesh_error_percent: Option<f64>,
    /// Total Sobol index of every parameter, and the ends of its 90 % interval if they are known.
    pub(crate) sobol_total: Vec<(f64, Option<[f64; 2]>)>,
}

/// Errors of the surrogate at one order.
#[derive(Clone, Debug, Default)]
pub(crate) struct OrderErrors {
    /// Polynomial order.
    pub(crate) order: usize,
    /// Relative leave-one-out error, averaged over the outputs; `None` if it cannot be estimated.
    pub(crate) loo: Option<f64>,
    /// Relative leave-one-out error, corrected for the sample size.
    pub(crate) corrected: Option<f64>,
    /// Relative training error of the 70/30 split.
    pub(crate) training: Option<f64>,
    /// Relative validation error of the 70/30 split.
    pub(crate) validation: Option<f64>,
}

/// Influence of the priors on one parameter.
#[derive(Clone, Debug, Default)]
pub(crate) struct ParameterSensitivity {
    /// Label of the parameter.
    pub(crate) label: String,
    /// Sensitivity to the priors of the parameters, to the priors of the scatter, and to the likelihood.
    pub(crate) sensitivities: [f64; 3],
    /// Diagnosis from the sensitivities.
    pub(crate) diagnosis: String,
}

/// Mean of the values; NaN if there are none.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
