//! Three-point bending of a notched beam.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::conditions::{ConditionsCase, LineCase, MeasureCase, Similarity};
use super::definition::{TestKind, TestSetting, WrongKey, prescribed};

/// Lines of the two supports and of the load.
const SUPPORTS: [(&str, f64); 2] = [("support-left", -0.5), ("support-right", 0.5)];
const LOAD: &str = "load";

/// `test.kind.notched-beam`: the block of `specimen.block_mm` lies on two line supports across its width; a line at
/// midspan moves down. The notch opens between the supports.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NotchedBeam {
    /// Distance between the supports in mm.
    #[schemars(range(min = 1e-3, max = 1e4))]
    pub span_mm: f64,
}

impl TestKind for NotchedBeam {
    fn name(&self) -> &'static str {
        "notched-beam"
    }

    fn in_words(&self) -> String {
        format!("three-point bending of a notched beam with a span of {} mm", self.span_mm)
    }

    fn surfaces(&self) -> &'static [&'static str] {
        &[]
    }

    fn check(&self, setting: &TestSetting) -> Result<(), WrongKey> {
        let missing = |key: &str, help| WrongKey {
            key: format!("specimen.{key}"),
            value: String::new(),
            problem: "is missing: test.kind = notched-beam needs it".to_owned(),
            help,
        };
        let help = "Give length, width and depth of the beam in mm: block_mm = [48.0, 10.0, 10.0].";
        let [length_mm, ..] = setting.block_mm.ok_or_else(|| missing("block_mm", help))?;
        let help = "Add the notch: notch = { depth_mm = 3.0, width_mm = 0.5 }.";
        let notch = setting.notch.ok_or_else(|| missing("notch", help))?;
        if self.span_mm > notch.width_mm && self.span_mm <= length_mm {
            return Ok(());
        }
        Err(WrongKey {
            key: "test.kind.notched-beam.span_mm".to_owned(),
            value: self.span_mm.to_string(),
            problem: format!(
                "must lie between the width of the notch, {} mm, and the length of the block, {length_mm} mm",
                notch.width_mm
            ),
            help: "The span is the distance between the two line supports.",
        })
    }

    fn conditions(&self, setting: &TestSetting) -> ConditionsCase {
        let [_, width_mm, depth_mm] = setting.block_mm.unwrap_or([f64::NAN; 3]);
        let across = |x: f64, z: f64| {
            let [from_mm, to_mm] = [-0.5, 0.5].map(|part| [x, part * width_mm, z]);
            LineCase { from_mm, to_mm }
        };
        let supports =
            SUPPORTS.map(|(name, part)| (name.to_owned(), across(part * self.span_mm, 0.0)));
        let load = (LOAD.to_owned(), across(0.0, depth_mm));
        let vertical = |name: &str, z_mm: f64| prescribed(name, [None, None, Some(z_mm)]);
        let held = SUPPORTS.map(|(name, _)| vertical(name, 0.0));
        let moved = vertical(LOAD, -setting.displacement_mm);
        let measure = MeasureCase { surface: LOAD.to_owned(), direction: [0.0, 0.0, -1.0] };
        ConditionsCase {
            lines: BTreeMap::from_iter(supports.into_iter().chain([load])),
            prescribe: held.into_iter().chain([moved]).collect(),
            remove_rigid_motions: true,
            ..ConditionsCase::of_kind(measure, Similarity::Equal)
        }
    }

    fn planes_mm(&self) -> Vec<f64> {
        SUPPORTS.map(|(_, part)| part * self.span_mm).into_iter().chain([0.0]).collect()
    }
}
