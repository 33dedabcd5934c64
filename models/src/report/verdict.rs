//! A calibrated parameter, and the conclusion from the data about it.

use std::collections::BTreeSet;
use std::fmt;

use ppl::diagnostics::Identification;

use super::digits::plain;
use crate::prior::Prior;

/// One calibrated parameter.
#[derive(Clone, Debug, Default)]
pub(crate) struct CalibratedParameter {
    /// Label with unit.
    pub(crate) label: String,
    /// The prior.
    pub(crate) prior: Prior,
    /// Values of the parameter in the runs of the ensemble.
    pub(crate) design: Vec<f64>,
    /// Draws of each chain.
    pub(crate) chains: Vec<Vec<f64>>,
    /// Mean with its Monte Carlo error.
    pub(crate) mean: (f64, f64),
    /// Standard deviation with its Monte Carlo error.
    pub(crate) sd: (f64, f64),
    /// 5 % quantile with its Monte Carlo error.
    pub(crate) q05: (f64, f64),
    /// 95 % quantile with its Monte Carlo error.
    pub(crate) q95: (f64, f64),
    /// Value at the joint mode (MAP).
    pub(crate) map: f64,
    /// Contraction: 1 − posterior variance / prior variance.
    pub(crate) contraction: f64,
    /// True value, for virtual specimens.
    pub(crate) truth: Option<f64>,
    /// Whether the data lie outside the range of all simulations.
    pub(crate) out_of_range: bool,
    /// Restrictions of the verdict "identified", as determined by the rules.
    pub(crate) qualifiers: BTreeSet<Qualifier>,
}

/// Reason why an identified value may not be a property of the material alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Qualifier {
    /// All runs use one microstructure: the intervals do not include the scatter between microstructures.
    OneMicrostructure,
    /// The error of the mesh is larger than the mesh error that the intervals include.
    MeshError,
    /// Displacements of the measured curves include a toe.
    Toe,
    /// More than a tenth of the runs have no quantities of interest, so that the surrogate extrapolates.
    MissingRuns,
    /// The model at the posterior mode does not reproduce the specimens.
    PoorFit,
    /// Held-out specimens contradict their prediction.
    NotValidated,
}

impl Qualifier {
    /// Text that follows "identified".
    fn words(self) -> &'static str {
        match self {
            Self::OneMicrostructure => " for this microstructure",
            Self::MeshError => " on this mesh",
            Self::Toe => " with the toe",
            Self::MissingRuns => " with missing runs",
            Self::PoorFit => ", fit poor",
            Self::NotValidated => ", validation failed",
        }
    }
}

/// Conclusion from the data about a parameter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// No conclusion: the data lie outside the range of all simulations.
    OutOfRange,
    /// The posterior is at a bound of the prior.
    AtBound,
    /// Identified, but with qualifiers: errors or conditions that the intervals do not include.
    Qualified(BTreeSet<Qualifier>),
    /// Degree of identification without reservations.
    Learnt(Identification),
}

impl Verdict {
    /// Whether the data identify the parameter, with or without qualifiers.
    pub(crate) fn is_identified(&self) -> bool {
        matches!(self, Self::Qualified(_) | Self::Learnt(Identification::Identified))
    }

    /// Whether the parameter is identified without qualifiers.
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

/// Contraction from which a parameter is identified: the threshold of [`Identification::of`].
pub(crate) const IDENTIFIED: f64 = 0.5;
/// Contraction from which a parameter is weakly identified.
pub(crate) const WEAKLY: f64 = 0.1;
/// Distance from a bound, as a fraction of the width of the prior, within which a mode or a draw counts as at the
/// bound.
pub(crate) const MARGIN: f64 = 0.01;
/// Largest fraction of the draws at a bound for which the posterior does not count as truncated by the prior.
pub(crate) const MOST_AT_BOUND: f64 = 0.05;

impl CalibratedParameter {
    /// Iterates over all draws, chain by chain.
    pub(crate) fn draws(&self) -> impl Iterator<Item = f64> + '_ {
        self.chains.iter().flatten().copied()
    }

    /// Ends of the prior's range.
    pub(crate) fn range(&self) -> (f64, f64) {
        self.prior.range().into()
    }

    /// Range of the prior, after the name of its distribution unless it is uniform.
    pub(crate) fn prior_words(&self) -> String {
        let [lower, upper] = self.prior.range().map(plain);
        match self.prior.is_uniform() {
            true => format!("{lower} … {upper}"),
            false => format!("{}, {lower} … {upper}", self.prior.family()),
        }
    }

    /// Returns the conclusion from the data about this parameter.
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

    /// Whether the mode or too many draws are at a bound of the prior.
    fn is_at_bound(&self) -> bool {
        let [lower, upper] = self.prior.range();
        let margin = MARGIN * (upper - lower);
        let near = |x: f64| x < lower + margin || x > upper - margin;
        let (all, at_bound) = (self.draws().count(), self.draws().filter(|&x| near(x)).count());
        near(self.map) || at_bound as f64 > MOST_AT_BOUND * all as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parameter(map: f64, draws: Vec<f64>) -> CalibratedParameter {
        let chains = vec![draws];
        CalibratedParameter {
            prior: Prior::uniform(0.0, 100.0),
            map,
            chains,
            contraction: 0.9,
            ..Default::default()
        }
    }

    #[test]
    fn stated_thresholds_are_those_of_the_verdicts() {
        let below = |x: f64| x - 1e-9;
        assert_eq!(Identification::of(IDENTIFIED), Identification::Identified);
        assert_eq!(Identification::of(below(IDENTIFIED)), Identification::Weakly);
        assert_eq!(Identification::of(WEAKLY), Identification::Weakly);
        assert_eq!(Identification::of(below(WEAKLY)), Identification::Not);
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
        let calibrated = |qualifiers: &[Qualifier]| CalibratedParameter {
            qualifiers: qualifiers.iter().copied().collect(),
            ..parameter(50.0, middle.clone())
        };
        use Qualifier::{MeshError, MissingRuns, OneMicrostructure, PoorFit};
        for (qualifiers, words) in [
            (&[PoorFit][..], "identified, fit poor"),
            (&[MeshError], "identified on this mesh"),
            (&[OneMicrostructure], "identified for this microstructure"),
            (&[MissingRuns], "identified with missing runs"),
            (
                &[PoorFit, MeshError, OneMicrostructure],
                "identified for this microstructure on this mesh, fit poor",
            ),
        ] {
            let verdict = calibrated(qualifiers).verdict();
            assert_eq!(verdict.to_string(), words);
            assert!(verdict.is_identified() && !verdict.is_good());
        }
        assert!(calibrated(&[]).verdict().is_good());
        // qualifiers do not change a parameter that is not identified
        let unknown = CalibratedParameter { contraction: 0.2, ..calibrated(&[PoorFit]) };
        assert_eq!(unknown.verdict().to_string(), "weakly identified");
        assert!(!unknown.verdict().is_identified());
    }
}
