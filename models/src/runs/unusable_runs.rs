//! Runs of an ensemble without quantities of interest: number, most frequent reason, and remedy.

use std::collections::BTreeMap;

use crate::pipeline::inputs::Inputs;

/// Largest share of runs without quantities at which the verdict is still "identified"; with a larger share, the verdict is
/// "identified with missing runs". Runs fail in a part of the prior box, not at random: a run has no peak if its peak is
/// beyond the end of the simulated test. With more missing runs, the surrogate extrapolates into this part.
pub(crate) const MOST_UNUSABLE: f64 = 0.1;

/// Origin of the runs, on which the remedy depends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RunOrigin {
    /// Simulations of this program.
    BuiltIn,
    /// Runs of the program of `[simulator]`.
    Simulator,
    /// Rows of the table of `design.import`.
    Imported,
}

impl RunOrigin {
    /// Origin of the runs of a case.
    pub(crate) fn of(inputs: &Inputs<'_>) -> Self {
        match inputs.is_built_in() {
            true => Self::BuiltIn,
            false if inputs.imports_runs() => Self::Imported,
            false => Self::Simulator,
        }
    }

    /// Advice for a reason why runs have no quantities.
    fn remedy(self, reason: &str) -> &'static str {
        let has_no_peak = reason.contains("no peak");
        match self {
            Self::BuiltIn if reason.contains("without derivatives") => {
                "Write derivatives = false under [design], or narrow [prior]."
            }
            Self::BuiltIn if reason.contains("failed: ") => {
                "Choose smaller load steps (test.steps, test.adaptive), or narrow [prior] to values for which the \
                 simulation converges."
            }
            Self::BuiltIn if has_no_peak => {
                "Increase test.displacement_mm (or extend test.program) until the force falls in every run, or narrow \
                 [prior]."
            }
            Self::BuiltIn => {
                "Change [test], so that every run gives all quantities of qoi.quantities, or narrow [prior]."
            }
            Self::Simulator if has_no_peak => {
                "Let the program of [simulator] continue until the force falls, or narrow [prior]."
            }
            Self::Simulator => {
                "See program-output.txt in the folder of the run (ensemble/…/work), and correct the program of \
                 [simulator] or narrow [prior]; a longer simulator.time_limit_s or simulator.retries repeats failed runs."
            }
            Self::Imported => "Correct or complete these rows of the table of design.import.",
        }
    }
}

/// The runs without quantities of one ensemble.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct UnusableRuns {
    unusable: usize,
    total: usize,
    /// Number of the first run with the most frequent reason.
    run: usize,
    /// Reason of this run.
    reason: String,
    /// Number of runs with the most frequent reason.
    alike: usize,
    origin: RunOrigin,
}

impl UnusableRuns {
    /// Counts the failed runs among `total` runs by their reasons. `failed` has the number of each failed run and its
    /// reason. Returns `None` if no run failed. Reasons that differ only in their numbers are one reason.
    pub(crate) fn of<'r>(
        total: usize,
        failed: impl Iterator<Item = (usize, &'r str)>,
        origin: RunOrigin,
    ) -> Option<Self> {
        let mut kinds: BTreeMap<String, Vec<(usize, &str)>> = BTreeMap::new();
        let mut unusable = 0;
        for (run, reason) in failed {
            unusable += 1;
            kinds.entry(without_numbers(reason)).or_default().push((run, reason));
        }
        // among equally frequent reasons, choose the reason of the earliest run
        let key = |runs: &&Vec<(usize, &str)>| (runs.len(), std::cmp::Reverse(runs[0].0));
        let most = kinds.values().max_by_key(key)?;
        let (run, reason) = most[0];
        Some(Self {
            unusable,
            total,
            run,
            reason: reason.trim_end_matches('.').to_owned(),
            alike: most.len(),
            origin,
        })
    }

    /// Whether more than a tenth of the runs have no quantities.
    pub(crate) fn are_many(&self) -> bool {
        self.unusable as f64 > MOST_UNUSABLE * self.total as f64
    }

    /// Warning about the runs that the surrogate lacks.
    pub(crate) fn warning(&self) -> String {
        let Self { unusable, total, .. } = self;
        let consequence = match self.are_many() {
            true => {
                "and are omitted from the surrogate. They usually share one side of the prior box, where the surrogate \
                 extrapolates, so that the calibrated values can be biased"
            }
            false => {
                "and are omitted from the surrogate, which is less accurate near their parameters"
            }
        };
        format!(
            "{unusable} of {total} runs have no quantities {consequence} (failed_runs.csv). {} {}",
            self.most_frequent(),
            self.origin.remedy(&self.reason)
        )
    }

    /// Error message if too few runs have quantities: `least` runs are needed.
    pub(crate) fn too_few(&self, least: usize) -> String {
        let Self { unusable, total, .. } = self;
        format!(
            "{unusable} of {total} runs have no quantities, and a surrogate needs at least {least} runs with quantities. {} {}",
            self.most_frequent(),
            self.origin.remedy(&self.reason)
        )
    }

    fn most_frequent(&self) -> String {
        let Self { run, reason, alike, unusable, .. } = self;
        match (*unusable, *alike) {
            (1, _) => format!("Run {run}: {reason}."),
            (_, 1) => format!("For example run {run}: {reason}."),
            (all, alike) if all == alike => {
                format!("All of them, for example run {run}: {reason}.")
            }
            (_, alike) => {
                format!(
                    "The most frequent reason, of {alike} runs, for example run {run}: {reason}."
                )
            }
        }
    }
}

/// Returns a reason without the words that contain digits.
fn without_numbers(reason: &str) -> String {
    let words =
        reason.split_whitespace().filter(|word| !word.contains(|c: char| c.is_ascii_digit()));
    words.collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    const NO_PEAK: [&str; 2] = [
        "unusable: no peak: the force is highest at the end of the curve (0.22 mm)",
        "unusable: no peak: the force is highest at the end of the curve (0.2 mm)",
    ];

    #[test]
    fn the_most_frequent_reason_is_named_with_its_remedy() {
        let failed = [(3, "failed: no equilibrium at 0.1 mm"), (5, NO_PEAK[0]), (6, NO_PEAK[1])];
        let text = |origin| UnusableRuns::of(20, failed.into_iter(), origin).unwrap().warning();
        let built_in = text(RunOrigin::BuiltIn);
        for part in [
            "3 of 20 runs have no quantities",
            "of 2 runs, for example run 5: unusable: no peak",
            "test.displacement_mm",
        ] {
            assert!(built_in.contains(part), "{part}: {built_in}");
        }
        assert!(text(RunOrigin::Simulator).contains("[simulator]"));
        assert!(text(RunOrigin::Imported).contains("design.import"));
        let slow = UnusableRuns::of(20, failed[..1].iter().copied(), RunOrigin::BuiltIn).unwrap();
        assert!(slow.warning().contains("test.steps"), "{}", slow.warning());
        let error = UnusableRuns::of(3, failed.into_iter(), RunOrigin::BuiltIn).unwrap().too_few(2);
        for part in ["3 of 3 runs", "at least 2 runs", "no peak", "test.displacement_mm"] {
            assert!(error.contains(part), "{part}: {error}");
        }
        assert_eq!(UnusableRuns::of(20, [].into_iter(), RunOrigin::BuiltIn), None);
    }

    #[test]
    fn more_than_a_tenth_of_the_runs_are_many() {
        let runs = |count: usize, total: usize| {
            UnusableRuns::of(total, (1..=count).map(|run| (run, NO_PEAK[0])), RunOrigin::BuiltIn)
        };
        let [few, many] = [runs(2, 20).unwrap(), runs(3, 20).unwrap()];
        assert!(!few.are_many() && few.warning().contains("less accurate near"));
        assert!(many.are_many() && many.warning().contains("extrapolates"));
    }
}
