//! Specimens with which a stage compares simulations, as inputs of the stage: table, curves, group, and corrections of
//! the records.

use std::path::{Path, PathBuf};

use crate::case::{MachineCase, PriorCase, Toe};
use crate::experiment::SpecimenTable;
use crate::pipeline::inputs::Inputs;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::files::SPECIMENS;

/// Whether the specimens are simulated, and not measured.
pub(crate) fn are_specimens_virtual(inputs: &Inputs<'_>) -> Result<bool, WorkflowError> {
    inputs.reads("experiments.table");
    match &inputs.unrecorded().case.experiments {
        Some(experiments) => Ok(experiments.virtual_specimens.is_some()),
        None => Err(inputs.missing("experiments", "which curves to calibrate against")),
    }
}

/// Path of the table of measured quantities, if the case has such a table instead of curves.
pub(crate) fn measured_values(inputs: &Inputs<'_>) -> Option<PathBuf> {
    let path = inputs.unrecorded().case.experiments.as_ref()?.values.as_ref()?;
    inputs.reads("experiments.values");
    Some(inputs.named_file(path))
}

/// Test whose specimens are chosen from a table of measured quantities; `None` for the specimens of all tests.
pub(crate) fn test_of_specimens<'a>(inputs: &'a Inputs<'_>) -> Option<&'a str> {
    inputs.reads("experiments.test");
    inputs.unrecorded().case.experiments.as_ref()?.test.as_deref()
}

/// The table of the specimens with their curves.
pub(crate) fn specimen_table(inputs: &Inputs<'_>) -> Result<SpecimenTable, WorkflowError> {
    inputs.unrecorded().table()?;
    let table = SpecimenTable::read(&inputs.reads_file(SPECIMENS))?;
    for specimen in &table.specimens {
        inputs.reads_file(&format!("experiments/curves/{}.csv", specimen.id));
        if let Some(image) = &specimen.image {
            inputs.reads_image(&Path::new("experiments").join(image));
        }
    }
    Ok(table)
}

/// Selects the specimens that the case calibrates against.
///
/// # Errors
/// If no specimen belongs to the chosen group. Also if there are several groups and no group is chosen, because the
/// differences between groups would be interpreted as scatter of one material.
pub(crate) fn chosen(
    inputs: &Inputs<'_>,
    table: SpecimenTable,
) -> Result<SpecimenTable, WorkflowError> {
    inputs.reads("experiments.group");
    match inputs.unrecorded().case.experiments.as_ref().and_then(|e| e.group.as_deref()) {
        Some(group) => Ok(table.in_group(group, &inputs.unrecorded().path)?),
        None => Ok(table.of_one_group(&inputs.unrecorded().path)?),
    }
}

/// Treatment of the soft start (toe) of the curves.
pub(crate) fn toe(inputs: &Inputs<'_>) -> Toe {
    inputs.reads("experiments.toe");
    inputs.unrecorded().case.experiments.as_ref().map(|e| e.toe).unwrap_or_default()
}

/// Properties of the machine by which the records of specimens are corrected: the properties that are
/// not calibrated.
pub(crate) fn known_machine(inputs: &Inputs<'_>) -> MachineCase {
    inputs.machine().without(calibrated_machine(inputs))
}

/// Whether the compliance of the machine is calibrated.
pub(crate) fn calibrates_compliance(inputs: &Inputs<'_>) -> bool {
    inputs.reads("prior.machine");
    let prior = inputs.unrecorded().case.prior.iter().flat_map(PriorCase::names);
    { prior }.any(|name| name == "machine.compliance_mm_per_n")
}

/// Properties of the machine that are calibrated, with arbitrary values.
fn calibrated_machine(inputs: &Inputs<'_>) -> MachineCase {
    inputs.reads("prior.machine");
    let prior = inputs.unrecorded().case.prior.iter().flat_map(PriorCase::names);
    let names: Vec<String> = prior.collect();
    MachineCase::of_inputs(names.iter().map(|name| (name.as_str(), 0.0)))
}
