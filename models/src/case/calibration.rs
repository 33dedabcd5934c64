//! What a calibration takes beside its simulations: quantities of interest, surrogate, sampler.

use std::collections::BTreeMap;

use ::surrogate::{DesignMethod, OrderRule, Terms};
use serde::{Deserialize, Serialize};

use super::PriorCase;
use crate::qoi::Quantity;

/// `[qoi]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct QoiCase {
    /// Where the initial slope is taken, as a fraction of the displacement at peak.
    pub slope_fraction: f64,
    /// What specimens and simulations are compared by; with `calibration.likelihood = "curve"` those of
    /// the curve stand here in place of what was written.
    pub quantities: Vec<Quantity>,
    /// Where the shape of a curve is compared, in per cent of the displacement at peak.
    pub curve_percent: Vec<u8>,
}

/// `[design]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DesignCase {
    /// Number of simulations.
    pub runs: usize,
    /// Seed of the design.
    pub seed: u64,
    /// How the prior box is filled.
    pub method: DesignMethod,
    /// On what the runs are made.
    pub microstructure: Microstructure,
    /// Packings that the runs share; absent: as many as runs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub packings: Option<usize>,
    /// Whether runs give the derivatives of their quantities by what is calibrated too, from which the
    /// surrogate learns as it does from more runs.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub derivatives: bool,
}

/// `[[extend]]`: a second batch of runs where a posterior was cut by the prior, beside the runs before.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ExtendCase {
    /// Number of simulations.
    pub runs: usize,
    /// One parameter and where it is extended to; the others keep to `[prior]`.
    pub prior: PriorCase,
}

/// `[sequential]`: batches of runs that are added where the posterior lives, until the surrogate is known well
/// enough there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SequentialCase {
    /// The largest share of the surrogate in the posterior variance of an identified parameter.
    pub share: f64,
    /// Number of simulations of a batch.
    pub batch: usize,
    /// Most simulations of all batches.
    pub most: usize,
}

impl Default for SequentialCase {
    fn default() -> Self {
        Self { share: 0.1, batch: 10, most: 50 }
    }
}

/// `design.microstructure`: the specimens that an ensemble is made on.
///
/// With one its deviation from the others enters the posterior unseen; with more, the residuals of the
/// surrogate show how they scatter, and the posterior can take it in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Microstructure {
    /// Every run has a packing of its own, or shares one of `design.packings` or of several images with few
    /// others.
    #[default]
    PerRun,
    /// All runs share the case's specimen (the paper).
    One,
}

/// `[surrogate]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SurrogateCase {
    /// Highest total order tried.
    pub max_order: usize,
    /// Rule that chooses the order.
    pub rule: OrderRule,
    /// Whether an order has all its terms, or those that matter.
    pub terms: Terms,
}

/// `[calibration]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "WrittenCalibration")]
pub struct CalibrationCase {
    /// What of the curves is compared.
    pub likelihood: Likelihood,
    /// Markov chains.
    pub chains: usize,
    /// Steps of a chain by which the sampler tunes itself.
    pub warmup: usize,
    /// Steps after them that are left out too.
    #[serde(skip_serializing_if = "is_zero")]
    pub burn_in: usize,
    /// Kept draws a chain.
    pub draws: usize,
    /// Steps for each kept draw.
    #[serde(skip_serializing_if = "is_one")]
    pub thin: usize,
    /// Mean acceptance that the step size is tuned to.
    pub target_accept: f64,
    /// Seed of the chains.
    pub seed: u64,
    /// What the model itself may be off by.
    #[serde(skip_serializing_if = "DiscrepancyCase::is_empty")]
    pub discrepancy: DiscrepancyCase,
}

fn is_zero(n: &usize) -> bool {
    *n == 0
}

fn is_one(n: &usize) -> bool {
    *n == 1
}

/// `[calibration]` as it is written: a preset, and what is otherwise.
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
    discrepancy: DiscrepancyCase,
}

/// `calibration.sampling`: how chains are drawn, where the case does not say it key by key.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Sampling {
    /// What a few thousand draws need.
    #[default]
    Default,
    /// Schmid et al.: 50 000 steps in each of four chains after 2 000 of tuning, of which the first 25 000 are
    /// left out and every tenth of the others is kept.
    Paper,
}

impl TryFrom<WrittenCalibration> for CalibrationCase {
    type Error = String;

    fn try_from(written: WrittenCalibration) -> Result<Self, String> {
        let own = [
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
            && let Some((key, _)) = own.iter().find(|(_, value)| value.is_some())
        {
            return Err(format!("sampling = \"paper\" says what {key} is: leave {key} out"));
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
            discrepancy: written.discrepancy,
        })
    }
}

/// `[calibration.discrepancy]`: the prior of a systematic error of the model that all specimens share.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DiscrepancyCase {
    /// Standard deviation of the relative error of quantities in %; what is not named has none.
    pub percent: BTreeMap<Quantity, f64>,
}

impl DiscrepancyCase {
    fn is_empty(&self) -> bool {
        self.percent.is_empty()
    }

    /// The covariance (quantities × quantities, relative) of the error, quantities by their columns; none
    /// where there is no error.
    pub(crate) fn covariance(&self, columns: &[String]) -> Option<Vec<Vec<f64>>> {
        let percent = |column: &String| self.percent.get(&Quantity::of_column(column)?);
        let variance = |column| (0.01 * percent(column).unwrap_or(&0.0)).powi(2);
        let entry = |i: usize, j: usize| if i == j { variance(&columns[i]) } else { 0.0 };
        let size = columns.len();
        let rows = || (0..size).map(|i| (0..size).map(|j| entry(i, j)).collect()).collect();
        (!self.is_empty()).then(rows)
    }
}

/// `calibration.likelihood`: what of the curves is compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Likelihood {
    /// The quantities of `qoi.quantities`.
    #[default]
    Quantities,
    /// The curve as a whole: its peak, where that is, and its shape at `qoi.curve_percent`.
    Curve,
}

/// `[confirm]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ConfirmCase {
    /// Simulations at posterior draws, beside the one at the MAP.
    pub draws: usize,
    /// Spacing in mm of the second mesh at the MAP, from which the error of the specimen's mesh is
    /// estimated; absent: half of the specimen's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub second_spacing_mm: Option<f64>,
}

impl Default for QoiCase {
    fn default() -> Self {
        Self {
            slope_fraction: 0.3,
            quantities: Quantity::OF_THE_PAPER.to_vec(),
            curve_percent: vec![25, 50, 75],
        }
    }
}

impl Default for DesignCase {
    fn default() -> Self {
        Self {
            runs: 100,
            seed: 1,
            method: DesignMethod::LatinHypercube,
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
            discrepancy: DiscrepancyCase::default(),
        }
    }
}

impl Default for ConfirmCase {
    fn default() -> Self {
        Self { draws: 4, second_spacing_mm: None }
    }
}
