//! Specimens of the runs of an ensemble, as recorded in `runs.csv`.

use surrogate::Dataset;

use crate::pipeline::inputs::Inputs;
use crate::specimen::image_inputs;

/// Column of `runs.csv` with the seed of the packing; empty without a packing.
pub(crate) const SEED: &str = "packing_seed";

/// Column of `runs.csv` with the number of the image, if there are several images; image 1 is the image that the
/// case names in `specimen.image`.
pub(crate) const IMAGE: &str = "image";

/// Minimum number of specimens for the stiffness ratio to be an input of the surrogate. Two specimens determine the
/// straight line of the mean response over the ratio; two more specimens show the scatter about this line.
pub(crate) const LEAST_FOR_STIFFNESS: usize = 4;

/// Number of specimens below which a warning reports that the scatter between specimens is poorly known.
const FEW: usize = 5;

/// Assignment of runs to specimens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum MadeOn {
    /// All runs use the same specimen.
    One,
    /// Each run has a separate specimen.
    Each,
    /// Some runs share a specimen: the specimen's index (from 0) of each run.
    Several(Vec<usize>),
}

impl MadeOn {
    pub(crate) fn of(runs: &Dataset) -> Self {
        let mut names: Vec<&str> = Vec::new();
        let mut groups = Vec::with_capacity(runs.len());
        for i in 0..runs.len() {
            let name = specimen_of(runs, i);
            let index = names.iter().position(|group| *group == name).unwrap_or(names.len());
            if index == names.len() {
                names.push(name);
            }
            groups.push(index);
        }
        match names.len() {
            0 | 1 => Self::One,
            count if count == runs.len() => Self::Each,
            _ => Self::Several(groups),
        }
    }

    /// Whether the runs show the scatter between specimens.
    pub(crate) fn shows_scatter(&self) -> bool {
        *self != Self::One
    }

    /// Number of specimens if the runs share several specimens; otherwise `None`.
    pub(crate) fn several(&self) -> Option<usize> {
        match self {
            Self::Several(groups) => groups.iter().max().map(|last| 1 + last),
            _ => None,
        }
    }

    /// Whether there are too few specimens for the stiffness ratio to be an input of the surrogate.
    pub(crate) fn are_too_few_for_stiffness(&self) -> bool {
        self.several().is_some_and(|count| count < LEAST_FOR_STIFFNESS)
    }

    /// Returns a warning if runs share only a few specimens. For a single specimen, the rule `microstructure` warns
    /// instead.
    pub(crate) fn warning(&self, inputs: &Inputs<'_>) -> Option<String> {
        // read the case only if needed: reading a key registers a dependency
        let count = self.several()?;
        let image = image_inputs::image_settings(inputs);
        let is_image = image.stack.is_some() || image.labels.is_some();
        let (what, mend) = match is_image {
            true => ("images", "more images in specimen.image.further_stacks"),
            false => ("packings", "more of design.packings"),
        };
        (count < FEW).then(|| {
            format!(
                "The runs are on {count} {what} only, so that the scatter between specimens is poorly known. The intervals \
                 include this uncertainty (Student's t distribution); {mend} would make the intervals narrower."
            )
        })
    }
}

/// Name of the specimen of a run; empty if all runs share a specimen without a name.
pub(crate) fn specimen_of(runs: &Dataset, run: usize) -> &str {
    let named = |column| runs.note(run, column).filter(|name| !name.is_empty());
    named(SEED).or_else(|| named(IMAGE)).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use surrogate::Input;

    use super::*;

    fn made_on(column: &str, names: &[&str]) -> MadeOn {
        let input = Input::new("x", 0.0, 1.0).unwrap();
        let mut runs = Dataset::new(vec![input], vec!["y".into()], "made up").unwrap();
        runs = runs.with_notes(&["run", column]).unwrap();
        for (i, name) in names.iter().enumerate() {
            runs.push_noted(&[0.5], &[1.0], &[&i.to_string(), name]).unwrap();
        }
        MadeOn::of(&runs)
    }

    #[test]
    fn runs_tell_what_they_were_made_on() {
        assert_eq!(made_on(SEED, &["", "", ""]), MadeOn::One);
        assert_eq!(made_on(SEED, &["7", "7", "7"]), MadeOn::One);
        assert_eq!(made_on(SEED, &["7", "8", "9"]), MadeOn::Each);
        assert_eq!(made_on("other", &["7", "8", "9"]), MadeOn::One);
        let shared = made_on(IMAGE, &["2", "1", "3", "1"]);
        assert_eq!(shared, MadeOn::Several(vec![0, 1, 2, 1]));
        assert_eq!(shared.several(), Some(3));
        assert!(shared.are_too_few_for_stiffness() && !MadeOn::Each.are_too_few_for_stiffness());
    }
}
