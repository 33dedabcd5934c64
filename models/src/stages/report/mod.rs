//! Stage `report`: figures and tables of all stages on one page.

mod levels;
mod load;

pub(crate) use load::{divergences, evidence, load, load_done, parameters, sensitivities, summary};

use crate::pipeline::extensions::further_sections;
use crate::pipeline::task::Task;
use crate::results_folder::error::WorkflowError;

pub(crate) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let mut results = load(&task.inputs)?;
    for section in further_sections() {
        let content = (section.content)(task)?;
        results.further_sections.extend(content.map(|html| (section.title, html)));
    }
    task.write("report.html", crate::report::page(&results))?;
    Ok(task.path("report.html").display().to_string())
}
