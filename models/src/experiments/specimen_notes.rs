//! Notes and warnings about the specimens before any simulation: sizes that differ from the mesh, and the rate of the
//! tests. At most five lines of each kind are printed; `curve_checks.csv` lists all lines.

use std::collections::BTreeMap;
use std::path::PathBuf;

use super::mesh_scale::{MeasuredOver, MeshScale, MeshSize};
use crate::case::{MachineCase, TestCase};
use crate::error::InputError;
use crate::experiment::{Specimen, SpecimenTable};

/// Largest number of printed lines of one kind.
const EXAMPLES: usize = 5;
/// Relative difference of the radii up to which a specimen is comparable with the mesh after scaling the forces to
/// equal stress. With a larger difference, the ratio of height to radius and the sizes of grains and cracks relative to
/// the radius also differ noticeably.
const RADIUS: f64 = 0.02;
/// Relative difference of the radii above which a warning reports that forces are not scaled.
const UNSCALED: f64 = 1e-3;
/// Relative difference between the strain rates of a test and of the case above which the test is rejected. The
/// calibrated viscosity would have the same relative error.
const RATE: f64 = 0.05;

/// Collected lines for the screen, warnings, and rows of `curve_checks.csv`.
#[derive(Default)]
pub(crate) struct Notes {
    said: BTreeMap<&'static str, usize>,
    lines: Vec<String>,
    warnings: Vec<String>,
    rows: Vec<[String; 4]>,
}

impl Notes {
    /// Adds a line for the screen, unless there are already five lines of this kind.
    pub(crate) fn say(&mut self, kind: &'static str, line: &str) {
        if self.is_shown(kind) {
            self.lines.push(line.to_owned());
        }
    }

    /// Adds a warning, unless there are already five warnings of this kind.
    pub(crate) fn warn(&mut self, kind: &'static str, line: String) {
        if self.is_shown(kind) {
            self.warnings.push(line);
        }
    }

    fn is_shown(&mut self, kind: &'static str) -> bool {
        let said = self.said.entry(kind).or_default();
        *said += 1;
        *said <= EXAMPLES
    }

    /// Adds a row to `curve_checks.csv`.
    pub(crate) fn list(&mut self, id: &str, kind: &str, value: f64, text: String) {
        let number = if value.is_nan() { String::new() } else { value.to_string() };
        self.rows.push([id.to_owned(), kind.to_owned(), number, text]);
    }

    /// Adds a line with the number of omitted lines for each kind.
    pub(crate) fn say_what_was_left_out(&mut self) {
        for (kind, said) in self.said.iter().filter(|(_, said)| **said > EXAMPLES) {
            let further = said - EXAMPLES;
            self.lines.push(format!("{further} further findings of {kind}: see curve_checks.csv"));
        }
    }

    /// Warnings, which are shown together with the results.
    pub(crate) fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The lines for the screen.
    pub(crate) fn lines(&self) -> &[String] {
        &self.lines
    }

    pub(crate) fn into_rows(self) -> Vec<[String; 4]> {
        self.rows
    }
}

/// Adds a note for each specimen whose displacements are scaled because its height differs from the mesh, or whose
/// forces are scaled because its radius differs.
pub(crate) fn note_sizes(table: &SpecimenTable, mesh: MeshSize, notes: &mut Notes) {
    for specimen in &table.specimens {
        let scale = MeshScale::of(specimen, Some(mesh));
        if scale.displacement != 1.0 && mesh.measured_over == MeasuredOver::Diameter {
            let text = format!(
                "has a radius of {} mm, the mesh {:.4} mm: its displacements are scaled by {:.4}",
                specimen.radius_mm, mesh.radius_mm, scale.displacement
            );
            notes.say("height", &format!("{} {text}", specimen.id));
        } else if scale.displacement != 1.0 {
            let text = format!(
                "is {} mm high, the mesh {:.4} mm: its displacements are scaled by {:.4}",
                specimen.height_mm, mesh.height_mm, scale.displacement
            );
            notes.say("height", &format!("{} {text}", specimen.id));
        }
        let is_other_height = (specimen.height_mm / mesh.height_mm - 1.0).abs() > UNSCALED;
        if mesh.measured_over == MeasuredOver::FixedLength && is_other_height {
            let text = format!(
                "is {} mm high, the mesh {:.4} mm: its displacements are not scaled, because they are measured over a length that                  the case states (conditions.extensometer, conditions.measure, test.kind). Mesh a specimen of this height                  (specimen.height_mm) if the measured region is not far from its ends",
                specimen.height_mm, mesh.height_mm
            );
            notes.say("height", &format!("{} {text}", specimen.id));
            notes.list(&specimen.id, "height", specimen.height_mm, text);
        }
        let (specimen_radius_mm, radius_mm) = (specimen.radius_mm, mesh.radius_mm);
        let difference = (specimen_radius_mm / radius_mm - 1.0).abs();
        let text = format!("has a radius of {specimen_radius_mm} mm, the mesh {radius_mm:.4} mm");
        if scale.force != 1.0 {
            let text = format!("{text}: its forces are scaled by {:.4}", scale.force);
            if difference > RADIUS {
                let text = format!(
                    "{text}, but height, grains and cracks are not scaled. Mesh a specimen with the mean radius \
                     (specimen.radius_mm), or correct the table"
                );
                notes.warn("radius", format!("{} {text}", specimen.id));
                notes.list(&specimen.id, "radius", specimen_radius_mm, text);
            } else {
                notes.say("radius", &format!("{} {text}", specimen.id));
                notes.list(&specimen.id, "radius", specimen_radius_mm, text);
            }
        } else if difference > UNSCALED {
            let percent = 100.0 * ((specimen_radius_mm / radius_mm).powi(2) - 1.0);
            let text = format!(
                "{text}: the mesh is not a cylinder, so that forces are not scaled; sections of circles of these radii \
                 differ by {percent:+.2} %. Write the radius of the circle around the mesh into the table if the \
                 specimen has the shape of the mesh"
            );
            notes.warn("radius", format!("{} {text}", specimen.id));
            notes.list(&specimen.id, "radius", specimen_radius_mm, text);
        }
    }
}

/// Notes how compliance and force offset of the machine change the curves. Returns an error for each curve whose
/// displacement the machine would explain completely.
pub(crate) fn check_machine(
    machine: MachineCase,
    table: &SpecimenTable,
    curve: &dyn Fn(&str) -> PathBuf,
    notes: &mut Notes,
) -> Vec<InputError> {
    let machine = machine.machine();
    let mut mistakes = Vec::new();
    if machine.is_ideal() {
        return mistakes;
    }
    for specimen in &table.specimens {
        let record = &specimen.curve;
        let corrected = machine.specimen(record);
        let top = (0..record.force_n.len())
            .max_by(|&a, &b| record.force_n[a].total_cmp(&record.force_n[b]));
        let Some(top) = top else { continue };
        let [before_mm, after_mm] = [record, &corrected].map(|curve| curve.displacement_mm[top]);
        let text = format!(
            "at its largest force, {:.2} N: the machine is compressed by {:.4} mm of {before_mm:.4} mm, and the load \
             cell shows {} N too much; both are subtracted (machine.compliance_mm_per_n, machine.force_offset_n)",
            corrected.force_n[top],
            before_mm - after_mm,
            machine.force_offset_n
        );
        notes.say("machine", &format!("{} {text}", specimen.id));
        notes.list(&specimen.id, "machine", before_mm - after_mm, text);
        if after_mm <= corrected.displacement_mm[0] {
            let problem = format!(
                "explains all but {after_mm:.4} mm of the displacement of {before_mm:.4} mm at the largest force of this curve"
            );
            let value = machine.compliance_mm_per_n.to_string();
            let help = "Write the compliance of the machine in mm/N, without the specimen.";
            let key = "machine.compliance_mm_per_n";
            mistakes.push(InputError::new(&curve(&specimen.id), key, value, problem, help));
        }
    }
    mistakes
}

/// Compares the strain rate of each test with the strain rate of the case, and notes the rate that is assumed for tests
/// without a time column. Returns an error for each test with a different rate.
pub(crate) fn check_rates(
    test: &TestCase,
    table: &SpecimenTable,
    height_mm: f64,
    are_virtual: bool,
    curve: &dyn Fn(&str) -> PathBuf,
    notes: &mut Notes,
) -> Vec<InputError> {
    let Some(displacement_mm) = test.displacement_mm else { return Vec::new() };
    let case = CaseRate { displacement_mm, duration_s: test.duration_s(), height_mm };
    let is_unknown = |specimen: &&Specimen| specimen.rate_mm_per_s.is_none();
    let unknown = table.specimens.iter().filter(is_unknown).count();
    if !are_virtual && unknown > 0 {
        let rate = displacement_mm / test.duration_s();
        let text = format!(
            "no times were read for {unknown} of {} curves, and the table has no rate_mm_per_s for them: they are taken as \
             tests at {rate:.4} mm/s (test.displacement_mm / test.duration_s), and the viscosity is inversely proportional \
             to this speed",
            table.specimens.len()
        );
        notes.say("rate", &text);
        notes.list("all", "rate", rate, text);
    }
    table.specimens.iter().filter_map(|row| case.other_rate(row, curve)).collect()
}

/// The test of the case: displacement, duration, and height of the mesh. The strain rate follows
/// from these three values.
#[derive(Clone, Copy)]
struct CaseRate {
    displacement_mm: f64,
    duration_s: f64,
    height_mm: f64,
}

impl CaseRate {
    /// Returns an error for a test whose strain rate differs from the case by more than 5 %. The rates must agree,
    /// because the curve depends only on the product of viscosity and rate.
    fn other_rate(
        &self,
        specimen: &Specimen,
        curve: &dyn Fn(&str) -> PathBuf,
    ) -> Option<InputError> {
        let rate = specimen.rate_mm_per_s?;
        let case_rate = self.displacement_mm / self.duration_s;
        let scaled = rate * self.height_mm / specimen.height_mm;
        if (case_rate / scaled - 1.0).abs() <= RATE {
            return None;
        }
        let problem = format!(
            "is the speed of its platen in mm/s, {scaled:.3e} mm/s at the height of the mesh; the case has \
             {case_rate:.3e} mm/s (test.displacement_mm / test.duration_s)"
        );
        let help = format!(
            "The viscosity would be wrong by a factor of {:.4}: write duration_s = {:.6} under [test], or correct the \
             time of the curve.",
            scaled / case_rate,
            self.displacement_mm / scaled
        );
        let location = format!("specimen {}, rate", specimen.id);
        let value = format!("{rate:.3e}");
        Some(InputError::new(&curve(&specimen.id), location, value, problem, help))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table(rates: &[Option<f64>]) -> SpecimenTable {
        let specimen = |(i, &rate_mm_per_s): (usize, &Option<f64>)| Specimen {
            id: format!("S-{i}"),
            height_mm: 8.8,
            radius_mm: 2.5,
            group: String::new(),
            slope_fraction: None,
            image: None,
            test: None,
            rate_mm_per_s,
            curve: crate::experiment::TestCurve::default(),
        };
        SpecimenTable { specimens: rates.iter().enumerate().map(specimen).collect() }
    }

    /// A speed of 0.22 mm/s on a height of 4.4 mm and a speed of 0.44 mm/s on a height of 8.8 mm have the same strain
    /// rate.
    #[test]
    fn a_rate_other_than_the_case_s_is_refused_with_the_duration_that_fits() {
        let case = CaseRate { displacement_mm: 0.22, duration_s: 1.0, height_mm: 4.4 };
        let curve = |id: &str| PathBuf::from(format!("curves/{id}.csv"));
        let table = table(&[Some(0.44), Some(0.45), None, Some(0.44 / 264.0)]);
        let mistakes =
            table.specimens.iter().filter_map(|specimen| case.other_rate(specimen, &curve));
        let mistakes: Vec<String> = mistakes.map(|mistake| mistake.to_string()).collect();
        assert_eq!(mistakes.len(), 1, "{mistakes:?}");
        for part in ["curves/S-3.csv", "rate = 1.667e-3", "duration_s = 264.0", "factor of 0.0038"]
        {
            assert!(mistakes[0].contains(part), "{part}: {mistakes:?}");
        }
    }

    #[test]
    fn five_lines_of_a_kind_are_printed_and_all_are_listed() {
        let mut notes = Notes::default();
        note_sizes(&table(&[None; 8]), MeshSize::of_cylinder([8.8, 2.4]), &mut notes);
        assert_eq!(notes.said["radius"], 8);
        assert_eq!(notes.warnings.len(), 5);
        assert!(!notes.said.contains_key("height"));
        let rows = notes.into_rows();
        assert_eq!(rows.len(), 8);
        assert!(rows[0][3].contains("forces are scaled by 0.9216"), "{:?}", rows[0]);
    }

    #[test]
    fn displacements_of_an_extensometer_are_noted_as_not_scaled() {
        let noted = |measured_over: MeasuredOver, height_mm: f64| {
            let mut notes = Notes::default();
            let mesh = MeshSize { measured_over, ..MeshSize::of_cylinder([height_mm, 2.5]) };
            note_sizes(&table(&[None]), mesh, &mut notes);
            notes.lines.join("")
        };
        assert!(noted(MeasuredOver::Height, 4.4).contains("are scaled by 0.5"));
        assert!(noted(MeasuredOver::FixedLength, 4.4).contains("its displacements are not scaled"));
        assert!(noted(MeasuredOver::FixedLength, 8.8).is_empty());
    }

    /// The specimens have a radius of 2.5 mm. Their forces are scaled with a note for a mesh of radius 2.49 mm, and
    /// with a warning for 2.4 mm. For a mesh that is not a cylinder, forces are not scaled, with a warning.
    #[test]
    fn radii_are_noted_or_warned_of() {
        let noted = |mesh: MeshSize| {
            let mut notes = Notes::default();
            note_sizes(&table(&[None]), mesh, &mut notes);
            [notes.lines.join(""), notes.warnings.join("")]
        };
        let [line, warning] = noted(MeshSize::of_cylinder([8.8, 2.5]));
        assert!(line.is_empty() && warning.is_empty(), "{line}{warning}");
        let [line, warning] = noted(MeshSize::of_cylinder([8.8, 2.49]));
        assert!(line.contains("forces are scaled by 0.9920") && warning.is_empty(), "{warning}");
        let [line, warning] = noted(MeshSize::of_cylinder([8.8, 2.4]));
        assert!(line.is_empty() && warning.contains("forces are scaled by 0.9216"), "{warning}");
        let block = MeshSize { is_cylinder: false, ..MeshSize::of_cylinder([8.8, 2.49]) };
        let [line, warning] = noted(block);
        assert!(line.is_empty() && warning.contains("+0.80 %"), "{warning}");
    }
}
