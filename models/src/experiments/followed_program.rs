//! Comparison of measured curves with the load program of the case.

use std::path::PathBuf;

use fem::{PlatenLoad, ProgramPoint};

use super::mesh_scale::{MeshScale, MeshSize};
use super::specimen_notes::Notes;
use crate::case::TestCase;
use crate::error::InputError;
use crate::experiment::SpecimenTable;

/// Difference between the displacements (or forces) of a curve and of the program, as a fraction of the largest
/// displacement (or force), above which a warning is reported.
const NOTICEABLE: f64 = 0.05;
/// Difference above which the curve is rejected: the case simulates another test.
const ANOTHER_TEST: f64 = 0.25;

/// Compares each curve with the load program, scaled to the size of the specimen: the displacement at the points with a
/// displacement, and the force at the points with a force. Returns an error for each curve that follows another program.
/// A curve that ends early is compared at the points that it reaches.
pub(crate) fn check_programs(
    test: &TestCase,
    table: &SpecimenTable,
    mesh: MeshSize,
    curve: &dyn Fn(&str) -> PathBuf,
    notes: &mut Notes,
) -> Vec<InputError> {
    let Ok(Some(program)) = test.load_program() else { return Vec::new() };
    let largest_n = program.points().iter().filter_map(ProgramPoint::force_n).fold(0.0, f64::max);
    let mut mistakes = Vec::new();
    for specimen in &table.specimens {
        let scale = MeshScale::of(specimen, Some(mesh));
        let differences = program.points().iter().filter_map(|point| {
            let stated = match point.load {
                PlatenLoad::Displacement(mm) => Stated {
                    name: "displacement",
                    unit: "mm",
                    value: mm / scale.displacement,
                    largest: program.largest_mm() / scale.displacement,
                },
                PlatenLoad::Force(force_n) => Stated {
                    name: "force",
                    unit: "N",
                    value: force_n / scale.force,
                    largest: largest_n / scale.force,
                },
            };
            let values = match point.load {
                PlatenLoad::Displacement(_) => &specimen.curve.displacement_mm,
                PlatenLoad::Force(_) => &specimen.curve.force_n,
            };
            let measured = value_at(&specimen.curve.time_s, values, point.time_s)?;
            // a program that unloads to zero states no size for comparison: use the largest measured value
            let largest = values.iter().fold(stated.largest, |largest, x| largest.max(x.abs()));
            (largest > 0.0).then_some((point.time_s, measured, Stated { largest, ..stated }))
        });
        let part = |(_, measured, stated): &(f64, f64, Stated)| {
            (measured - stated.value).abs() / stated.largest
        };
        let Some(worst) = differences.max_by(|a, b| part(a).total_cmp(&part(b))) else { continue };
        let (time_s, measured, Stated { name, unit, value, .. }) = &worst;
        let size = if *unit == "mm" { "height" } else { "cross-section" };
        let problem = format!(
            "has a {name} of {measured:.4} {unit} at {time_s} s after its first reading, and test.program states \
             {value:.4} {unit} at the {size} of the specimen"
        );
        let help = "Write the program of this test into the case, or remove the readings before its start.";
        if part(&worst) > ANOTHER_TEST {
            let file = curve(&specimen.id);
            mistakes.push(InputError::new(&file, "column time_s", "", problem, help));
        } else if part(&worst) > NOTICEABLE {
            notes.warn("program", format!("{} {problem}. {help}", specimen.id));
            notes.list(&specimen.id, "program", measured - value, format!("{problem}. {help}"));
        }
    }
    mistakes
}

/// Value that a load program states for a specimen.
struct Stated {
    name: &'static str,
    unit: &'static str,
    value: f64,
    /// Largest value of the same kind in the program and in the curve.
    largest: f64,
}

/// Value at a time (s) after the first reading, linear between readings; `None` if the curve has no times or ends
/// earlier.
fn value_at(times: &[f64], values: &[f64], time_s: f64) -> Option<f64> {
    let start_s = *times.first()?;
    let time_s = start_s + time_s;
    // the last reading of a test may precede the end of the program by a rounding error
    let last_s = *times.last()?;
    let time_s = if time_s <= last_s * (1.0 + 1e-9) { time_s.min(last_s) } else { return None };
    let after = times.partition_point(|t| *t < time_s).clamp(1, times.len() - 1);
    let (from, to) = (times[after - 1], times[after]);
    let part = if to > from { (time_s - from) / (to - from) } else { 1.0 };
    Some(values[after - 1] + part * (values[after] - values[after - 1]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{Case, CaseFile, ProgramPointCase};
    use crate::experiment::{Specimen, TestCurve};

    fn specimen(id: &str, hold_mm: f64, start_s: f64) -> Specimen {
        let time_s: Vec<f64> = (0..=40).map(|i| start_s + 0.05 * f64::from(i)).collect();
        let displacement_mm =
            time_s.iter().map(|t| hold_mm * ((t - start_s) / 0.5).min(1.0)).collect();
        let curve = TestCurve { time_s, ..TestCurve::new(displacement_mm, vec![1.0; 41]) };
        Specimen {
            id: id.into(),
            height_mm: 8.8,
            radius_mm: 2.5,
            group: String::new(),
            test: None,
            slope_fraction: None,
            image: None,
            rate_mm_per_s: None,
            curve,
        }
    }

    #[test]
    fn curves_of_another_program_are_rejected_and_small_differences_warned_of() {
        let case = CaseFile::parse(Case::TEMPLATE, "case.toml".as_ref()).unwrap().case;
        let point = |time_s, displacement_mm| ProgramPointCase {
            time_s,
            displacement_mm: Some(displacement_mm),
            force_n: None,
            steps: None,
        };
        let program = Some(vec![point(0.5, 0.1), point(2.0, 0.1)]);
        let test = TestCase { program, displacement_mm: None, duration_s: None, ..case.test };
        let specimens = vec![
            // the specimens are twice as high as the mesh
            specimen("same", 0.2, 3.0),
            specimen("near", 0.22, 0.0),
            specimen("other", 0.1, 0.0),
        ];
        let mut notes = Notes::default();
        let curve = |id: &str| PathBuf::from(format!("curves/{id}.csv"));
        let table = SpecimenTable { specimens };
        let mesh = MeshSize::of_cylinder([4.4, 2.5]);
        let mistakes = check_programs(&test, &table, mesh, &curve, &mut notes);
        assert_eq!(mistakes.len(), 1, "{mistakes:?}");
        let message = mistakes[0].to_string();
        for part in ["other.csv", "0.1000 mm at 2 s", "states 0.2000 mm"] {
            assert!(message.contains(part), "{part:?} is not in {message:?}");
        }
        assert!(matches!(notes.warnings(), [only] if only.starts_with("near has")));
        // a program that unloads to zero; the difference is compared with the largest force of the curve
        let unloaded = ProgramPointCase {
            time_s: 2.0,
            displacement_mm: None,
            force_n: Some(0.0),
            steps: None,
        };
        let program = Some(vec![point(0.5, 0.1), unloaded]);
        let to_zero = TestCase { program, displacement_mm: None, duration_s: None, ..test.clone() };
        let mut near_zero = specimen("near zero", 0.2, 0.0);
        near_zero.curve.force_n[40] = 0.01;
        let table_of_one = SpecimenTable { specimens: vec![near_zero] };
        let mut silent = Notes::default();
        let mistakes = check_programs(&to_zero, &table_of_one, mesh, &curve, &mut silent);
        assert!(mistakes.is_empty() && silent.warnings().is_empty(), "{mistakes:?}");
        let straight = TestCase { program: None, ..test };
        assert!(check_programs(&straight, &table, mesh, &curve, &mut notes).is_empty());
    }
}
