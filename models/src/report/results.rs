//! What a report tells, as plain numbers.

use std::collections::BTreeSet;
use std::fmt;

use ppl::diagnostics::Identification;

/// A curve of displacement in mm and force in N.
pub(crate) type Points = Vec<(f64, f64)>;

/// Everything that the report shows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Results {
    /// What was calibrated, for the headline.
    pub(crate) title: String,
    /// Where not all stages are done: each, its state, and what there is to say of it.
    pub(crate) unfinished: Vec<[String; 3]>,
    /// The effective case, as text.
    pub(crate) case_toml: String,
    /// Pictures of the specimen: its image and its mesh.
    pub(crate) pictures: Vec<Picture>,
    /// Facts about the image: name and value; empty if there is none.
    pub(crate) image_facts: Vec<(String, String)>,
    /// Facts about the mesh: name and value.
    pub(crate) mesh_facts: Vec<(String, String)>,
    /// What was found when the measured curves were looked at.
    pub(crate) findings: Vec<Finding>,
    /// Measured curves by specimen.
    pub(crate) experiments: Vec<(String, Points)>,
    /// Simulated curves of the ensemble.
    pub(crate) ensemble: Vec<Points>,
    /// Runs of the ensemble that failed, with their reasons.
    pub(crate) failures: Vec<(usize, String)>,
    /// Seconds of processor time of the runs, in all.
    pub(crate) ensemble_seconds: f64,
    /// The simulation at the MAP.
    pub(crate) map_curve: Points,
    /// The simulation with the case's own materials; none of results from before there was one.
    pub(crate) baseline_curve: Option<Points>,
    /// Damage in the simulation at the MAP, as it grows.
    pub(crate) damage: Vec<DamageState>,
    /// Simulations at posterior draws.
    pub(crate) posterior_curves: Vec<Points>,
    /// What a new specimen's curve will be; none if it is not predicted.
    pub(crate) predicted_curves: Option<PredictedBand>,
    /// The quantities of interest.
    pub(crate) qois: Vec<Qoi>,
    /// The surrogate, order by order.
    pub(crate) orders: Vec<OrderErrors>,
    /// The order that was chosen, and the rule.
    pub(crate) chosen_order: usize,
    /// In words, how it was chosen.
    pub(crate) order_rule: String,
    /// Inputs of the surrogate beside the parameters: what is known of each specimen.
    pub(crate) known_inputs: Vec<String>,
    /// The calibrated parameters.
    pub(crate) parameters: Vec<CalibratedParameter>,
    /// What makes the width of each parameter's interval: its label, and sources with their shares.
    pub(crate) budget: Vec<(String, Vec<(String, f64)>)>,
    /// Every number that was sampled.
    pub(crate) summary: Vec<Summarised>,
    /// Divergent transitions of all chains after warmup.
    pub(crate) divergences: u64,
    /// Leave-one-out predictions, specimen by specimen; empty if there are none.
    pub(crate) loo: Vec<LeftOut>,
    /// What further tests would tell, a parameter each; empty if it was not looked at.
    pub(crate) further: Vec<FurtherParameter>,
    /// Warnings of all stages and rules; empty if there are none.
    pub(crate) warnings: Vec<String>,
    /// Notes that belong to the reading: scaled displacements, mesh bias and the like.
    pub(crate) notes: Vec<String>,
    /// Settings of the run: name and value.
    pub(crate) settings: Vec<(String, String)>,
}

/// What further tests would tell of a parameter.
#[derive(Clone, Debug, Default)]
pub(crate) struct FurtherParameter {
    /// Label with unit.
    pub(crate) label: String,
    /// Its contraction now.
    pub(crate) now: f64,
    /// The tests, all with the same numbers of specimens and the same goals.
    pub(crate) tests: Vec<FurtherTestResult>,
}

/// What a further test would tell of a parameter.
#[derive(Clone, Debug, Default)]
pub(crate) struct FurtherTestResult {
    /// What it is called.
    pub(crate) name: String,
    /// By numbers of further specimens.
    pub(crate) expected: Vec<FurtherExpected>,
    /// Numbers of specimens that goals take.
    pub(crate) needed: Vec<FurtherNeeded>,
}

/// What is to be expected after further specimens.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FurtherExpected {
    /// How many.
    pub(crate) specimens: usize,
    /// 1 − posterior variance / prior variance.
    pub(crate) contraction: f64,
}

/// How many further specimens a goal takes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FurtherNeeded {
    /// Whether a width of the 90 % interval is wanted, and not a contraction.
    pub(crate) is_width: bool,
    /// What is wanted.
    pub(crate) value: f64,
    /// How many; none where no number suffices.
    pub(crate) specimens: Option<usize>,
    /// What any number would give.
    pub(crate) limit: f64,
}

/// Forces of new specimens along the displacement.
#[derive(Clone, Debug, Default)]
pub(crate) struct PredictedBand {
    /// mm
    pub(crate) displacement_mm: Vec<f64>,
    /// 5, 25, 50, 75 and 95 % quantiles, N, each along the displacement.
    pub(crate) force_n: [Vec<f64>; 5],
}

/// What was found in one measured curve.
#[derive(Clone, Debug)]
pub(crate) struct Finding {
    /// The specimen.
    pub(crate) specimen: String,
    /// What.
    pub(crate) finding: String,
    /// How much of it, and what to do.
    pub(crate) help: String,
}

/// A specimen as the others predict it.
#[derive(Clone, Debug, Default)]
pub(crate) struct LeftOut {
    /// The specimen.
    pub(crate) specimen: String,
    /// Log predictive density.
    pub(crate) elpd: f64,
    /// Shape of the tail of the importance weights.
    pub(crate) pareto_k: f64,
    /// The parameter that moves most without the specimen, and by how many of its standard deviations.
    pub(crate) moved: Option<(String, f64)>,
    /// Whether the posterior without the specimen was sampled, and not estimated by weights.
    pub(crate) is_sampled: bool,
}

/// A specimen without which a posterior mean shifts by more of its standard deviations is named.
pub(crate) const MOST_SHIFT: f64 = 1.0;

/// A moment of a simulation.
#[derive(Clone, Debug, Default)]
pub(crate) struct DamageState {
    /// Displacement in mm.
    pub(crate) displacement_mm: f64,
    /// Force in N.
    pub(crate) force_n: f64,
    /// Damage in the specimen cut open, a PNG.
    pub(crate) picture: Vec<u8>,
}

/// One number that was sampled.
#[derive(Clone, Debug, Default)]
pub(crate) struct Summarised {
    /// What it is.
    pub(crate) name: String,
    /// Mean, sd, 5, 50 and 95 % quantiles, each with its Monte Carlo error (NaN: not known).
    pub(crate) moments: [(f64, f64); 5],
    /// How well chains agree: 1 where they do.
    pub(crate) rhat: f64,
    /// Effective sample size of the bulk.
    pub(crate) ess_bulk: f64,
    /// Effective sample size of the tails.
    pub(crate) ess_tail: f64,
}

/// A picture with what it shows.
#[derive(Clone, Debug)]
pub(crate) struct Picture {
    /// What it shows, a sentence.
    pub(crate) caption: String,
    /// The picture.
    pub(crate) content: PictureContent,
}

/// A picture's file.
#[derive(Clone, Debug)]
pub(crate) enum PictureContent {
    /// Pixels.
    Png(Vec<u8>),
    /// Lines.
    Svg(String),
}

/// One quantity of interest.
#[derive(Clone, Debug, Default)]
pub(crate) struct Qoi {
    /// Name with unit.
    pub(crate) label: String,
    /// One value a specimen.
    pub(crate) experiments: Vec<f64>,
    /// One value a run of the ensemble.
    pub(crate) ensemble: Vec<f64>,
    /// Draws of what a new specimen will show.
    pub(crate) predictive: Vec<f64>,
    /// The simulation at the MAP.
    pub(crate) map: f64,
    /// Relative difference of that to the experimental mean, in per cent.
    pub(crate) percent_error: f64,
    /// What the mesh is estimated to do to it, in per cent, where that is known.
    pub(crate) mesh_error_percent: Option<f64>,
    /// Total Sobol index for every parameter, with the ends of its 90 % interval where there is one.
    pub(crate) sobol_total: Vec<(f64, Option<[f64; 2]>)>,
}

/// The surrogate at one order.
#[derive(Clone, Debug, Default)]
pub(crate) struct OrderErrors {
    /// Polynomial order.
    pub(crate) order: usize,
    /// Relative leave-one-out error, averaged over the outputs; `None`: not estimable.
    pub(crate) loo: Option<f64>,
    /// The same, corrected for the sample size.
    pub(crate) corrected: Option<f64>,
    /// Relative training error of the 70/30 split.
    pub(crate) training: Option<f64>,
    /// Relative validation error of the 70/30 split.
    pub(crate) validation: Option<f64>,
}

/// One calibrated parameter.
#[derive(Clone, Debug, Default)]
pub(crate) struct CalibratedParameter {
    /// Label with unit.
    pub(crate) label: String,
    /// Ends of the prior box.
    pub(crate) prior: (f64, f64),
    /// Where the runs of the ensemble lie.
    pub(crate) design: Vec<f64>,
    /// Draws by chain.
    pub(crate) chains: Vec<Vec<f64>>,
    /// Mean with its Monte Carlo error.
    pub(crate) mean: (f64, f64),
    /// Standard deviation with its Monte Carlo error.
    pub(crate) sd: (f64, f64),
    /// 5 % quantile with its Monte Carlo error.
    pub(crate) q05: (f64, f64),
    /// 95 % quantile with its Monte Carlo error.
    pub(crate) q95: (f64, f64),
    /// Joint mode.
    pub(crate) map: f64,
    /// 1 − posterior variance / prior variance.
    pub(crate) contraction: f64,
    /// The truth, of virtual specimens.
    pub(crate) truth: Option<f64>,
    /// Whether the data lie outside what any simulation reaches.
    pub(crate) out_of_range: bool,
    /// What its value depends on beside the data, as rules have found.
    pub(crate) qualifiers: BTreeSet<Qualifier>,
}

/// A reason why an identified value is not that of the material alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Qualifier {
    /// All runs are on one microstructure: no interval includes how others scatter about it.
    OneMicrostructure,
    /// The error of the mesh is larger than what the intervals include.
    MeshError,
    /// The model at the mode does not reproduce the specimens.
    PoorFit,
}

impl Qualifier {
    /// What follows "identified".
    fn words(self) -> &'static str {
        match self {
            Self::OneMicrostructure => " for this microstructure",
            Self::MeshError => " on this mesh",
            Self::PoorFit => ", fit poor",
        }
    }
}

/// What the data said about a parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Nothing that counts: no simulation reaches them.
    OutOfRange,
    /// It is where the prior ends.
    AtBound,
    /// Identified, but for reasons that the intervals do not include.
    Qualified(BTreeSet<Qualifier>),
    /// So much.
    Learnt(Identification),
}

impl Verdict {
    /// Whether the data narrowed the parameter, with or without qualifiers.
    pub(crate) fn is_identified(&self) -> bool {
        matches!(self, Self::Qualified(_) | Self::Learnt(Identification::Identified))
    }

    /// Whether it is identified, and no rule has found anything against it.
    pub(crate) fn is_good(&self) -> bool {
        *self == Self::Learnt(Identification::Identified)
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::OutOfRange => f.pad("data out of range"),
            Self::AtBound => f.pad("at the bound of its prior"),
            Self::Qualified(qualifiers) => {
                let words: String = qualifiers.iter().map(|q| q.words()).collect();
                f.pad(&format!("{}{words}", Identification::Identified))
            }
            Self::Learnt(label) => label.fmt(f),
        }
    }
}

/// A mode within this fraction of the prior's width from a bound is at it, and so is a draw.
const MARGIN: f64 = 0.01;
/// More than this fraction of the draws there, and the prior cuts the posterior.
const MOST_AT_BOUND: f64 = 0.05;

impl CalibratedParameter {
    /// All draws, chain after chain.
    pub(crate) fn draws(&self) -> impl Iterator<Item = f64> + '_ {
        self.chains.iter().flatten().copied()
    }

    /// What the data said.
    pub(crate) fn verdict(&self) -> Verdict {
        match Identification::of(self.contraction) {
            _ if self.out_of_range => Verdict::OutOfRange,
            Identification::Identified if self.is_at_bound() => Verdict::AtBound,
            Identification::Identified if !self.qualifiers.is_empty() => {
                Verdict::Qualified(self.qualifiers.clone())
            }
            label => Verdict::Learnt(label),
        }
    }

    /// Whether mode or draws press against an end of the prior.
    fn is_at_bound(&self) -> bool {
        let (lower, upper) = self.prior;
        let margin = MARGIN * (upper - lower);
        let near = |x: f64| x < lower + margin || x > upper - margin;
        let (all, at_bound) = (self.draws().count(), self.draws().filter(|&x| near(x)).count());
        near(self.map) || at_bound as f64 > MOST_AT_BOUND * all as f64
    }
}

/// The mean; NaN of nothing.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameter(map: f64, draws: Vec<f64>) -> CalibratedParameter {
        let chains = vec![draws];
        CalibratedParameter {
            prior: (0.0, 100.0),
            map,
            chains,
            contraction: 0.9,
            ..Default::default()
        }
    }

    #[test]
    fn nothing_at_a_bound_or_out_of_range_is_called_identified() {
        let middle: Vec<f64> = (0..100).map(|i| 40.0 + 0.2 * f64::from(i)).collect();
        let cut: Vec<f64> = (0..100).map(|i| 90.0 + 0.1 * f64::from(i)).collect();
        let identified = Verdict::Learnt(Identification::Identified);
        assert_eq!(parameter(50.0, middle.clone()).verdict(), identified);
        assert_eq!(parameter(99.5, middle.clone()).verdict(), Verdict::AtBound);
        assert_eq!(parameter(95.0, cut).verdict(), Verdict::AtBound);
        let outside = CalibratedParameter { out_of_range: true, ..parameter(50.0, middle.clone()) };
        assert_eq!(outside.verdict(), Verdict::OutOfRange);
        let unknown = CalibratedParameter { contraction: 0.0, ..parameter(99.5, middle) };
        assert_eq!(unknown.verdict().to_string(), "not identified");
    }

    #[test]
    fn qualifiers_stand_behind_identified_and_take_the_green_away() {
        let middle: Vec<f64> = (0..100).map(|i| 40.0 + 0.2 * f64::from(i)).collect();
        let of = |qualifiers: &[Qualifier]| CalibratedParameter {
            qualifiers: qualifiers.iter().copied().collect(),
            ..parameter(50.0, middle.clone())
        };
        use Qualifier::{MeshError, OneMicrostructure, PoorFit};
        for (qualifiers, words) in [
            (&[PoorFit][..], "identified, fit poor"),
            (&[MeshError], "identified on this mesh"),
            (&[OneMicrostructure], "identified for this microstructure"),
            (
                &[PoorFit, MeshError, OneMicrostructure],
                "identified for this microstructure on this mesh, fit poor",
            ),
        ] {
            let verdict = of(qualifiers).verdict();
            assert_eq!(verdict.to_string(), words);
            assert!(verdict.is_identified() && !verdict.is_good());
        }
        assert!(of(&[]).verdict().is_good());
        // what is not identified stays so
        let unknown = CalibratedParameter { contraction: 0.2, ..of(&[PoorFit]) };
        assert_eq!(unknown.verdict().to_string(), "weakly identified");
        assert!(!unknown.verdict().is_identified());
    }
}
