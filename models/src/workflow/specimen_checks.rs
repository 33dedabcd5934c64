//! Measured specimens are looked at before anything is computed for them: sizes, number, curves.

use super::WorkflowError;
use super::files::SPECIMENS;
use super::specimen_notes::{Notes, check_rate, note_sizes};
use super::task::Task;
use crate::case::Toe;
use crate::curve_check::{Finding, InspectedCurve, Weight};
use crate::error::InputError;
use crate::experiment::{SpecimenTable, TestCurve};

/// A specimen of so many times the mesh's height, or of this part of it, is not the one that is meshed.
const HEIGHTS: f64 = 3.0;
/// The same of its radius: forces go with its square.
const RADII: f64 = 1.5;

/// Looks at specimens that are compared with a mesh of this height and radius (mm), writes
/// `curve_checks.csv` and tells what was found. The curves that are returned end with the loading, and
/// begin where load begins if the case asks for that.
///
/// # Errors
/// The first thing that would make quantities of interest wrong, with its file; others are told.
pub(super) fn checked(
    task: &Task<'_>,
    mut table: SpecimenTable,
    [height_mm, radius_mm]: [f64; 2],
) -> Result<SpecimenTable, WorkflowError> {
    let file = task.path(SPECIMENS);
    if let [only] = &table.specimens[..] {
        let help = "Scatter between specimens needs at least two: add lines to the table, or choose \
                    another experiments.group.";
        let problem = "is the only specimen";
        return Err(InputError::new(&file, "specimen", &only.id, problem, help).into());
    }
    for specimen in &table.specimens {
        let sizes = [
            ("height_mm", specimen.height_mm, height_mm, HEIGHTS),
            ("radius_mm", specimen.radius_mm, radius_mm, RADII),
        ];
        for (column, own, mesh, most) in sizes {
            if !(1.0 / most..=most).contains(&(own / mesh)) {
                let place = format!("specimen {}, column {column}", specimen.id);
                let what = column.trim_end_matches("_mm");
                return Err(InputError::new(
                    &file,
                    place,
                    own.to_string(),
                    format!("is far from the mesh's {what} of {mesh:.4} mm"),
                    format!("Write it in mm, or mesh a specimen of this {what}."),
                )
                .into());
            }
        }
    }

    let mut notes = Notes::default();
    check_rate(task, &table, height_mm, &mut notes)?;
    note_sizes(&table, [height_mm, radius_mm], &mut notes);
    let (fraction, correct) = (task.inputs.qoi().slope_fraction, task.inputs.toe() == Toe::Correct);
    let (mut toes, mut refused) = (Vec::new(), None);
    for specimen in &mut table.specimens {
        let fraction = specimen.slope_fraction.unwrap_or(fraction);
        let (curve, findings) = looked_at(&specimen.curve, fraction, correct);
        specimen.curve = curve;
        for Finding { name, value, problem, help, weight } in findings {
            if name == "toe" {
                toes.push(value);
            }
            match weight {
                Weight::Error if refused.is_none() => {
                    let path = task.path("experiments/curves").join(format!("{}.csv", specimen.id));
                    refused = Some(InputError::new(&path, "", "", problem.clone(), help));
                }
                Weight::Error | Weight::Warning => {
                    notes.warn(name, format!("{} {problem}. {help}", specimen.id));
                }
                Weight::Note => {}
            }
            notes.list(&specimen.id, name, value, format!("{problem}. {help}"));
        }
    }
    notes.finish(task);
    task.write_csv("curve_checks.csv", ["id", "finding", "value", "help"], notes.into_rows())?;
    if let Some(error) = refused {
        return Err(error.into());
    }
    let [low, high] = toes.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &toe| {
        [low.min(toe), high.max(toe)]
    });
    let done = if correct { "taken away" } else { "left in" };
    crate::progress::say(
        "note",
        &format!("the curves begin to carry load at {low:.4} to {high:.4} mm: {done}"),
    );
    Ok(table)
}

/// The part of a measured curve that quantities are taken from, and what was found in it: it ends with the
/// loading, and begins where load begins if that is to be corrected.
pub(super) fn looked_at(
    curve: &TestCurve,
    slope_fraction: f64,
    correct: bool,
) -> (TestCurve, Vec<Finding>) {
    let mut seen = InspectedCurve::of(curve, slope_fraction);
    if !correct {
        return (seen.loading, seen.findings);
    }
    let (curve, moved) = seen.without_toe(slope_fraction);
    if let Some(late) = seen.findings.iter_mut().find(|finding| finding.name == "late-load") {
        late.weight = Weight::Note;
        late.help = "Displacement is counted from there.";
    }
    let toe = seen.findings.iter_mut().find(|finding| finding.name == "toe");
    if let Some(toe) = toe {
        toe.value = moved;
        toe.problem = format!("begins to carry load at {moved:.4} mm");
        toe.help = "Displacement is counted from there.";
        toe.weight = Weight::Note;
    }
    (curve, seen.findings)
}
