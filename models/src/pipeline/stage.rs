//! Definition of a stage of the workflow.

use super::task::Task;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::files::warnings_of;

/// Function for the part of a stage's work that several processes do together.
pub(crate) type Share = fn(&Task<'_>) -> Result<(), WorkflowError>;

/// A step of the workflow; [`STAGES`](crate::STAGES) lists all stages in order.
///
/// The inputs of a stage are not listed here. The inputs are recorded while the stage runs.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// Name of the subcommand that runs the stage.
    pub name: &'static str,
    /// Description of the stage in one line.
    pub about: &'static str,
    /// Names of the files that the stage writes: `#` stands for a number, `*` for any text without a slash.
    pub products: &'static [&'static str],
    /// Part of the stage's work that several processes can do together before one process executes `run`; `None` if the
    /// work cannot be shared.
    pub(crate) share: Option<Share>,
    pub(crate) run: fn(&Task<'_>) -> Result<String, WorkflowError>,
}

impl Stage {
    /// Creates a stage of a user's program, which [`Registry::with_stage`](crate::Registry::with_stage) adds. `name` is
    /// also the subcommand that runs the stage, and `about` its description in one line. `products` are the names of all
    /// files that the stage may write (`#` stands for a number, `*` for any text without a slash). `run` reads the case and
    /// the results of earlier stages through the [`Task`], which records them: a stage is run again if any of them has
    /// changed. `run` returns a line for the screen.
    pub fn new(
        name: &'static str,
        about: &'static str,
        products: &[&'static str],
        run: fn(&Task<'_>) -> Result<String, WorkflowError>,
    ) -> Self {
        // a process has few stages, which live until the process ends
        let warnings: &'static str = Box::leak(warnings_of(name).into_boxed_str());
        let products = Box::leak([products, &[warnings]].concat().into_boxed_slice());
        Self { name, about, products, share: None, run }
    }

    /// Whether the stage makes the specimen. The cases of a study can share the results of such a stage.
    pub(crate) fn is_of_the_specimen(&self) -> bool {
        matches!(self.name, "segment" | "mesh")
    }

    /// Whether several processes can do the stage's work together.
    pub fn is_shared(&self) -> bool {
        self.share.is_some()
    }
}
