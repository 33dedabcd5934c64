//! Files that the user has edited and that the stages have used without changing them.

use crate::case::SimulatorCase;
use crate::experiments::experiment_inputs;
use crate::pipeline::freshness::finished_in;
use crate::pipeline::inputs::Inputs;
use crate::results_folder::editable::is_editable;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::files::{IMPORTED, SPECIMENS, VALUES};
use crate::results_folder::product_folder::ProductFolder;

/// One sentence for each edited product, and for each edited copy of a file that the case names.
pub(super) fn edited(inputs: &Inputs<'_>) -> Result<Vec<String>, WorkflowError> {
    let mut sentences = Vec::new();
    for record in finished_in(inputs.folder()).values() {
        // read the editable products, so that the report is made again when one of them changes
        for name in record.products().filter(|name| is_editable(name)) {
            inputs.file_if_there(name);
        }
        for name in record.edited(inputs.folder()) {
            sentences.push(format!(
                "{name} was edited after breccia wrote it, and the stages after it used it as it is."
            ));
        }
    }
    let folder = ProductFolder::new(inputs.folder(), &[]);
    for name in copies(inputs)? {
        if inputs.file_if_there(&name).is_some() && folder.is_edited(&name)? {
            sentences.push(format!(
                "{name} was edited after breccia copied it, and is used in place of the original."
            ));
        }
    }
    Ok(sentences)
}

/// Names of the copies of files that the case names.
fn copies(inputs: &Inputs<'_>) -> Result<Vec<String>, WorkflowError> {
    let case = inputs.case();
    let mut names = vec!["specimen.msh".to_owned()];
    names.extend((1..=case.further_tests.candidate.len()).map(|k| format!("candidates/{k}.msh")));
    for source_path in case.simulator.iter().flat_map(SimulatorCase::paths) {
        names.push(source_path.display().to_string());
    }
    names.extend([IMPORTED, VALUES].map(str::to_owned));
    let is_measured = case.experiments.as_ref().is_some_and(|e| e.table.is_some());
    if is_measured && inputs.file_if_there(SPECIMENS).is_some() {
        names.push(SPECIMENS.to_owned());
        let specimens = experiment_inputs::specimen_table(inputs)?.specimens;
        let curve = |id: &str| format!("experiments/curves/{id}.csv");
        names.extend(specimens.iter().map(|specimen| curve(&specimen.id)));
    }
    Ok(names)
}
