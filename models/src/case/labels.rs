//! Interpretation of the labels of `[specimen.image]`: the keys `label_phases` and `background`.

use std::ops::RangeInclusive;

use fem::{LabelPhase, LabelRules};

use super::{CaseFile, ImageCase};
use crate::error::InputError;

const PHASES: &str = "specimen.image.label_phases";

impl CaseFile {
    /// Returns the rules that map labels to grains of phases.
    ///
    /// # Errors
    /// If a key is not a label or a range of labels, if the name of a phase is not valid, or if a label has two
    /// meanings.
    pub(super) fn label_rules(&self, image: &ImageCase) -> Result<LabelRules, InputError> {
        let mut phases = Vec::new();
        for (labels, name) in image.label_phases.iter().flatten() {
            let shown = format!("{labels} = {name:?}");
            let Some(range) = label_range(labels) else {
                let help = "Write a label, 1 = \"grain\", or several that are a grain each, \"1 to 500\" = \"grain\".";
                return Err(self.error(PHASES, shown, "names no label", help));
            };
            let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
            if name.is_empty() || !name.chars().all(is_word) {
                let problem = "is not the name of a phase";
                let help = "A name has letters, digits, - and _, as in [material.NAME]; \"matrix\" and \"void\" are known.";
                return Err(self.error(PHASES, shown, problem, help));
            }
            let (first, last) = range.into_inner();
            phases.push(LabelPhase { first, last, name: name.clone() });
        }
        if image.label_phases.is_some() && phases.is_empty() {
            let help = "Leave it out where each label is a grain.";
            return Err(self.error(PHASES, "{}", "names no phase", help));
        }
        // the map sorts its keys as text; sort the phases by the numbers of their labels instead
        phases.sort_by_key(|phase| phase.first);
        let segmentation = &image.segmentation;
        let rules = LabelRules {
            background: image.background,
            phases,
            specimen: segmentation.specimen,
            follow_lean: segmentation.follow_lean,
            region: segmentation.region.clone(),
            small_grain_voxels: segmentation.min_grain_voxels,
        };
        match rules.check() {
            Ok(()) => Ok(rules),
            Err(error) => Err(self.error(
                "specimen.image",
                "",
                error.to_string(),
                "See docs/how-to/labels.md.",
            )),
        }
    }
}

/// Parses a key of `label_phases`: a label, or a range of labels such as `1 to 500`.
fn label_range(key: &str) -> Option<RangeInclusive<i64>> {
    let label = |text: &str| text.trim().parse::<i64>().ok();
    match key.split_once("to") {
        None => label(key).map(|label| label..=label),
        Some((first, last)) => Some(label(first)?..=label(last)?),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_labels_or_ranges_of_them() {
        for (key, range) in [
            ("7", Some(7..=7)),
            ("-3", Some(-3..=-3)),
            ("1 to 500", Some(1..=500)),
            ("-8 to -2", Some(-8..=-2)),
            ("one", None),
            ("1-5", None),
            ("to 5", None),
            ("1.5", None),
        ] {
            assert_eq!(label_range(key), range, "{key}");
        }
    }
}
