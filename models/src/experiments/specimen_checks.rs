//! Checks of measured specimens before computations: sizes, number and curves.

use std::path::Path;

use super::closed_form::far_from_closed_form;
use super::experiment_inputs;
use super::followed_program::check_programs;
use super::mesh_scale::MeshSize;
use super::preparation::Preparation;
use super::simulated_displacement::{EarlyEnd, early_end};
use super::specimen_notes::{Notes, check_machine, check_rates, note_sizes};
use super::specimen_quantities::{
    MeasuredQuantities, SpecimenNames, check_scatter, compared, missing_quantities,
};
use crate::curve_check::{Finding, NO_QUANTITIES, Weight};
use crate::error::InputError;
use crate::experiment::{Specimen, SpecimenTable};
use crate::pipeline::inputs::Inputs;
use crate::pipeline::task::Task;
use crate::progress::say;
use crate::qoi::Quantity;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::files::SPECIMENS;

/// Largest plausible ratio between the heights of specimen and mesh; the larger height is the numerator.
const HEIGHTS: f64 = 3.0;
/// Largest plausible ratio between the radii of specimen and mesh. This limit is smaller than the limit for the
/// heights, because forces are proportional to the square of the radius.
const RADII: f64 = 1.5;

/// Result of the checks of specimens.
pub(crate) struct InspectedSpecimens {
    /// The specimens, with the curves from which quantities are computed: see [`Preparation::apply`].
    pub(crate) table: SpecimenTable,
    pub(crate) notes: Notes,
    /// Errors that would make quantities of interest wrong.
    pub(crate) mistakes: Vec<InputError>,
}

/// Checks whether specimens can be compared with a mesh of the given size. Writes `curve_checks.csv` and prints the
/// findings.
///
/// # Errors
/// The first error that the checks found.
pub(crate) fn checked(
    task: &Task<'_>,
    table: SpecimenTable,
    mesh: Option<MeshSize>,
) -> Result<SpecimenTable, WorkflowError> {
    let file = task.path(SPECIMENS);
    let curve = |id: &str| task.path("experiments/curves").join(format!("{id}.csv"));
    let names = SpecimenNames { table: &file, curve: &curve };
    let InspectedSpecimens { table, notes, mistakes } =
        inspect(&task.inputs, table, mesh, &names, task.accept_out_of_range)?;
    notes.lines().iter().for_each(|line| say("note", line));
    notes.warnings().iter().for_each(|line| task.warn(line));
    task.write_csv("curve_checks.csv", ["id", "finding", "value", "help"], notes.into_rows())?;
    mistakes.into_iter().next().map_or(Ok(table), |mistake| Err(mistake.into()))
}

/// Checks whether specimens can be compared with a mesh of the given size, or without a mesh: number, sizes, rates, curves and quantities,
/// and whether the quantities are plausible for the materials of the case.
///
/// # Errors
/// Fails if the case has neither measured nor virtual specimens.
pub(crate) fn inspect(
    inputs: &Inputs<'_>,
    mut table: SpecimenTable,
    mesh: Option<MeshSize>,
    names: &SpecimenNames<'_>,
    accept_out_of_range: bool,
) -> Result<InspectedSpecimens, WorkflowError> {
    let mut mistakes = Vec::new();
    if let ([only], 2..) = (&table.specimens[..], inputs.least_specimens()) {
        let help = "Scatter between specimens needs at least two: add lines to the table, or choose \
                    another experiments.group.";
        let problem = "is the only specimen";
        mistakes.push(InputError::new(names.table, "specimen", &only.id, problem, help));
    }
    let mut notes = Notes::default();
    let are_virtual = experiment_inputs::are_specimens_virtual(inputs)?;
    if let Some(mesh) = mesh {
        mistakes.extend(table.specimens.iter().flat_map(|row| far_sizes(row, mesh, names.table)));
        mistakes.extend(check_rates(
            inputs.test(),
            &table,
            mesh.height_mm,
            are_virtual,
            names.curve,
            &mut notes,
        ));
        note_sizes(&table, mesh, &mut notes);
        let machine = experiment_inputs::known_machine(inputs);
        mistakes.extend(check_machine(machine, &table, names.curve, &mut notes));
        mistakes.extend(check_programs(inputs.test(), &table, mesh, names.curve, &mut notes));
    }
    let (qoi, preparation) = (inputs.qoi(), Preparation::of(inputs));
    let is_bent = is_bent_from_start(inputs);
    let mut toes = Vec::new();
    let mut measured: Vec<(String, MeasuredQuantities)> = Vec::new();
    for specimen in &mut table.specimens {
        let fraction = specimen.slope_fraction.unwrap_or(qoi.slope_fraction);
        let (curve, findings) = preparation.apply(&specimen.curve, fraction);
        specimen.curve = curve;
        let file = (names.curve)(&specimen.id);
        let own = compared(specimen, mesh, qoi, &qoi.quantities);
        // a toe can be removed only from a curve with a peak
        let may_lack_peak = own.unusable().is_none() && !preparation.corrects_toe();
        let mut refused = None;
        for Finding { name, value, problem, help, weight } in findings {
            if name == "toe" {
                toes.push(value);
            }
            match weight {
                // whether this is a soft start is decided by the simulation at the mode: see the rule `toe`
                Weight::Warning if name == "toe" && is_bent => {}
                Weight::Error if name == NO_QUANTITIES && may_lack_peak => {
                    if own.missing.is_empty() {
                        notes.warn(name, format!("{} {problem}.", specimen.id));
                    }
                }
                Weight::Error if refused.is_none() => {
                    refused = Some(InputError::new(&file, "", "", problem.clone(), help));
                }
                Weight::Error | Weight::Warning => {
                    notes.warn(name, format!("{} {problem}. {help}", specimen.id));
                }
                Weight::Note => {}
            }
            notes.list(&specimen.id, name, value, format!("{problem}. {help}"));
        }
        let unusable = || {
            let problem = own.unusable()?.to_string();
            let help = "Correct the curve, or remove the specimen from the table.";
            Some(InputError::new(&file, "", "", problem, help))
        };
        match refused.or_else(unusable) {
            Some(mistake) => mistakes.push(mistake),
            None => measured.push((specimen.id.clone(), own)),
        }
    }
    if inputs.least_specimens() > 1 {
        let values: Vec<Vec<f64>> = measured.iter().map(|(_, own)| own.values.clone()).collect();
        mistakes.extend(check_scatter(names.table, &qoi.quantities, &values));
    }
    mistakes.extend(note_missing(&qoi.quantities, &measured, names, &mut notes));
    notes.say_what_was_left_out();
    let [low, high] = toes.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &toe| {
        [low.min(toe), high.max(toe)]
    });
    if !toes.is_empty() {
        let done =
            if preparation.corrects_toe() { "the toe was removed" } else { "the toe was kept" };
        let text = format!("the curves begin to carry load at {low:.4} to {high:.4} mm: {done}");
        notes.say("load", &text);
    }
    if let Some(mesh) = mesh.filter(|_| !are_virtual) {
        let distance = far_from_closed_form(inputs, &table, mesh, names);
        match distance {
            Some((specimen, mistake)) if accept_out_of_range => {
                notes.warn("range", format!("{specimen}: {} {}", mistake.problem, mistake.help));
            }
            Some((_, mistake)) => mistakes.push(mistake),
            // a wrong unit can also be the reason for a peak beyond the end, and is reported first
            None => match early_end(inputs, &table, mesh, names) {
                Some(EarlyEnd::BeforeAllPeaks(mistake)) if accept_out_of_range => {
                    let InputError { place, value, problem, help, .. } = mistake;
                    notes.warn("range", format!("{place} = {value} {problem}. {help}"));
                }
                Some(EarlyEnd::BeforeAllPeaks(mistake)) => mistakes.push(mistake),
                Some(EarlyEnd::NearPeaks(warning)) => notes.warn("range", warning),
                None => {}
            },
        }
    }
    Ok(InspectedSpecimens { table, notes, mistakes })
}

/// Whether the curve of a specimen is bent from its start because a material relaxes or yields. The extrapolation by which a toe
/// is found then finds a toe that is no soft start.
fn is_bent_from_start(inputs: &Inputs<'_>) -> bool {
    let mut materials = inputs.material().values();
    materials.any(|material| material.viscoelastic.is_some() || material.plastic.is_some())
}

/// Adds warnings about quantities that some curves cannot give, with the reasons.
///
/// Returns an error for each quantity that no curve can give.
fn note_missing(
    quantities: &[Quantity],
    measured: &[(String, MeasuredQuantities)],
    names: &SpecimenNames<'_>,
    notes: &mut Notes,
) -> Vec<InputError> {
    let mut mistakes = Vec::new();
    for (m, quantity) in quantities.iter().enumerate() {
        let has_quantity = |own: &MeasuredQuantities| !own.values[m].is_nan();
        let reasons = measured.iter().flat_map(|(id, own)| {
            let of_quantity = own.missing.iter().filter(|(missing, _)| missing == quantity);
            of_quantity.map(move |(_, reason)| (id, reason))
        });
        if !measured.iter().any(|(_, own)| has_quantity(own)) {
            mistakes.extend(reasons.take(1).map(|(id, reason)| {
                let problem = format!("no specimen has {quantity}. {id}: {reason}");
                let help = "Take another quantity in qoi.quantities, or correct the curves.";
                InputError::new(&(names.curve)(id), "", "", problem, help)
            }));
            continue;
        }
        for (id, reason) in reasons {
            let text = format!("has no {quantity}: {reason}");
            notes.warn("missing", format!("{id} {text}"));
            notes.list(id, "missing", f64::NAN, text);
        }
    }
    if mistakes.is_empty() {
        let rows: Vec<Vec<f64>> = measured.iter().map(|(_, own)| own.values.clone()).collect();
        for warning in missing_quantities(quantities, &rows) {
            notes.warn("lack", warning);
        }
    }
    mistakes
}

/// Returns errors for sizes of a specimen that differ too much from the sizes of the mesh.
fn far_sizes(
    specimen: &Specimen,
    mesh: MeshSize,
    table: &Path,
) -> impl Iterator<Item = InputError> {
    let sizes = [
        ("height_mm", specimen.height_mm, mesh.height_mm, HEIGHTS),
        ("radius_mm", specimen.radius_mm, mesh.radius_mm, RADII),
    ];
    let mistakes = sizes.map(|(column, size, mesh, most)| {
        if (1.0 / most..=most).contains(&(size / mesh)) {
            return None;
        }
        let location = format!("specimen {}, column {column}", specimen.id);
        let what = column.trim_end_matches("_mm");
        let problem = format!("is far from the mesh's {what} of {mesh:.4} mm");
        let help = format!("Write it in mm, or mesh a specimen of this {what}.");
        Some(InputError::new(table, location, size.to_string(), problem, help))
    });
    mistakes.into_iter().flatten()
}
