//! Checks of `[conditions]`.

use super::super::{CaseFile, ConditionsCase, ExtensometerCase, TimeTable};
use crate::error::InputError;

impl CaseFile {
    pub(super) fn check_conditions(&self, conditions: &ConditionsCase) -> Result<(), InputError> {
        let finite = |key: String, values: &[f64], unit: &str| {
            let help = "It is the value at the end of the test.";
            values.iter().try_for_each(|&value| self.within(&key, value, -1e6, 1e6, unit, help))
        };
        for entry in &conditions.prescribe {
            let key = |name: &str| format!("conditions.prescribe ({}).{name}", entry.surface);
            let given = entry.components();
            for (name, value) in ["x_mm", "y_mm", "z_mm"].into_iter().zip(given) {
                finite(key(name), value.as_slice(), "mm")?;
            }
            if let Some(damage) = entry.damage {
                let help = "1 is a crack, 0 sound material.";
                self.within(&key("damage"), damage, 0.0, 1.0, "", help)?;
            } else if given == [None; 3] {
                return Err(self.error(
                    &format!("conditions.prescribe ({})", entry.surface),
                    "",
                    "prescribes no value",
                    "Give x_mm, y_mm, z_mm or damage; 0.0 holds a component.",
                ));
            }
        }
        for pressure in &conditions.pressure {
            let key = format!("conditions.pressure ({}).pressure_mpa", pressure.surface);
            finite(key, &[pressure.pressure_mpa], "MPa")?;
        }
        for traction in &conditions.traction {
            let key = format!("conditions.traction ({}).vector_mpa", traction.surface);
            finite(key, &traction.vector_mpa, "MPa")?;
        }
        if let Some(force) = conditions.body_force_n_per_mm3 {
            finite("conditions.body_force_n_per_mm3".into(), &force, "N/mm³")?;
        }
        finite("conditions.measure.direction".into(), &conditions.measure.direction, "")?;
        if let Some(ExtensometerCase { from_mm, to_mm }) = &conditions.extensometer {
            for (name, position) in [("from_mm", from_mm), ("to_mm", to_mm)] {
                let help = "It is a reference position inside the body.";
                for &x in position {
                    let key = format!("conditions.extensometer.{name}");
                    self.within(&key, x, -1e6, 1e6, "mm", help)?;
                }
            }
            if from_mm == to_mm {
                let help = "Give two different gauge points; the displacement of to_mm relative to from_mm is measured.";
                let value = format!("{to_mm:?}");
                let problem = "is the same point as from_mm";
                return Err(self.error("conditions.extensometer.to_mm", value, problem, help));
            }
        }
        conditions.tables().iter().try_for_each(|(key, table)| self.check_table(key, table))
    }

    /// Checks a table of times and factors.
    fn check_table(&self, key: &str, table: &TimeTable) -> Result<(), InputError> {
        let TimeTable::Points(points) = table else {
            // another error reports the file that could not be read
            return Ok(());
        };
        let help = "List times and factors in the order of time: table = [[1.0, 1.0], [5.0, 1.0]].";
        if points.is_empty() {
            return Err(self.error(key, "", "has no points", help));
        }
        let mut before_s = None;
        for &[time_s, factor] in points {
            let is_later = before_s.is_none_or(|before_s| time_s > before_s);
            if !(is_later && time_s >= 0.0 && time_s.is_finite()) {
                let problem = "times must increase from point to point and begin at 0 s or later";
                return Err(self.error(key, format!("{time_s} s"), problem, help));
            }
            if !(factor.is_finite() && factor.abs() <= 1e6) {
                return Err(self.error(key, factor.to_string(), "is no factor up to 1e6", help));
            }
            before_s = Some(time_s);
        }
        Ok(())
    }
}
