//! Settings of the calibration, except the settings of its simulations: quantities of interest, surrogate, sampler.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use ::surrogate::{DesignMethod, OrderRule, SurrogateError, Terms};
use ppl::Nuts;
use schemars::{JsonSchema, Schema, schema_for};
use serde::{Deserialize, Serialize};

use super::between_tests::BetweenTestsCase;
use super::schema::percent_of_quantities;
use super::{BoundsCase, ByParameter, PriorCase};
use crate::prior::Prior;
use crate::qoi::{Quantity, RelativeForce};

/// `[qoi]`: quantities of interest, which are compared between specimens and simulations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct QoiCase {
    /// Displacement at which the initial slope is measured, as a fraction of the displacement at peak.
    #[schemars(range(min = 0.1, max = 0.9))]
    pub slope_fraction: f64,
    /// Quantities that are compared between specimens and simulations. With `calibration.likelihood = "curve"`, the
    /// quantities of the curve are compared instead.
    pub quantities: Vec<Quantity>,
    /// Displacements at which the shape of a curve is compared, in per cent of the displacement at peak.
    #[schemars(inner(range(min = 1, max = RelativeForce::LARGEST_PERCENT)))]
    pub curve_percent: Vec<u8>,
}

/// Quantities that are compared between specimens and simulations, as the likelihood of the case defines them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct QoiComparison {
    /// Displacement at which the initial slope is measured, as a fraction of the displacement at peak.
    pub(crate) slope_fraction: f64,
    /// The compared quantities.
    pub(crate) quantities: Vec<Quantity>,
}

/// `[design]`: the simulations to which the surrogate is fitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct DesignCase {
    /// Number of simulations.
    #[schemars(range(min = Self::LEAST_RUNS, max = 1_000_000))]
    pub runs: usize,
    /// Table of finished runs (parameters and quantities), which replaces simulations.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub import: Option<PathBuf>,
    /// Seed of the design.
    pub seed: u64,
    /// Sampling method that fills the ranges of the priors.
    pub method: DesignMethod,
    /// Distribution of the runs.
    #[serde(skip_serializing_if = "DesignSample::is_default")]
    #[schemars(!skip_serializing_if)]
    pub sample: DesignSample,
    /// Assignment of specimens to the runs.
    pub microstructure: Microstructure,
    /// Number of packings that the runs share. Without `packings`, each run has its own packing.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 2, max = 1_000_000))]
    pub packings: Option<usize>,
    /// Whether runs also compute the derivatives of their quantities with respect to the calibrated parameters. The
    /// surrogate is fitted to the derivatives too, which has the effect of more runs.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    #[schemars(!skip_serializing_if)]
    pub derivatives: bool,
}

/// `design.sample`: the distribution of the runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DesignSample {
    /// The runs fill the range of each parameter evenly.
    #[default]
    Range,
    /// The runs have the distribution of the priors.
    Prior,
}

impl DesignSample {
    fn is_default(&self) -> bool {
        *self == Self::default()
    }
}

impl DesignCase {
    /// Draws `n` points of the design, whose coordinates are the parameters of a prior.
    ///
    /// # Errors
    /// The errors of [`DesignMethod::sample`].
    pub(crate) fn parameter_points(
        &self,
        prior: &PriorCase,
        n: usize,
        seed: u64,
    ) -> Result<Vec<Vec<f64>>, SurrogateError> {
        match self.sample {
            DesignSample::Range => self.method.sample(&prior.inputs()?, n, seed),
            DesignSample::Prior => Prior::sample_design(&prior.priors(), self.method, n, seed),
        }
    }
}

/// `[[extend]]`: a second batch of runs, in addition to the earlier runs, for a posterior that was truncated by the
/// prior.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExtendCase {
    /// Number of simulations.
    #[schemars(range(min = 1, max = 1_000_000))]
    pub runs: usize,
    /// The extended parameter with its new bounds. All other parameters keep the bounds of `[prior]`.
    pub prior: BoundsCase,
}

/// `[sequential]`: batches of runs that are added in the region of high posterior density, until the error of the
/// surrogate is small enough there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SequentialCase {
    /// Largest accepted share of the surrogate error in the posterior variance of an identified parameter.
    #[schemars(range(min = 1e-3, max = 1))]
    pub share: f64,
    /// Number of simulations per batch.
    #[schemars(range(min = 2, max = 100))]
    pub batch: usize,
    /// Largest number of simulations in all batches together.
    #[schemars(range(min = 2, max = 1_000_000))]
    pub most: usize,
}

impl Default for SequentialCase {
    fn default() -> Self {
        Self { share: 0.1, batch: 10, most: 50 }
    }
}

/// `design.microstructure`: the specimens of the runs of the design.
///
/// With a single specimen, the deviation of this specimen from other specimens is an error of the posterior that cannot
/// be estimated. With several specimens, the residuals of the surrogate show the scatter between specimens, and the
/// posterior can include this scatter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Microstructure {
    /// Every run has its own packing. With `design.packings` or several images, a few runs share a specimen.
    #[default]
    PerRun,
    /// All runs share the specimen of the case, as in the paper.
    One,
}

/// `[surrogate]`: order and terms of the polynomial chaos expansion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SurrogateCase {
    /// Highest total polynomial order that is tried.
    #[schemars(range(min = 1, max = 8))]
    pub max_order: usize,
    /// Rule that chooses the order.
    pub rule: OrderRule,
    /// Terms of the polynomial: all terms up to its order, or a selection of these terms.
    pub terms: Terms,
}

/// `[calibration]`: likelihood and sampler.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "WrittenCalibration")]
#[schemars(!try_from, default, deny_unknown_fields, transform = add_sampling)]
pub struct CalibrationCase {
    /// Properties of the curves that are compared.
    pub likelihood: Likelihood,
    /// Number of Markov chains.
    #[schemars(range(min = 1, max = 64))]
    pub chains: usize,
    /// Number of steps per chain in which the sampler adapts step size and metric.
    #[schemars(range(min = 20, max = 1_000_000))]
    pub warmup: usize,
    /// Number of steps after warm-up that are discarded too.
    #[serde(skip_serializing_if = "is_zero")]
    #[schemars(!skip_serializing_if)]
    #[schemars(range(min = 0, max = 10_000_000))]
    pub burn_in: usize,
    /// Number of stored draws per chain.
    #[schemars(range(min = 20, max = 10_000_000))]
    pub draws: usize,
    /// Number of steps per stored draw.
    #[serde(skip_serializing_if = "is_one")]
    #[schemars(!skip_serializing_if)]
    #[schemars(range(min = 1, max = 10_000))]
    pub thin: usize,
    /// Target of the mean acceptance rate for the adaptation of the step size.
    #[schemars(range(min = 0.5, max = 0.999))]
    pub target_accept: f64,
    /// Seed of the chains.
    pub seed: u64,
    /// Whether the marginal likelihood (evidence) is estimated.
    #[serde(skip_serializing_if = "is_false")]
    #[schemars(!skip_serializing_if)]
    pub evidence: bool,
    /// Prior of the systematic error of the model.
    #[serde(skip_serializing_if = "DiscrepancyCase::is_empty")]
    pub discrepancy: DiscrepancyCase,
    /// Relation between the values of parameters in several tests; parameters that are not listed are shared.
    #[serde(skip_serializing_if = "is_without_relations")]
    pub between_tests: ByParameter<BetweenTestsCase>,
    /// File with the draws of a joint calibration of several tests, relative to the results folder. The stage
    /// `calibrate` then uses these draws instead of sampling.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub joint: Option<PathBuf>,
}

impl CalibrationCase {
    /// Number of stored draws per chain that belong to the burn-in.
    pub(crate) fn burn_in_draws(&self) -> usize {
        self.burn_in.div_ceil(self.thin)
    }

    /// Creates the sampler of the posterior. Each of its chains stores the draws of the burn-in, which come first, and
    /// `draws` further draws. Once `interrupt` is true, the sampler ends.
    pub(crate) fn sampler<'a>(&self, interrupt: &'a AtomicBool) -> Nuts<'a> {
        Nuts::default()
            .chains(self.chains)
            .warmup(self.warmup)
            .draws(self.burn_in_draws() + self.draws)
            .thin(self.thin)
            .target_accept(self.target_accept)
            .seed(self.seed)
            .interrupt(interrupt)
    }

    /// Returns the settings without burn-in and thinning, for a posterior from which only averages are computed.
    pub(crate) fn storing_all_draws(&self) -> Self {
        Self { burn_in: 0, thin: 1, ..self.clone() }
    }
}

fn is_without_relations(between_tests: &ByParameter<BetweenTestsCase>) -> bool {
    between_tests.parameters().len() == 0
}

fn is_false(is_set: &bool) -> bool {
    !is_set
}

fn is_zero(n: &usize) -> bool {
    *n == 0
}

fn is_one(n: &usize) -> bool {
    *n == 1
}

/// `[calibration]` as written in the file: a preset, and the keys that replace values of the preset.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct WrittenCalibration {
    likelihood: Likelihood,
    sampling: Sampling,
    chains: Option<usize>,
    warmup: Option<usize>,
    burn_in: Option<usize>,
    draws: Option<usize>,
    thin: Option<usize>,
    target_accept: Option<f64>,
    seed: Option<u64>,
    evidence: bool,
    discrepancy: DiscrepancyCase,
    between_tests: ByParameter<BetweenTestsCase>,
    joint: Option<PathBuf>,
}

/// `calibration.sampling`: preset of the sampling keys.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Sampling {
    /// Values that suit a few thousand draws.
    #[default]
    Default,
    /// Schmid et al.: four chains with 2 000 warm-up steps and 50 000 further steps each. The first 25 000 of these
    /// steps are discarded, and every tenth of the remaining steps is stored.
    Paper,
}

/// Adds the preset, which is a key of the file but not of [`CalibrationCase`].
fn add_sampling(schema: &mut Schema) {
    let mut sampling = schema_for!(Sampling);
    sampling.remove("$schema");
    sampling.remove("title");
    if let Some(properties) = schema.get_mut("properties").and_then(|all| all.as_object_mut()) {
        properties.insert("sampling".to_owned(), sampling.to_value());
    }
}

impl TryFrom<WrittenCalibration> for CalibrationCase {
    type Error = String;

    fn try_from(written: WrittenCalibration) -> Result<Self, String> {
        let stated = [
            ("chains", written.chains),
            ("warmup", written.warmup),
            ("burn_in", written.burn_in),
            ("draws", written.draws),
            ("thin", written.thin),
        ];
        let default = Self::default();
        let [chains, warmup, burn_in, draws, thin] = match written.sampling {
            Sampling::Default => [default.chains, default.warmup, 0, default.draws, 1],
            Sampling::Paper => [4, 2_000, 25_000, 2_500, 10],
        };
        if written.sampling == Sampling::Paper
            && let Some((key, _)) = stated.iter().find(|(_, value)| value.is_some())
        {
            return Err(format!("sampling = \"paper\" determines {key}: remove {key}"));
        }
        Ok(Self {
            likelihood: written.likelihood,
            chains: written.chains.unwrap_or(chains),
            warmup: written.warmup.unwrap_or(warmup),
            burn_in: written.burn_in.unwrap_or(burn_in),
            draws: written.draws.unwrap_or(draws),
            thin: written.thin.unwrap_or(thin),
            target_accept: written.target_accept.unwrap_or(default.target_accept),
            seed: written.seed.unwrap_or(default.seed),
            evidence: written.evidence,
            discrepancy: written.discrepancy,
            between_tests: written.between_tests,
            joint: written.joint,
        })
    }
}

/// `[calibration.discrepancy]`: the prior of a systematic error of the model that all specimens share.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DiscrepancyCase {
    /// Standard deviation of the relative error of each quantity in %; quantities that are not listed have no error.
    #[schemars(transform = percent_of_quantities(1e-3, 100.0))]
    pub percent: BTreeMap<Quantity, f64>,
}

impl DiscrepancyCase {
    fn is_empty(&self) -> bool {
        self.percent.is_empty()
    }

    /// Covariance of the relative error (quantities × quantities) for quantities with the given column names; `None` if
    /// there is no error.
    pub(crate) fn covariance(&self, columns: &[String]) -> Option<Vec<Vec<f64>>> {
        let percent = |column: &String| {
            let mut all = self.percent.iter();
            all.find_map(|(quantity, percent)| (quantity.column() == **column).then_some(percent))
        };
        let variance = |column| (0.01 * percent(column).unwrap_or(&0.0)).powi(2);
        let entry = |i: usize, j: usize| if i == j { variance(&columns[i]) } else { 0.0 };
        let size = columns.len();
        let rows = || (0..size).map(|i| (0..size).map(|j| entry(i, j)).collect()).collect();
        (!self.is_empty()).then(rows)
    }
}

/// `calibration.likelihood`: the properties of the curves that are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Likelihood {
    /// The quantities of `qoi.quantities`.
    #[default]
    Quantities,
    /// The curve as a whole: force and displacement at peak, and the shape at `qoi.curve_percent`.
    Curve,
}

/// `[confirm]`: simulations that check the result of the calibration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ConfirmCase {
    /// Number of simulations at posterior draws, in addition to the simulation at the MAP.
    #[schemars(range(min = 0, max = 1000))]
    pub draws: usize,
    /// Spacing in mm of the second mesh at the MAP, from which the error of the specimen's mesh is estimated. Default:
    /// half of the specimen's spacing.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-3, max = 1e3))]
    pub second_spacing_mm: Option<f64>,
}

impl Default for QoiCase {
    fn default() -> Self {
        Self {
            slope_fraction: 0.3,
            quantities: Quantity::of_the_paper().to_vec(),
            curve_percent: vec![25, 50, 75],
        }
    }
}

impl DesignCase {
    /// Smallest number of runs.
    pub(super) const LEAST_RUNS: usize = 4;
}

impl Default for DesignCase {
    fn default() -> Self {
        Self {
            runs: 100,
            import: None,
            seed: 1,
            method: DesignMethod::LatinHypercube,
            sample: DesignSample::default(),
            microstructure: Microstructure::default(),
            packings: None,
            derivatives: false,
        }
    }
}

impl Default for SurrogateCase {
    fn default() -> Self {
        Self { max_order: 8, rule: OrderRule::CorrectedLoo, terms: Terms::All }
    }
}

impl Default for CalibrationCase {
    fn default() -> Self {
        Self {
            likelihood: Likelihood::default(),
            chains: 4,
            warmup: 1000,
            burn_in: 0,
            draws: 2000,
            thin: 1,
            target_accept: 0.95,
            seed: 7,
            evidence: false,
            discrepancy: DiscrepancyCase::default(),
            between_tests: ByParameter::default(),
            joint: None,
        }
    }
}

impl Default for ConfirmCase {
    fn default() -> Self {
        Self { draws: 4, second_spacing_mm: None }
    }
}
