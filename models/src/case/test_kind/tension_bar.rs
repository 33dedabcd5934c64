//! Tension of a bar whose ends are gripped.

use super::super::conditions::{ConditionsCase, MeasureCase, Similarity};
use super::definition::{TestKind, TestSetting, WrongKey, prescribed};

/// `test.kind = "tension-bar"`: all displacement components of both end faces are prescribed.
#[derive(Clone, Copy, Debug)]
pub(super) struct TensionBar;

impl TestKind for TensionBar {
    fn name(&self) -> &'static str {
        "tension-bar"
    }

    fn in_words(&self) -> String {
        "tension of a bar with gripped ends".to_owned()
    }

    fn surfaces(&self) -> &'static [&'static str] {
        &["bottom", "top"]
    }

    fn check(&self, _: &TestSetting) -> Result<(), WrongKey> {
        Ok(())
    }

    fn conditions(&self, setting: &TestSetting) -> ConditionsCase {
        let still = Some(0.0);
        let moved = Some(setting.displacement_mm);
        let measure = MeasureCase { surface: "top".to_owned(), direction: [0.0, 0.0, 1.0] };
        ConditionsCase {
            prescribe: vec![
                prescribed("bottom", [still; 3]),
                prescribed("top", [still, still, moved]),
            ],
            ..ConditionsCase::of_kind(measure, Similarity::Axial)
        }
    }
}
