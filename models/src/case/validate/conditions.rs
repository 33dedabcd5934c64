//! Checks of `[conditions]`.

use super::super::{CaseFile, ConditionsCase, ExtensometerCase, LineCase, TimeTable, Toe};
use crate::error::{InputError, closest};

/// Surfaces of a cylinder that this program meshes.
pub(super) const OF_CYLINDER: [&str; 3] = ["bottom", "side", "top"];
/// Surfaces of a block, without the surface of its notch.
pub(super) const OF_BLOCK: [&str; 6] = ["left", "right", "front", "back", "bottom", "top"];
/// Relative distance from the surface of a cylinder within which a point counts as inside.
const SAME: f64 = 1e-9;

impl CaseFile {
    pub(super) fn check_conditions(&self, conditions: &ConditionsCase) -> Result<(), InputError> {
        self.check_surfaces(conditions)?;
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
        for (name, LineCase { from_mm, to_mm }) in &conditions.lines {
            let help = "The line connects nodes of the mesh.";
            for (end, position) in [("from_mm", from_mm), ("to_mm", to_mm)] {
                let key = format!("conditions.lines.{name}.{end}");
                position.iter().try_for_each(|&x| self.within(&key, x, -1e6, 1e6, "mm", help))?;
            }
            if from_mm == to_mm {
                let key = format!("conditions.lines.{name}.to_mm");
                let help = "Give the two ends of the line.";
                return Err(self.error(
                    &key,
                    format!("{to_mm:?}"),
                    "is the same point as from_mm",
                    help,
                ));
            }
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
            self.check_gauge_points(*from_mm, *to_mm)?;
            if from_mm == to_mm {
                let help = "Give two different gauge points; the displacement of to_mm relative to from_mm is measured.";
                let value = format!("{to_mm:?}");
                let problem = "is the same point as from_mm";
                return Err(self.error("conditions.extensometer.to_mm", value, problem, help));
            }
        }
        conditions.tables().iter().try_for_each(|(key, table)| self.check_table(key, table))?;
        self.check_confined_toe(conditions)
    }

    /// Refuses the correction of a soft start if loads act before the displacement begins.
    pub(super) fn check_confined_toe(&self, conditions: &ConditionsCase) -> Result<(), InputError> {
        let corrects = self.case.experiments.as_ref().is_some_and(|all| all.toe == Toe::Correct);
        if corrects && conditions.confined_s(self.case.test.duration_s()).is_some() {
            let problem = "cannot be combined with loads that act before the displacement begins";
            let help = "The body is loaded at the displacement zero: write toe = \"report\".";
            return Err(self.error("experiments.toe", "correct", problem, help));
        }
        Ok(())
    }

    /// Checks that the specimen has the surfaces of the conditions.
    fn check_surfaces(&self, conditions: &ConditionsCase) -> Result<(), InputError> {
        let specimen = &self.case.specimen;
        let names: Vec<&str> = match (&specimen.mesh, specimen.block_mm, specimen.notch) {
            (Some(_), ..) => specimen.surfaces.keys().map(String::as_str).collect(),
            (None, Some(_), None) => OF_BLOCK.to_vec(),
            (None, Some(_), Some(_)) => [&OF_BLOCK[..], &["notch"]].concat(),
            (None, None, _) => OF_CYLINDER.to_vec(),
        };
        let lines: Vec<&str> = conditions.lines.keys().map(String::as_str).collect();
        if let Some(line) = lines.iter().find(|line| names.contains(line)) {
            let help = "Give the line another name.";
            let key = format!("conditions.lines.{line}");
            return Err(self.error(&key, "", "is the name of a surface of the specimen", help));
        }
        let prescribed = conditions.prescribe.iter().map(|p| ("prescribe", &p.surface));
        let symmetry = conditions.symmetry.iter().map(|surface| ("symmetry", surface));
        let tractions = conditions.traction.iter().map(|t| ("traction", &t.surface));
        let pressures = conditions.pressure.iter().map(|p| ("pressure", &p.surface));
        let measured = std::iter::once(("measure.surface", &conditions.measure.surface));
        let mut all = prescribed.chain(symmetry).chain(tractions).chain(pressures).chain(measured);
        let is_known = |key: &str, name: &str| {
            let on_line = ["prescribe", "measure.surface"].contains(&key) && lines.contains(&name);
            names.contains(&name) || on_line
        };
        let Some((key, surface)) = all.find(|(key, surface)| !is_known(key, surface)) else {
            return Ok(());
        };
        let hint = closest(surface, names.iter().copied());
        let hint = hint.map(|name| format!("Did you mean {name:?}? ")).unwrap_or_default();
        let help = match (specimen.mesh.is_some(), names.is_empty()) {
            (false, _) if specimen.block_mm.is_some() => {
                format!("{hint}The block has the surfaces {}.", names.join(", "))
            }
            (false, _) => format!("{hint}A cylinder has the surfaces {}.", names.join(", ")),
            (true, true) => {
                "Name the mesh's physical surfaces: specimen.surfaces = { bottom = 11 }.".to_owned()
            }
            (true, false) => format!(
                "{hint}specimen.surfaces names {}: add it there with its physical group.",
                names.join(", ")
            ),
        };
        let key = format!("conditions.{key}");
        Err(self.error(&key, surface.clone(), "is not a surface of the specimen", help))
    }

    /// Checks that the gauge points are inside the cylinder of the case. Points in a mesh file or in an image are checked
    /// when the mesh is known.
    fn check_gauge_points(&self, from_mm: [f64; 3], to_mm: [f64; 3]) -> Result<(), InputError> {
        let specimen = &self.case.specimen;
        let is_packing =
            specimen.mesh.is_none() && specimen.image.is_none() && specimen.stl.is_none();
        let (Some(radius_mm), Some(height_mm), true) =
            (specimen.radius_mm, specimen.height_mm, is_packing)
        else {
            return Ok(());
        };
        let is_inside = |[x, y, z]: [f64; 3]| {
            x.hypot(y) <= radius_mm * (1.0 + SAME)
                && (-SAME..=1.0 + SAME).contains(&(z / height_mm))
        };
        for (name, point) in [("from_mm", from_mm), ("to_mm", to_mm)] {
            if !is_inside(point) {
                let help = format!(
                    "The cylinder stands on z = 0: its axis is z, its radius {radius_mm} mm and its height {height_mm} mm."
                );
                let (key, value) =
                    (format!("conditions.extensometer.{name}"), format!("{point:?}"));
                return Err(self.error(&key, value, "lies outside the specimen", help));
            }
        }
        Ok(())
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
