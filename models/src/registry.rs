//! Extensions that a program of the user can add to `breccia`.

use breccia_calibration::{Qoi, QoiRegistry};

use crate::case::{Target, TargetRegistry};
use crate::pipeline::extensions::{self, ReportSection};
use crate::pipeline::stage::Stage;
use crate::stages::table::{BUILT_IN, JOINT_STAGES};

/// Registry of the quantities of interest and the parameters that a case can name, of the stages, and of the sections of the
/// report. A program of the user can add entries.
///
/// # Example
/// A program that is `breccia` with one more quantity of interest, one more stage and one more section of the report:
/// ```no_run
/// use std::borrow::Cow;
/// use std::process::ExitCode;
/// use models::{PeakedCurve, Qoi, QoiError, Registry, ReportSection, Stage, Task, Unit, WorkflowError};
///
/// /// Peak force divided by the displacement at peak.
/// #[derive(Debug)]
/// struct SecantStiffness;
///
/// impl Qoi for SecantStiffness {
///     fn name(&self) -> Cow<'static, str> { "secant-stiffness".into() }
///     fn column(&self) -> Cow<'static, str> { "secant_stiffness_N_per_mm".into() }
///     fn description(&self) -> Cow<'static, str> { "secant stiffness".into() }
///     fn unit(&self) -> Unit { Unit::N_PER_MM }
///     fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
///         Ok(curve.peak_force_n() / curve.peak_mm())
///     }
/// }
///
/// /// Number of the draws, from a result of the stage `calibrate`.
/// fn count(task: &Task<'_>) -> Result<String, WorkflowError> {
///     let draws = task.text("posterior.csv")?.lines().skip(1).count();
///     task.write("draws.txt", draws.to_string())?;
///     Ok(format!("{draws} draws"))
/// }
///
/// fn section(task: &Task<'_>) -> Result<Option<String>, WorkflowError> {
///     Ok(Some(format!("<p>The posterior has {} draws.</p>", task.text("draws.txt")?)))
/// }
///
/// fn main() -> ExitCode {
///     let registry = Registry::standard()
///         .with_qoi(SecantStiffness)
///         .with_stage(Stage::new("count", "Count the draws: draws.txt", &["draws.txt"], count))
///         .with_section(ReportSection::new("Number of draws", section));
///     models::program(registry)
/// }
/// ```
#[derive(Debug)]
pub struct Registry {
    qois: QoiRegistry,
    targets: TargetRegistry,
    stages: Vec<Stage>,
    sections: Vec<ReportSection>,
}

impl Registry {
    /// Registry of the built-in quantities of interest and parameters.
    pub fn standard() -> Self {
        Self {
            qois: QoiRegistry::standard(),
            targets: TargetRegistry::standard(),
            stages: Vec::new(),
            sections: Vec::new(),
        }
    }

    /// Adds a quantity of interest. If an earlier quantity has the same name, the earlier quantity is used.
    pub fn with_qoi(self, qoi: impl Qoi) -> Self {
        Self { qois: self.qois.with_qoi(qoi), ..self }
    }

    /// Adds a parameter that `[prior]` can name. If an earlier target has the same path, the earlier target is used.
    pub fn with_target(self, target: impl Target) -> Self {
        Self { targets: self.targets.with_target(target), ..self }
    }

    /// Adds a stage, which runs after the stages of Breccia that compute results and before the stage `verdict`. If a case has
    /// several tests, the stage runs in the folder of each test. `breccia NAME` runs the stage alone.
    ///
    /// # Panics
    /// If another stage has the same name, or if another stage writes one of the products.
    pub fn with_stage(mut self, stage: Stage) -> Self {
        let mut others = BUILT_IN.iter().chain(&JOINT_STAGES).chain(&self.stages);
        if let Some(other) = others.find(|other| other.conflicts_with(&stage)) {
            panic!(
                "the stage {:?} has the name or a product of the stage {:?}",
                stage.name, other.name
            );
        }
        self.stages.push(stage);
        self
    }

    /// Adds a section to the report, before the sections on the specimen and the methods. The report of unfinished results
    /// does not have the section.
    pub fn with_section(mut self, section: ReportSection) -> Self {
        self.sections.push(section);
        self
    }

    /// Makes this registry the registry of the process; must be called before the first case is read. Returns
    /// `false` if the process already has a registry. [`program`](crate::program) calls this method.
    pub fn install(self) -> bool {
        let are_first = [
            self.qois.install(),
            self.targets.install(),
            extensions::install(self.stages, self.sections),
        ];
        are_first.into_iter().all(|is_first| is_first)
    }
}
