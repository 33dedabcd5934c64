//! A single simulation with the parameters of the case.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use fem::{
    Checkpoint, ComputeDevice, CurvePoint, DeviceError, End, FemError, Fields, LinearScheme,
    Observer, Outcome, Ranks, SolverOptions, TetMesh, vtu, write_curve,
};

use super::in_place::{SIMULATION, check_inputs};
use super::simulate_outside::simulate_outside;
use crate::case::CaseFile;
use crate::progress::{Bar, say};
use crate::results_folder::effort_file::EffortFile;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::product_folder::{FolderAccess, ProductFolder};
use crate::runs::quadrature::quadrature_note;
use crate::simulation::resolution::resolution_note;
use crate::simulation::run_values::failure;
use crate::simulation::setup::Setup;
use crate::simulation::simulator::Simulator;
use crate::simulation::without_viscosity::without_viscosity;
use crate::specimen::build::mesh_of;
use crate::specimen::damage_of::damage_of;

/// Device that solves the linear systems.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum DeviceChoice {
    /// A graphics card if there is one and the mesh is large, otherwise the processor
    #[default]
    Auto,
    /// The processor
    Cpu,
    /// An NVIDIA card
    Cuda,
    /// The processor with the kernels of a graphics card, compiled by the C compiler; for tests
    Host,
}

impl DeviceChoice {
    /// Returns the device and the solver settings for this process, which is one of `ranks`.
    fn device(
        self,
        mut options: SolverOptions,
        ranks: &Ranks,
    ) -> Result<(Option<ComputeDevice>, SolverOptions), DeviceError> {
        let device = match self {
            // a direct solver was requested: the processor computes the factorisation
            Self::Auto if options.linear == LinearScheme::Direct => None,
            Self::Auto if ranks.size() > 1 => None,
            Self::Auto => ComputeDevice::cuda().ok(),
            Self::Cpu => None,
            Self::Cuda => Some(ComputeDevice::cuda()?),
            Self::Host => Some(ComputeDevice::host()?),
        };
        // a device that the user requests is used for small meshes too
        if matches!(self, Self::Cuda | Self::Host) && options.linear == LinearScheme::Auto {
            options.linear = LinearScheme::Multigrid;
        }
        Ok((device, options))
    }
}

/// Simulates the test of the case. During the run, writes to `dir`: `curve.csv`; the fields `fields/step-*.vtu` with
/// the collection `fields.pvd` for ParaView; `effort.csv` with the effort of each step; `damage/step-*.png` if the case
/// asks for pictures; and `simulate.state`, from which the same command resumes after an interruption with
/// bit-identical results. `simulate.state` is removed at the end.
///
/// For a case with `[simulator]`, runs the program of the user once, at the medians of the priors.
///
/// All ranks call this function. The first rank writes the files. A run may be resumed with another number of ranks.
///
/// # Errors
/// Fails if the mesh or the test cannot be set up, or if `simulate.state` belongs to another case. If the run itself
/// fails, its curve so far, its last state as `fields/last.vtu` and the reason as `failure.txt` are written before the
/// error is returned; the next run removes the last two files. If a file of the user has the path of one of these
/// files, the command fails before it computes anything.
pub fn simulate(
    file: &CaseFile,
    dir: &Path,
    device: DeviceChoice,
    ranks: &Ranks,
    interrupt: &AtomicBool,
    access: &FolderAccess,
) -> Result<PathBuf, WorkflowError> {
    if !file.case.is_built_in() {
        return simulate_outside(file, dir, interrupt);
    }
    let folder = ProductFolder::new(dir, &access.replace);
    // an error of one rank must stop all ranks before they communicate in the simulation
    let mesh = agreed(ranks, mesh_for(file, dir, &folder))?;
    let device = match device {
        // a follower pressure does not run on a device
        DeviceChoice::Auto if file.case.has_follower_pressure() => DeviceChoice::Cpu,
        chosen => chosen,
    };
    let (device, solver) = device.device(file.case.solver, ranks)?;
    let setup = Setup { device: device.as_ref(), ranks: Some(ranks), solver, ..Setup::from(file) };
    if ranks.is_first() {
        resolution_note(&setup, &mesh).iter().for_each(|note| say("note", note));
        quadrature_note(&file.case, &mesh).iter().for_each(|note| say("note", note));
        without_viscosity(&file.case).iter().for_each(|warning| say("warning", warning));
    }
    let simulator = agreed(ranks, Simulator::new(&setup, mesh, Vec::new()))?;
    if !ranks.is_first() {
        agreed(ranks, Ok(()))?;
        let mut follower = |_: &CurvePoint, _: &Fields| match interrupt.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        };
        return match run(file, dir, &simulator, &mut follower)?.end {
            End::Interrupted => Err(WorkflowError::Interrupted),
            end => failure(&end).map_or(Ok(dir.join("curve.csv")), |error| Err(error.into())),
        };
    }
    for warning in simulator.problem().warnings() {
        say("note", &warning.to_string());
    }
    let files = SimulationFiles::new(file, &simulator, &folder, interrupt);
    let mut record = agreed(ranks, files)?;
    let outcome = run(file, dir, &simulator, &mut record)?;
    say("device", &format!("linear systems were solved by {}", outcome.machine));
    let cuts = outcome.effort.cuts;
    if cuts > 0 {
        let text = format!(
            "{cuts} load steps were cut, since no equilibrium was found at their full length"
        );
        say("note", &text);
    }
    let written = record.finish();
    // remove the files of an earlier failed run
    folder.remove(LAST)?;
    folder.remove(REASON)?;
    if let Some(error) = failure(&outcome.end) {
        let fields = &outcome.fields;
        folder.write_with(LAST, COMMAND, |path| simulator.problem().write_vtu(path, fields))?;
        folder.write(REASON, COMMAND, format!("{error}\n").as_bytes())?;
        let (last, reason) = (folder.path(LAST), folder.path(REASON));
        let (last, reason) = (last.display(), reason.display());
        say(
            "note",
            &format!(
                "the last state was written to {last}, and the reason why the run ended to {reason}"
            ),
        );
        return Err(error.into());
    }
    written?;
    if matches!(outcome.end, End::Interrupted) {
        return Err(WorkflowError::Interrupted);
    }
    if matches!(outcome.end, End::LimitLoad) {
        let last = outcome.curve.last().copied().unwrap_or_default();
        say(
            "note",
            &format!(
                "the curve ends at {:.4} s: the specimen does not carry the force of test.program beyond {:.4} N and {:.4} mm",
                last.time_s, last.force_n, last.displacement_mm
            ),
        );
    }
    folder.remove(STATE)?;
    Ok(folder.path(CURVE))
}

/// Command named in error messages about files.
const COMMAND: &str = "simulate";
/// File of the curve: one row per step.
const CURVE: &str = "curve.csv";
/// File of the effort per step.
const EFFORT: &str = "effort.csv";
/// ParaView collection of the fields.
const COLLECTION: &str = "fields.pvd";
/// State from which a run resumes.
const STATE: &str = "simulate.state";
/// Last state of a failed run.
const LAST: &str = "fields/last.vtu";
/// Reason why a run failed.
const REASON: &str = "failure.txt";

/// Returns the mesh of a case whose results go to `dir`. Fails if a file of the user would be overwritten.
fn mesh_for(file: &CaseFile, dir: &Path, folder: &ProductFolder) -> Result<TetMesh, WorkflowError> {
    check_inputs(file, dir)?;
    folder.claim_all(SIMULATION, COMMAND, |_| true)?;
    std::fs::create_dir_all(dir).map_err(|e| WorkflowError::results(dir, e))?;
    mesh_of(file)
}

fn run(
    file: &CaseFile,
    dir: &Path,
    simulator: &Simulator,
    observer: &mut dyn Observer,
) -> Result<Outcome, FemError> {
    let test = simulator.problem();
    match file.case.output.checkpoint_every {
        0 => Ok(test.run(observer)),
        every => test.run_resumable(&Checkpoint { path: dir.join(STATE), every }, observer),
    }
}

/// Returns `result` if all ranks succeeded; otherwise returns the error of the first failing rank.
fn agreed<T>(ranks: &Ranks, result: Result<T, WorkflowError>) -> Result<T, WorkflowError> {
    let error = result.as_ref().err().map(ToString::to_string);
    match ranks.first_text(error.as_deref())? {
        None => result,
        Some((rank, message)) => result.and(Err(WorkflowError::Rank { rank, message })),
    }
}

/// Writes the files of a run and shows its progress.
struct SimulationFiles<'a> {
    file: &'a CaseFile,
    simulator: &'a Simulator,
    folder: &'a ProductFolder,
    interrupt: &'a AtomicBool,
    bar: Bar,
    /// Points of the curve so far. The file `curve.csv` is first written after the first step, so that a run that
    /// fails in its first step does not replace the curve of an earlier run.
    curve: Vec<CurvePoint>,
    effort: EffortFile,
    /// Time (s) and file of each step whose fields are written.
    fields: Vec<(f64, String)>,
    /// First error while writing files; it ends the run.
    failed: Option<WorkflowError>,
}

impl<'a> SimulationFiles<'a> {
    fn new(
        file: &'a CaseFile,
        simulator: &'a Simulator,
        folder: &'a ProductFolder,
        interrupt: &'a AtomicBool,
    ) -> Result<Self, WorkflowError> {
        if file.case.output.checkpoint_every > 0 {
            folder.begin_growing(STATE, COMMAND)?;
        }
        Ok(Self {
            file,
            simulator,
            folder,
            interrupt,
            bar: Bar::new(COMMAND, "load steps"),
            curve: Vec::new(),
            effort: EffortFile::default(),
            fields: Vec::new(),
            failed: None,
        })
    }

    /// Adds a step to the files. Files that grow are rewritten completely at every step, and their content is recorded
    /// before writing. Thus an edit is detected even in the files of a killed run.
    fn add(&mut self, point: &CurvePoint, fields: Option<&Fields>) -> Result<(), WorkflowError> {
        self.curve.push(*point);
        let step = self.curve.len();
        let every = self.file.case.output.pictures_every as usize;
        if let Some(fields) = fields.filter(|_| every > 0 && step.is_multiple_of(every)) {
            let name = format!("damage/step-{step:05}.png");
            let picture = damage_of(self.simulator.problem(), fields).to_png();
            let picture = picture.map_err(|e| WorkflowError::io(&self.folder.path(&name), e))?;
            self.folder.write(&name, COMMAND, &picture)?;
        }
        let every = self.file.case.output.fields_every as usize;
        if every > 0 && step.is_multiple_of(every) {
            let name = format!("fields/step-{step:05}.vtu");
            if let Some(fields) = fields {
                let problem = self.simulator.problem();
                self.folder.write_with(&name, COMMAND, |path| problem.write_vtu(path, fields))?;
            }
            // also list steps from before the run was resumed, if their files exist
            if fields.is_some() || self.folder.path(&name).is_file() {
                self.fields.push((point.time_s, name));
            }
        }
        Ok(())
    }

    fn write_curve(&self) -> Result<(), WorkflowError> {
        self.folder.write_with(CURVE, COMMAND, |path| write_curve(path, &self.curve)).map(drop)
    }

    fn write_effort(&mut self, point: &CurvePoint) -> Result<(), WorkflowError> {
        let text = self.effort.push(self.curve.len(), point);
        self.folder.write(EFFORT, COMMAND, text.as_bytes()).map(drop)
    }

    fn list(&self) -> Result<(), WorkflowError> {
        if self.fields.is_empty() {
            return Ok(());
        }
        let steps: Vec<(f64, &str)> = self.fields.iter().map(|(t, f)| (*t, f.as_str())).collect();
        self.folder.write_with(COLLECTION, COMMAND, |path| vtu::write_pvd(path, &steps)).map(drop)
    }

    /// Ends the writing of files: writes the empty curve of a run without steps, and records the final content of the
    /// state file.
    fn finish(self) -> Result<(), WorkflowError> {
        if self.curve.is_empty() && self.failed.is_none() {
            self.write_curve()?;
        }
        self.failed.map_or(Ok(()), Err)?;
        self.folder.end_growing(STATE)
    }
}

impl Observer for SimulationFiles<'_> {
    fn step(&mut self, point: &CurvePoint, fields: &Fields) -> ControlFlow<()> {
        let written = self.add(point, Some(fields)).and_then(|()| self.write_curve());
        let written = written.and_then(|()| self.list()).and_then(|()| self.write_effort(point));
        let state = format!(
            "step {}, {:.4} mm, {:.2} N, residual {:.1e}",
            self.curve.len(),
            point.displacement_mm,
            point.force_n,
            point.residual
        );
        self.bar.set(self.simulator.fraction_done(point), &state);
        if let Err(error) = written {
            self.failed = Some(error);
        }
        if self.failed.is_some() || self.interrupt.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    }

    fn resumed(&mut self, curve: &[CurvePoint]) {
        self.bar.note(&format!("resumes after step {}", curve.len()));
        self.effort.resumed(&self.folder.path(EFFORT), curve.len());
        let added = curve.iter().try_for_each(|point| self.add(point, None));
        self.failed = added.and_then(|()| self.write_curve()).err();
    }
}
