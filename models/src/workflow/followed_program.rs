//! Comparison of measured curves with the load program of the case.

use std::path::PathBuf;

use super::specimen_notes::Notes;
use crate::case::TestCase;
use crate::error::InputError;
use crate::experiment::{Specimen, SpecimenTable};

/// Difference between the displacements of a curve and of the program, as a fraction of the largest displacement, above
/// which a warning is reported.
const NOTICEABLE: f64 = 0.05;
/// Difference above which the curve is rejected: the case simulates another test.
const ANOTHER_TEST: f64 = 0.25;

/// Compares the displacement of each curve at the points of the load program with the program, scaled to the height of
/// the specimen. Returns an error for each curve that follows another program. A curve that ends early is compared at the
/// points that it reaches.
pub(super) fn check_programs(
    test: &TestCase,
    table: &SpecimenTable,
    height_mm: f64,
    curve: &dyn Fn(&str) -> PathBuf,
    notes: &mut Notes,
) -> Vec<InputError> {
    let Ok(Some(program)) = test.load_program() else { return Vec::new() };
    let mut mistakes = Vec::new();
    for specimen in &table.specimens {
        let scale = specimen.height_mm / height_mm;
        let largest_mm = scale * program.largest_mm();
        let differences = program.points().iter().filter_map(|point| {
            let measured_mm = displacement_at(specimen, point.time_s)?;
            Some((point.time_s, measured_mm, scale * point.displacement_mm))
        });
        let part = |(_, measured, stated): &(f64, f64, f64)| (measured - stated).abs() / largest_mm;
        let Some(worst) = differences.max_by(|a, b| part(a).total_cmp(&part(b))) else { continue };
        let (time_s, measured_mm, stated_mm) = worst;
        let problem = format!(
            "has a displacement of {measured_mm:.4} mm at {time_s} s after its first reading, and test.program \
             states {stated_mm:.4} mm at the height of the specimen"
        );
        let help = "Write the program of this test into the case, or remove the readings before its start.";
        if part(&worst) > ANOTHER_TEST {
            let file = curve(&specimen.id);
            mistakes.push(InputError::new(&file, "column time_s", "", problem, help));
        } else if part(&worst) > NOTICEABLE {
            notes.warn("program", format!("{} {problem}. {help}", specimen.id));
            notes.list(
                &specimen.id,
                "program",
                measured_mm - stated_mm,
                format!("{problem}. {help}"),
            );
        }
    }
    mistakes
}

/// Displacement (mm) at a time (s) after the first reading, linear between readings; `None` if the curve has no times or
/// ends earlier.
fn displacement_at(specimen: &Specimen, time_s: f64) -> Option<f64> {
    let (times, u) = (&specimen.curve.time_s, &specimen.curve.displacement_mm);
    let start_s = *times.first()?;
    let time_s = start_s + time_s;
    // the last reading of a test may precede the end of the program by a rounding error
    let last_s = *times.last()?;
    let time_s = if time_s <= last_s * (1.0 + 1e-9) { time_s.min(last_s) } else { return None };
    let after = times.partition_point(|t| *t < time_s).clamp(1, times.len() - 1);
    let (from, to) = (times[after - 1], times[after]);
    let part = if to > from { (time_s - from) / (to - from) } else { 1.0 };
    Some(u[after - 1] + part * (u[after] - u[after - 1]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::ProgramPointCase;
    use crate::case::{Case, CaseFile};
    use crate::experiment::TestCurve;

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
        let mistakes = check_programs(&test, &table, 4.4, &curve, &mut notes);
        assert_eq!(mistakes.len(), 1, "{mistakes:?}");
        let message = mistakes[0].to_string();
        for part in ["other.csv", "0.1000 mm at 2 s", "states 0.2000 mm"] {
            assert!(message.contains(part), "{part:?} is not in {message:?}");
        }
        assert!(matches!(notes.warnings(), [only] if only.starts_with("near has")));
        let straight = TestCase { program: None, ..test };
        assert!(check_programs(&straight, &table, 4.4, &curve, &mut notes).is_empty());
    }
}
