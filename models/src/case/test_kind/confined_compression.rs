//! Triaxial compression: a confining pressure on the side, then compression along the axis.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::conditions::{
    ConditionsCase, MeasureCase, PrescribeCase, PressureCase, PressureKind, Similarity, TimeTable,
};
use super::definition::{TestKind, TestSetting, WrongKey, prescribed};

/// Largest pressure in MPa.
const MOST_MPA: f64 = 1e6;

/// `test.kind.confined-compression`: the pressure on the side rises, then stays constant while the top moves down. The end
/// faces slide without friction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConfinedCompression {
    /// Confining pressure in MPa.
    #[schemars(range(min = 0, max = 1e6))]
    pub pressure_mpa: f64,
    /// Time in s at which the pressure reaches its value and the top begins to move.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub confinement_s: f64,
    /// Direction and area of the pressure.
    #[serde(default)]
    pub pressure: PressureKind,
}

impl TestKind for ConfinedCompression {
    fn name(&self) -> &'static str {
        "confined-compression"
    }

    fn in_words(&self) -> String {
        let Self { pressure_mpa, confinement_s, .. } = self;
        format!(
            "compression under a pressure of {pressure_mpa} MPa on the side from {confinement_s} s on"
        )
    }

    fn surfaces(&self) -> &'static [&'static str] {
        &["bottom", "side", "top"]
    }

    fn check(&self, setting: &TestSetting) -> Result<(), WrongKey> {
        let wrong = |name: &str, value: f64, problem: String, help| WrongKey {
            key: format!("test.kind.confined-compression.{name}"),
            value: value.to_string(),
            problem,
            help,
        };
        let Self { pressure_mpa, confinement_s, .. } = *self;
        if !(0.0..=MOST_MPA).contains(&pressure_mpa) {
            let help = "It is the pressure of the fluid around the specimen.";
            let problem = format!("must lie between 0 and {MOST_MPA} MPa");
            return Err(wrong("pressure_mpa", pressure_mpa, problem, help));
        }
        let duration_s = setting.duration_s;
        if !(confinement_s > 0.0 && confinement_s < duration_s) {
            let problem = format!("must lie between 0 and test.duration_s = {duration_s} s");
            let help = "The pressure rises until this time; the top moves from this time to the end of the test.";
            return Err(wrong("confinement_s", confinement_s, problem, help));
        }
        Ok(())
    }

    fn conditions(&self, setting: &TestSetting) -> ConditionsCase {
        let (begins_s, ends_s) = (self.confinement_s, setting.duration_s);
        let moved = prescribed("top", [None, None, Some(-setting.displacement_mm)]);
        let table = TimeTable::Points(vec![[begins_s, 0.0], [ends_s, 1.0]]);
        let confining = PressureCase {
            surface: "side".to_owned(),
            pressure_mpa: self.pressure_mpa,
            kind: self.pressure,
            table: Some(TimeTable::Points(vec![[begins_s, 1.0]])),
        };
        let measure = MeasureCase { surface: "top".to_owned(), direction: [0.0, 0.0, -1.0] };
        ConditionsCase {
            prescribe: vec![
                prescribed("bottom", [None, None, Some(0.0)]),
                PrescribeCase { table: Some(table), ..moved },
            ],
            pressure: vec![confining],
            remove_rigid_motions: true,
            ..ConditionsCase::of_kind(measure, Similarity::Axial)
        }
    }
}
