//! All results folders of a case with several tests: one for each test, and the folder of the joint calibration.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::Workflow;
use super::in_place::check_inputs;
use crate::case::{CaseFile, SingleTest, single_tests};
use crate::experiments::common_specimens::refuse_counted_twice;
use crate::experiments::validation_folders::refuse_calibrated_by_others;
use crate::pipeline::neighbours::Together;
use crate::pipeline::stage::Stage;
use crate::progress::speaking_for;
use crate::results_folder::cores::Cores;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::product_folder::{FolderAccess, ProductFolder};
use crate::stages::joint::folders;
use crate::stages::table::{JOINT_STAGES, STAGES};

/// Stages of a test that the joint calibration needs.
const BEFORE: [&str; 5] = ["segment", "mesh", "experiments", "ensemble", "surrogate"];

/// A case with several tests, and the results folder in which its stages are run.
///
/// # Example
/// ```no_run
/// use std::sync::atomic::AtomicBool;
/// use models::{CaseFile, FolderAccess, JointWorkflow};
///
/// let interrupt = AtomicBool::new(false);
/// let case = CaseFile::read("fast-and-slow.toml".as_ref())?;
/// let access = FolderAccess::default();
/// let mut workflow = JointWorkflow::open(&case, "results".as_ref(), 2, &interrupt, &access)?;
/// workflow.run_all()?;
/// # Ok::<(), models::WorkflowError>(())
/// ```
#[derive(Debug)]
pub struct JointWorkflow<'a> {
    whole: Workflow<'a>,
    tests: Vec<(String, Workflow<'a>)>,
}

impl<'a> JointWorkflow<'a> {
    /// Opens the results folder `dir` for a case with several tests, and the folder `tests/NAME` of each test.
    ///
    /// # Errors
    /// The errors of [`Workflow::open_with`] for each folder.
    pub fn open(
        source: &CaseFile,
        dir: &Path,
        threads: usize,
        interrupt: &'a AtomicBool,
        access: &FolderAccess,
    ) -> Result<Self, WorkflowError> {
        let cores = Cores::new(threads);
        let singles = single_tests(source)?;
        for test in &singles {
            check_inputs(source, &dir.join(folders::of_test(&test.name)))?;
        }
        refuse_counted_twice(&singles)?;
        refuse_calibrated_by_others(&singles)?;
        let mut whole = Workflow::open_with(source, dir, threads, interrupt, access)?;
        let cases = singles.iter().map(|test| folders::of_test(&test.name)).collect();
        let folder = ProductFolder::new(dir, &access.replace);
        Together { laboratories: Vec::new(), cases }.write(dir, &folder)?;
        let mut tests = Vec::with_capacity(singles.len());
        for (rank, SingleTest { name, mut file, .. }) in singles.into_iter().enumerate() {
            let draws = folders::from_test(&folders::draws_of(&name));
            file.case.calibration.joint = Some(PathBuf::from(draws));
            let test_folder = dir.join(folders::of_test(&name));
            // the folders of the tests belong to the folder of the case, whose owner has been checked
            let access = FolderAccess { reuse: true, replace: access.replace.clone() };
            let workflow = Workflow::open_with(&file, &test_folder, threads, interrupt, &access)?;
            whole.copies.add_originals_of(&workflow.copies);
            tests.push((name, workflow.among(&cores, rank)));
        }
        Ok(Self { whole: whole.among(&cores, 0), tests })
    }

    /// Returns the same workflow, which calibrates even if the data are outside the range of the simulations. No
    /// parameter is then reported as identified.
    pub fn accept_out_of_range(self) -> Self {
        let accepting = |(name, test): (String, Workflow<'a>)| (name, test.accept_out_of_range());
        Self {
            whole: self.whole.accept_out_of_range(),
            tests: self.tests.into_iter().map(accepting).collect(),
        }
    }

    /// Runs every stage that is not finished, in the folders of the tests and in the folder of the case. The tests run
    /// concurrently and share the cores.
    ///
    /// # Errors
    /// The first error of a test in the order of the case, after the other tests have ended; the error of a joint stage.
    pub fn run_all(&mut self) -> Result<(), WorkflowError> {
        self.whole.check_ready()?;
        self.in_each(Workflow::check_ready)?;
        self.tests.iter().for_each(|(name, test)| {
            speaking_for(name, || test.report_before_runs());
        });
        let (before, after): (Vec<&Stage>, Vec<&Stage>) =
            STAGES.iter().partition(|stage| BEFORE.contains(&stage.name));
        self.in_each(|test| before.iter().try_for_each(|stage| test.make(stage)))?;
        let [calibrate, others @ ..] = &JOINT_STAGES;
        self.whole.make(calibrate)?;
        self.in_each(|test| after.iter().try_for_each(|stage| test.make(stage)))?;
        others.iter().try_for_each(|stage| self.whole.make(stage))
    }

    /// Runs one stage in the folder of each test, and then in the folder of the case, if the stage belongs to the
    /// joint calibration. The joint calibration precedes the calibrations of the tests, because the calibrations of
    /// the tests use the draws of the joint calibration.
    ///
    /// # Errors
    /// The errors of [`Workflow::run`].
    pub fn run(&mut self, stage: &'static Stage) -> Result<(), WorkflowError> {
        let joint = JOINT_STAGES.iter().find(|joint_stage| joint_stage.name == stage.name);
        if stage.name == "calibrate" {
            self.in_each(|test| test.check_stages(&BEFORE))?;
            joint.map_or(Ok(()), |joint| self.whole.make(joint))?;
            return self.in_each(|test| test.run(stage));
        }
        self.in_each(|test| test.run(stage))?;
        match joint {
            Some(joint) => {
                self.whole.check_what_it_read(joint)?;
                self.whole.make(joint)
            }
            None => Ok(()),
        }
    }

    /// Computes a share of the runs of a stage in the folder of each test, sequentially.
    ///
    /// # Errors
    /// The errors of [`Workflow::share`].
    pub fn share(&self, stage: &'static Stage) -> Result<(), WorkflowError> {
        let share =
            |(name, test): &(String, Workflow<'_>)| speaking_for(name, || test.share(stage));
        self.tests.iter().try_for_each(share)
    }

    /// The folders of the tests, with their names.
    pub fn tests(&self) -> impl Iterator<Item = (&str, &Workflow<'a>)> {
        self.tests.iter().map(|(name, test)| (name.as_str(), test))
    }

    /// The results folder of the case.
    pub fn dir(&self) -> &Path {
        self.whole.dir()
    }

    /// Calls `work` for all tests concurrently. Messages have the name of the test.
    fn in_each(
        &mut self,
        work: impl Fn(&Workflow<'a>) -> Result<(), WorkflowError> + Sync,
    ) -> Result<(), WorkflowError> {
        let work = &work;
        let ended: Vec<Result<(), WorkflowError>> = std::thread::scope(|scope| {
            let mut threads = Vec::with_capacity(self.tests.len());
            for (name, test) in &mut self.tests {
                threads.push(scope.spawn(move || speaking_for(name, || work(test))));
            }
            let end = |thread: std::thread::ScopedJoinHandle<'_, _>| {
                thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            };
            threads.into_iter().map(end).collect()
        });
        ended.into_iter().collect()
    }
}
