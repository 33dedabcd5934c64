//! Boundary conditions of a body that is not compressed between platens.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use fem::{Axis, Conditions, NodeSet};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::InputError;
use crate::table::CsvTable;

/// `[conditions]`: boundary conditions on named surfaces, instead of platens. Displacements and loads grow in proportion
/// to the time up to their values at the end of the test, or follow a table of times and factors.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConditionsCase {
    /// Lines by name. An entry of `prescribe` and `measure` accept the name of a line like the name of a surface.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub lines: BTreeMap<String, LineCase>,
    /// Surfaces with prescribed displacement or damage.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub prescribe: Vec<PrescribeCase>,
    /// Plane surfaces normal to an axis whose nodes stay in the plane.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub symmetry: Vec<String>,
    /// Surfaces with a dead load.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub traction: Vec<TractionCase>,
    /// Surfaces with a pressure.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pressure: Vec<PressureCase>,
    /// Force per reference volume in N/mm³.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub body_force_n_per_mm3: Option<[f64; 3]>,
    /// Whether to fix single nodes so that the remaining rigid motions are prevented. The loads must balance along
    /// these motions.
    #[serde(default)]
    pub remove_rigid_motions: bool,
    /// Factors of all displacements and loads without their own table, as a function of time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<TimeTable>,
    /// Surface and direction for which the curve of force and displacement is recorded.
    pub measure: MeasureCase,
    /// Two points of the body between which the displacement of the curve is measured, along `measure.direction`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub extensometer: Option<ExtensometerCase>,
    /// How specimens of other sizes compare with the mesh, if `test.kind` implies these conditions; `None` for conditions
    /// that the user wrote.
    #[serde(skip)]
    pub similarity: Option<Similarity>,
}

/// An entry of `conditions.lines`: a straight line through nodes of the mesh, such as a line support.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LineCase {
    /// First end of the line in mm.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub from_mm: [f64; 3],
    /// Second end of the line in mm.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub to_mm: [f64; 3],
}

/// Sizes that scale a measured curve to the size of the mesh, at equal nominal strain and stress.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Similarity {
    /// Displacement by the height, force by the cross-section.
    Axial,
    /// Displacement by the diameter, force by diameter times thickness, as the tensile stress 2 P/(π D t) of a disc.
    Diametral,
    /// Specimens have the size of the mesh.
    Equal,
}

/// Factors by which a displacement or load is multiplied, as a function of time: the points (s, factor), or the name of a
/// CSV file with the columns `time_s` and `factor`. A case that has been read contains the points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum TimeTable {
    /// Times in s and factors, in the order of time. The factor is linear between the points, begins with 0 at 0 s unless
    /// the first point lies at 0 s, and is constant after the last point.
    Points(Vec<[f64; 2]>),
    /// A CSV file.
    File(PathBuf),
}

/// An entry of `conditions.pressure`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PressureCase {
    /// The surface.
    pub surface: String,
    /// Pressure on the surface in MPa at the end.
    #[schemars(range(min = -1e6, max = 1e6))]
    pub pressure_mpa: f64,
    /// Direction and area of the pressure.
    #[serde(default)]
    pub kind: PressureKind,
    /// Factors as a function of time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<TimeTable>,
}

/// Direction and area of a pressure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PressureKind {
    /// Normal to the deformed surface, per deformed area: the pressure of a fluid.
    #[default]
    Follower,
    /// Normal to the reference surface, per reference area: a dead load.
    Dead,
}

/// `conditions.extensometer`: gauge points of an extensometer. Reference positions inside the body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExtensometerCase {
    /// First gauge point in mm.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub from_mm: [f64; 3],
    /// Second gauge point in mm. Its displacement relative to the first point is measured.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub to_mm: [f64; 3],
}

/// An entry of `conditions.prescribe`. Components without a value remain free.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrescribeCase {
    /// The surface.
    pub surface: String,
    /// Displacement along x in mm at the end of the test.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -1e6, max = 1e6))]
    pub x_mm: Option<f64>,
    /// Displacement along y in mm at the end of the test.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -1e6, max = 1e6))]
    pub y_mm: Option<f64>,
    /// Displacement along z in mm at the end of the test.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -1e6, max = 1e6))]
    pub z_mm: Option<f64>,
    /// Damage, constant during the test.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1))]
    pub damage: Option<f64>,
    /// Factors of the displacement as a function of time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<TimeTable>,
}

/// An entry of `conditions.traction`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TractionCase {
    /// The surface.
    pub surface: String,
    /// Force per reference area in MPa at the end.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub vector_mpa: [f64; 3],
    /// Factors as a function of time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub table: Option<TimeTable>,
}

/// `conditions.measure`: force and mean displacement of a surface along a direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeasureCase {
    /// The surface.
    pub surface: String,
    /// The direction: a vector of any length.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub direction: [f64; 3],
}

impl PrescribeCase {
    /// Prescribed displacement along each axis in mm; `None` for a free component.
    pub(super) fn components(&self) -> [Option<f64>; 3] {
        [self.x_mm, self.y_mm, self.z_mm]
    }
}

impl TimeTable {
    /// Returns the points; none for a file that has not been read.
    pub(super) fn points(&self) -> &[[f64; 2]] {
        match self {
            Self::Points(points) => points,
            Self::File(_) => &[],
        }
    }

    /// Replaces the name of a file by its points. A relative path refers to `folder`.
    ///
    /// # Errors
    /// Problem and help, if the file cannot be read.
    fn read(&mut self, folder: &Path) -> Result<(), InputError> {
        let Self::File(file) = self else { return Ok(()) };
        let [time, factor] = ["time_s", "factor"];
        let path = folder.join(&*file);
        let table = CsvTable::read(&path, &[time, factor])?;
        let points = table.rows().map(|row| Ok([row.number(time)?, row.number(factor)?]));
        *self = Self::Points(points.collect::<Result<_, InputError>>()?);
        Ok(())
    }

    /// Time in s up to which the factor is zero.
    fn rests_s(&self) -> f64 {
        let resting = self.points().iter().take_while(|[_, factor]| *factor == 0.0);
        resting.last().map_or(0.0, |[time_s, _]| *time_s)
    }

    /// Factor at a time in s.
    fn at(&self, time_s: f64) -> f64 {
        let points = self.points();
        let after = points.partition_point(|point| point[0] < time_s);
        let before = match after.checked_sub(1) {
            Some(before) => points[before],
            None => [0.0, 0.0],
        };
        match points.get(after) {
            None => before[1],
            // without a point at 0 s, the factor begins with 0
            Some(&[end_s, end]) => {
                let part = (time_s - before[0]) / (end_s - before[0]);
                if part < 1.0 { before[1] + part * (end - before[1]) } else { end }
            }
        }
    }
}

/// Factor of a displacement or load as a function of time.
#[derive(Clone)]
struct Growth {
    table: Option<TimeTable>,
    duration_s: f64,
}

impl Growth {
    fn vector(&self, full: [f64; 3], time_s: f64) -> [f64; 3] {
        full.map(|full| self.scalar(full, time_s))
    }

    fn scalar(&self, full: f64, time_s: f64) -> f64 {
        match &self.table {
            Some(table) => table.at(time_s) * full,
            // this order of operations gives exactly the full value at the end of the test
            None => time_s / self.duration_s * full,
        }
    }
}

impl ConditionsCase {
    /// Conditions of a kind of test, which has measured force and displacement but no supports and loads yet.
    pub(super) fn of_kind(measure: MeasureCase, similarity: Similarity) -> Self {
        Self {
            lines: BTreeMap::new(),
            prescribe: Vec::new(),
            symmetry: Vec::new(),
            traction: Vec::new(),
            pressure: Vec::new(),
            body_force_n_per_mm3: None,
            remove_rigid_motions: false,
            table: None,
            measure,
            extensometer: None,
            similarity: Some(similarity),
        }
    }

    /// Whether a case file contains these conditions; false if `test.kind` implies them.
    pub(super) fn is_written(&self) -> bool {
        self.similarity.is_none()
    }

    /// Returns the tables of all entries with their keys.
    pub(super) fn tables(&self) -> Vec<(String, &TimeTable)> {
        let named = |list: &str, surface: &str| format!("conditions.{list} ({surface}).table");
        let prescribed = self.prescribe.iter();
        let prescribed = prescribed.map(|p| (named("prescribe", &p.surface), p.table.as_ref()));
        let tractions = self.traction.iter();
        let tractions = tractions.map(|t| (named("traction", &t.surface), t.table.as_ref()));
        let pressures = self.pressure.iter();
        let pressures = pressures.map(|p| (named("pressure", &p.surface), p.table.as_ref()));
        let common = std::iter::once(("conditions.table".to_owned(), self.table.as_ref()));
        let all = prescribed.chain(tractions).chain(pressures).chain(common);
        all.filter_map(|(key, table)| Some((key, table?))).collect()
    }

    /// Replaces the names of files by the points in the files. Relative paths refer to `folder`.
    ///
    /// Returns the key and the path of each file, and an error if the file cannot be read.
    pub(super) fn read_tables(
        &mut self,
        folder: &Path,
    ) -> Vec<(String, PathBuf, Result<(), InputError>)> {
        let keys: Vec<String> = self.tables().into_iter().map(|(key, _)| key).collect();
        let prescribed = self.prescribe.iter_mut().filter_map(|p| p.table.as_mut());
        let tractions = self.traction.iter_mut().filter_map(|t| t.table.as_mut());
        let pressures = self.pressure.iter_mut().filter_map(|p| p.table.as_mut());
        let all = prescribed.chain(tractions).chain(pressures).chain(self.table.as_mut());
        let read = |(key, table): (String, &mut TimeTable)| {
            let TimeTable::File(file) = table else { return None };
            let path = folder.join(&*file);
            Some((key, path, table.read(folder)))
        };
        keys.into_iter().zip(all).filter_map(read).collect()
    }

    /// Times in s, inside the duration of the test, at which the rate of a displacement or load changes.
    pub(crate) fn corners_s(&self, duration_s: f64) -> Vec<f64> {
        let tables = self.tables();
        let times = tables.iter().flat_map(|(_, table)| table.points()).map(|point| point[0]);
        let inside = |time_s: &f64| *time_s > 0.0 && *time_s < duration_s;
        let mut corners: Vec<f64> = times.filter(inside).collect();
        corners.sort_by(f64::total_cmp);
        // times that differ by a rounding error are one corner
        corners.dedup_by(|a, b| *a - *b <= 1e-9 * duration_s);
        corners
    }

    /// Time in s for which loads act on the body before the measured displacement begins, as in triaxial compression; `None`
    /// if the displacement begins at once, is never prescribed, or is measured by an extensometer.
    pub(crate) fn confined_s(&self, duration_s: f64) -> Option<f64> {
        let is_loaded = !self.pressure.is_empty()
            || !self.traction.is_empty()
            || self.body_force_n_per_mm3.is_some();
        if !is_loaded || self.extensometer.is_some() {
            return None;
        }
        let MeasureCase { surface, direction } = &self.measure;
        let entries = || self.prescribe.iter().filter(move |entry| entry.surface == *surface);
        // the time at which each measured component begins to move
        let mut begins_s = f64::INFINITY;
        for axis in (0..3).filter(|&axis| direction[axis] != 0.0) {
            let prescribed = entries().find_map(|entry| Some((entry, entry.components()[axis]?)));
            let (entry, value) = prescribed?;
            if value != 0.0 {
                let table = entry.table.as_ref().or(self.table.as_ref());
                begins_s = begins_s.min(table.map_or(0.0, TimeTable::rests_s));
            }
        }
        (begins_s > 0.0 && begins_s < duration_s).then_some(begins_s)
    }

    /// Converts to the conditions of `fem` for a test of the given duration in seconds.
    pub(crate) fn in_fem(&self, duration_s: f64) -> Conditions {
        let growth = |table: &Option<TimeTable>| {
            let table = table.as_ref().or(self.table.as_ref()).cloned();
            Growth { table, duration_s }
        };
        let mut all = Conditions::new().described_as(format!("{self:?} in {duration_s} s"));
        for (name, LineCase { from_mm, to_mm }) in &self.lines {
            all = all.node_set(name, NodeSet::segment(*from_mm, *to_mm));
        }
        for entry in &self.prescribe {
            let components = entry.components();
            let axes = Axis::ALL.into_iter().filter(|&axis| components[axis as usize].is_some());
            let (full, grown) = (components.map(|c| c.unwrap_or(0.0)), growth(&entry.table));
            all = all.prescribe(&entry.surface, axes, move |_, time_s| grown.vector(full, time_s));
            if let Some(damage) = entry.damage {
                all = all.prescribe_damage(&entry.surface, move |_, _| damage);
            }
        }
        for surface in &self.symmetry {
            all = all.symmetry(surface);
        }
        for TractionCase { surface, vector_mpa, table } in &self.traction {
            let (full, grown) = (*vector_mpa, growth(table));
            all = all.traction(surface, move |_, time_s| grown.vector(full, time_s));
        }
        for PressureCase { surface, pressure_mpa, kind, table } in &self.pressure {
            let (full, grown) = (*pressure_mpa, growth(table));
            let pressure = move |_, time_s| grown.scalar(full, time_s);
            all = match kind {
                PressureKind::Follower => all.follower_pressure(surface, pressure),
                PressureKind::Dead => all.pressure(surface, pressure),
            };
        }
        if let Some(full) = self.body_force_n_per_mm3 {
            let grown = growth(&None);
            all = all.body_force(move |_, time_s| grown.vector(full, time_s));
        }
        if self.remove_rigid_motions {
            all = all.remove_rigid_motions();
        }
        let MeasureCase { surface, direction } = &self.measure;
        match self.extensometer {
            Some(ExtensometerCase { from_mm, to_mm }) => {
                all.measure_between(surface, *direction, [from_mm, to_mm])
            }
            None => all.measure(surface, *direction),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIAXIAL: &str = r#"
        pressure = [{ surface = "side", pressure_mpa = 0.5, table = [[1.0, 1.0]] }]
        prescribe = [
            { surface = "bottom", z_mm = 0.0 },
            { surface = "top", z_mm = -0.3, table = [[1.0, 0.0], [10.0, 1.0]] },
        ]
        measure = { surface = "top", direction = [0.0, 0.0, -1.0] }
    "#;

    #[test]
    fn a_displacement_that_begins_after_the_loads_has_a_confinement() {
        let confined = |from: &str, to: &str| {
            assert!(TRIAXIAL.contains(from), "{from}");
            let text = TRIAXIAL.replacen(from, to, 1);
            toml::from_str::<ConditionsCase>(&text).unwrap().confined_s(10.0)
        };
        assert_eq!(confined("", ""), Some(1.0));
        // there is no confinement if the displacement begins at the start, if there is no load, if the measured
        // component is not prescribed, or if an extensometer measures the displacement
        assert_eq!(confined("[[1.0, 0.0], [10.0, 1.0]]", "[[10.0, 1.0]]"), None);
        assert_eq!(
            confined(
                "pressure = [{ surface = \"side\", pressure_mpa = 0.5, table = [[1.0, 1.0]] }]",
                ""
            ),
            None
        );
        assert_eq!(confined("z_mm = -0.3", "x_mm = -0.3"), None);
        let gauge = "extensometer = { from_mm = [0, 0, 1], to_mm = [0, 0, 3] }\nmeasure";
        assert_eq!(confined("measure", gauge), None);
    }
}
