//! Runs an ensemble.

use std::any::Any;
use std::collections::{BTreeSet, VecDeque};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::record::RunResults;
use super::record_file::StoredRun;
use super::store::Store;
use super::{EnsembleError, EnsembleProgress, RunEnd, RunInput, RunRecord, RunStatus};
use crate::error::FemError;
use crate::problem::{End, Outcome};

/// Delay before a run that another process has locked is checked again.
const WAIT: Duration = Duration::from_millis(200);

/// Function that computes one run. The first argument is the input of the run; the second argument is a function to
/// which the completed fraction of the run is reported.
type Job<'a> = &'a (dyn Fn(&RunInput, &dyn Fn(f64)) -> Result<Outcome, FemError> + Sync);

/// A function that each run calls before it starts. The function may block; its result is dropped when the run ends.
struct Turn(Box<dyn Fn() -> Box<dyn Any> + Send + Sync>);

impl std::fmt::Debug for Turn {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Turn")
    }
}

/// A condition on the record of a failed run; if it holds, the run is computed again.
struct Retry(Box<dyn Fn(&RunRecord) -> bool + Send + Sync>);

impl std::fmt::Debug for Retry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Retry")
    }
}

/// A directory of runs that belong together.
///
/// Every finished run is one file, which is written completely before it gets its name. If the program is
/// killed, only runs in progress are lost; the same command resumes the ensemble. Several processes can share
/// the directory, on one machine or on several machines with a common file system that supports locks. A
/// process locks each run while it computes the run, and the operating system releases the lock when the
/// process ends. Time stamps are not used, so the clocks of the machines may differ. A failed run is recorded
/// with the reason of its failure, and the other runs continue.
///
/// Requirements on the file system: renaming a file is atomic, and a lock (`flock`) that one machine holds is
/// visible on all machines. If locks are not supported, [`Self::open`] or [`Self::run`] returns an error. If
/// locks are visible on one machine only, a run may be computed twice: the first record is kept, and the
/// second process reports a warning ([`EnsembleProgress::warning`]).
///
/// # Example
/// ```
/// use fem::{Ensemble, End, Outcome, RunInput, RunStatus};
/// use std::sync::atomic::AtomicBool;
///
/// # let directory = std::env::temp_dir().join(format!("fem-doc-ensemble-{}", std::process::id()));
/// let ensemble = Ensemble::open(&directory, "mesh = cylinder 0.7\nload = 0.22 mm")?;
/// let runs = [1.0, 2.0].map(|x| RunInput { id: x as usize, inputs: vec![250.0 * x] });
/// let records = ensemble.run(
///     &runs,
///     &["young_mpa"],
///     2,
///     &|_run, _done| {
///         // here a compression test runs with the material of `run.inputs`
///         Ok(Outcome {
///             curve: vec![],
///             end: End::Displacement,
///             ..Outcome::default()
///         })
///     },
///     &(),
///     &AtomicBool::new(false),
/// )?;
/// assert_eq!(records[1].status, RunStatus::Finished);
/// # std::fs::remove_dir_all(directory).ok();
/// # Ok::<(), fem::EnsembleError>(())
/// ```
#[derive(Debug)]
pub struct Ensemble {
    store: Store,
    /// Condition on the record of a failed run; if it holds, the run is computed again. `None`: no failed run is
    /// computed again.
    retry: Option<Retry>,
    leave_to_others: bool,
    turn: Turn,
}

impl Ensemble {
    /// Opens the directory of an ensemble, or creates it.
    ///
    /// `fingerprint` is a text that describes everything that makes the runs comparable (mesh, loading, fixed
    /// parameters, design), ideally one setting per line. This text is stored and compared line by line; error messages
    /// quote the lines that differ.
    ///
    /// # Errors
    /// [`EnsembleError::Foreign`] if the directory has another fingerprint, [`EnsembleError::Manifest`] or
    /// [`EnsembleError::Io`] if the directory cannot be used.
    pub fn open(directory: impl AsRef<Path>, fingerprint: &str) -> Result<Ensemble, EnsembleError> {
        let store = Store::open(directory.as_ref(), fingerprint)?;
        let turn = Turn(Box::new(|| Box::new(())));
        Ok(Ensemble { store, retry: None, leave_to_others: false, turn })
    }

    /// Sets whether runs that are recorded as failed are computed again (default: no).
    pub fn retry_failed(self, retry: bool) -> Ensemble {
        match retry {
            true => self.retry_failed_if(|_| true),
            false => Ensemble { retry: None, ..self },
        }
    }

    /// Sets a condition on the records of failed runs; the runs that meet the condition are computed again.
    ///
    /// # Example
    /// Computes the runs again that failed with an earlier time limit:
    /// ```no_run
    /// # fn main() -> Result<(), fem::EnsembleError> {
    /// use fem::{Ensemble, RunStatus};
    /// let is_of_other_limit = |run: &fem::RunRecord| match &run.status {
    ///     RunStatus::Failed(reason) => !reason.ends_with("(limit 600 s)"),
    ///     RunStatus::Finished => false,
    /// };
    /// let ensemble = Ensemble::open("runs", "solver = 1.0")?.retry_failed_if(is_of_other_limit);
    /// # Ok(())
    /// # }
    /// ```
    pub fn retry_failed_if(
        self,
        condition: impl Fn(&RunRecord) -> bool + Send + Sync + 'static,
    ) -> Ensemble {
        Ensemble { retry: Some(Retry(Box::new(condition))), ..self }
    }

    /// Sets whether [`Self::run`] returns as soon as other processes are computing all missing runs (default: no). By
    /// default, [`Self::run`] waits for these runs, and computes a run itself if the other process ends without writing
    /// a record.
    pub fn leave_to_others(mut self, leave: bool) -> Ensemble {
        self.leave_to_others = leave;
        self
    }

    /// Sets a function that each run calls before it starts; the function's result is dropped when the run ends. The
    /// function may block, to limit the number of computations on a machine that several ensembles share. The default
    /// function does nothing.
    pub fn in_turn(self, turn: impl Fn() -> Box<dyn Any> + Send + Sync + 'static) -> Ensemble {
        Ensemble { turn: Turn(Box::new(turn)), ..self }
    }

    /// Computes all runs that are not stored yet, and returns the records in the order of `runs`.
    ///
    /// `names` are the names of the inputs, with units. `threads` runs are computed at once (0: one per processor).
    /// `job` computes a run; the second argument of `job` is a function that reports the completed fraction. If
    /// `interrupt` is true, an outcome with [`End::Interrupted`](crate::End) is not recorded. If a job panics, the run
    /// is recorded as failed. [`FemError::FailsInEveryRun`] ends the call with an error.
    ///
    /// After `interrupt` becomes true, no further run is started, and only the existing records are returned.
    /// To end runs in progress, the job must check `interrupt` too.
    ///
    /// # Errors
    /// [`EnsembleError`] if the runs do not match `names` or the stored runs, if a file cannot be read or
    /// written, or if `job` returns [`FemError::FailsInEveryRun`]. Failed runs are not errors.
    pub fn run(
        &self,
        runs: &[RunInput],
        names: &[&str],
        threads: usize,
        job: Job<'_>,
        progress: &dyn EnsembleProgress,
        interrupt: &AtomicBool,
    ) -> Result<Vec<RunRecord>, EnsembleError> {
        check(runs, names)?;
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|source| EnsembleError::Threads { threads, source })?;
        let call = EnsembleCall {
            ensemble: self,
            runs,
            names,
            job,
            progress,
            interrupt,
            state: Mutex::default(),
        };
        call.begin()?;
        // each thread of the pool takes runs from the queue; parallel work inside a run uses the same pool
        pool.broadcast(|_| call.work());

        let Queue { records, error, .. } =
            call.state.into_inner().unwrap_or_else(PoisonError::into_inner);
        match error {
            Some(error) => Err(error),
            None => Ok(records.into_iter().flatten().collect()),
        }
    }
}

fn check(runs: &[RunInput], names: &[&str]) -> Result<(), EnsembleError> {
    let mut ids = BTreeSet::new();
    for RunInput { id, inputs } in runs {
        let wrong = |message| Err(EnsembleError::Run { id: *id, message });
        if !ids.insert(id) {
            return wrong("two runs have this number; give each run a unique number".into());
        }
        if inputs.len() != names.len() {
            let (values, names) = (inputs.len(), names.len());
            return wrong(format!(
                "{values} inputs for {names} names; give one value for each name"
            ));
        }
        if let Some((name, x)) = names.iter().zip(inputs).find(|(_, x)| !x.is_finite()) {
            return wrong(format!("{name} = {x} is not finite; give a finite number"));
        }
    }
    Ok(())
}

/// The arguments and the shared state of one call of [`Ensemble::run`].
struct EnsembleCall<'a> {
    ensemble: &'a Ensemble,
    runs: &'a [RunInput],
    names: &'a [&'a str],
    job: Job<'a>,
    progress: &'a dyn EnsembleProgress,
    interrupt: &'a AtomicBool,
    state: Mutex<Queue>,
}

/// The runs of one call of [`Ensemble::run`]: their records, their progress, and the queue of the runs that still have
/// to be computed.
#[derive(Default)]
struct Queue {
    /// Record of each run; None until the run has ended.
    records: Vec<Option<RunRecord>>,
    /// Completed fraction of each run.
    fractions: Vec<f64>,
    /// Indices of the runs to be computed. The flag is true if another process held the lock of the run at the last
    /// attempt.
    queue: VecDeque<(usize, bool)>,
    /// The error that ends the call, if any.
    error: Option<EnsembleError>,
}

/// Result of an attempt to compute a run.
#[expect(clippy::large_enum_variant, reason = "there is one value at a time")]
enum Attempt {
    Ended(RunRecord),
    /// The run was not computed, because another process is computing it.
    Elsewhere,
    Interrupted,
}

impl EnsembleCall<'_> {
    fn state(&self) -> MutexGuard<'_, Queue> {
        // a poisoned lock is safe to use: jobs, which may panic, never run while the lock is held
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads the stored records and puts the runs without a record into the queue.
    fn begin(&self) -> Result<(), EnsembleError> {
        let records = self
            .runs
            .iter()
            .map(|run| Ok(self.stored(run)?.filter(|record| !self.is_to_be_retried(record))))
            .collect::<Result<Vec<_>, EnsembleError>>()?;
        let mut state = self.state();
        state.fractions = records.iter().map(|record| record.is_some() as u8 as f64).collect();
        state.queue =
            (0..records.len()).filter(|&k| records[k].is_none()).map(|k| (k, false)).collect();
        state.records = records;
        drop(state);
        self.report_progress();
        Ok(())
    }

    fn is_to_be_retried(&self, record: &RunRecord) -> bool {
        let retry = self.ensemble.retry.as_ref();
        record.status != RunStatus::Finished && retry.is_some_and(|retry| (retry.0)(record))
    }

    /// Returns the stored record of a run; `None` if there is no file or the file is damaged.
    fn stored(&self, run: &RunInput) -> Result<Option<RunRecord>, EnsembleError> {
        let path = || self.ensemble.store.path(run.id);
        match self.ensemble.store.read(run.id)? {
            StoredRun::Nothing => Ok(None),
            StoredRun::Damaged(reason) => {
                let path = path();
                self.progress.warning(&format!(
                    "{} is damaged ({reason}); run {} is computed again",
                    path.display(),
                    run.id
                ));
                Ok(None)
            }
            StoredRun::Edited(reason) => {
                Err(EnsembleError::Edited { id: run.id, path: path(), reason })
            }
            StoredRun::Record(record)
                if record.names == self.names && record.inputs == run.inputs =>
            {
                Ok(Some(record))
            }
            StoredRun::Record(record) => Err(EnsembleError::OtherInputs {
                id: run.id,
                path: path(),
                stored: RunRecord::described(&record.names, &record.inputs),
                asked: RunRecord::described(self.names, &run.inputs),
            }),
        }
    }

    /// The loop that each thread executes: computes runs from the queue until the queue is empty.
    fn work(&self) {
        while !self.interrupt.load(Ordering::Relaxed) {
            let next = {
                let mut state = self.state();
                if state.error.is_some() { None } else { state.queue.pop_front() }
            };
            let Some((k, was_elsewhere)) = next else { return };
            if was_elsewhere {
                std::thread::sleep(WAIT);
            }
            // `turn` may block: call it before the run is locked, so that another process can compute the run
            // meanwhile
            let turn = (self.ensemble.turn.0)();
            let attempt = match self.interrupt.load(Ordering::Relaxed) {
                true => Ok(Attempt::Interrupted),
                false => self.attempt(k),
            };
            drop(turn);
            match attempt {
                Ok(Attempt::Ended(record)) => {
                    let mut state = self.state();
                    state.fractions[k] = 1.0;
                    state.records[k] = Some(record);
                }
                Ok(Attempt::Elsewhere) if self.ensemble.leave_to_others => {}
                Ok(Attempt::Elsewhere) => self.state().queue.push_back((k, true)),
                Ok(Attempt::Interrupted) => return,
                Err(error) => {
                    self.state().error.get_or_insert(error);
                }
            }
            self.report_progress();
        }
    }

    fn attempt(&self, k: usize) -> Result<Attempt, EnsembleError> {
        let run = &self.runs[k];
        let store = &self.ensemble.store;
        let before = match self.ensemble.retry.is_some() {
            true => self.stored(run)?,
            false => None,
        };
        let Some(_lock) = store.lock(run.id)? else { return Ok(Attempt::Elsewhere) };
        // another process may have finished this run after the queue was filled
        if let Some(record) = self.stored(run)?
            && !(self.is_to_be_retried(&record) && before.as_ref() == Some(&record))
        {
            store.remove_lock(run.id);
            return Ok(Attempt::Ended(record));
        }
        self.progress.started(run.id);
        let Some(record) = self.compute(k)? else { return Ok(Attempt::Interrupted) };
        // if a record exists now, another process has computed the same run although this process held the lock
        match store.read(run.id)? {
            StoredRun::Record(other) if !self.is_to_be_retried(&other) => {
                self.warn_of_second_computation(run.id);
                return Ok(Attempt::Ended(other));
            }
            StoredRun::Edited(reason) => {
                return Err(EnsembleError::Edited { id: run.id, path: store.path(run.id), reason });
            }
            StoredRun::Damaged(_) => {
                let aside = store.set_aside(run.id)?;
                let message = format!("the damaged file was renamed to {}", aside.display());
                self.progress.warning(&message);
            }
            StoredRun::Record(_) | StoredRun::Nothing => {}
        }
        store.write(&record)?;
        store.remove_lock(run.id);
        self.progress.ended(&record);
        Ok(Attempt::Ended(record))
    }

    fn warn_of_second_computation(&self, id: usize) {
        self.progress.warning(&format!(
            "run {id} was computed twice: another process wrote {} first, and the record of that process is used. \
             File locks of this file system are not visible on all machines: use one machine, or another file \
             system",
            self.ensemble.store.path(id).display()
        ));
    }

    /// Computes run number `k` of the call and returns its record; `None` if the computation was interrupted.
    ///
    /// # Errors
    /// [`EnsembleError::FailsInEveryRun`].
    fn compute(&self, k: usize) -> Result<Option<RunRecord>, EnsembleError> {
        let run = &self.runs[k];
        let done = |fraction: f64| {
            // a fraction of 1 does not mean that the run is finished: a run is finished when its record has been
            // written
            self.state().fractions[k] = fraction.clamp(0.0, 1.0);
            self.progress.advanced(run.id, fraction);
            self.report_progress();
        };
        let start = Instant::now();
        let outcome = catch_unwind(AssertUnwindSafe(|| (self.job)(run, &done)));
        let seconds = start.elapsed().as_secs_f64();
        let (mut end, mut results) = match outcome {
            Ok(Ok(Outcome { end, curve, sensitivities, values, .. })) => {
                let end = match end {
                    End::Displacement => Ok(RunEnd::Displacement),
                    End::BelowPeak => Ok(RunEnd::BelowPeak),
                    End::LimitLoad => Ok(RunEnd::LimitLoad),
                    End::Failed(error) => Err(error.to_string()),
                    End::Interrupted if self.interrupt.load(Ordering::Relaxed) => return Ok(None),
                    End::Interrupted => Err("the run was stopped by its observer".into()),
                };
                (end, RunResults { curve, sensitivities, values })
            }
            Ok(Err(FemError::FailsInEveryRun(message))) => {
                self.ensemble.store.remove_lock(run.id);
                return Err(EnsembleError::FailsInEveryRun { message });
            }
            Ok(Err(error)) => (Err(error.to_string()), RunResults::default()),
            Err(panic) => {
                let text = panic
                    .downcast_ref::<String>()
                    .map(String::as_str)
                    .or_else(|| panic.downcast_ref::<&str>().copied())
                    .unwrap_or("no message");
                let reason = format!("the simulation panicked: {text}");
                (Err(reason), RunResults::default())
            }
        };
        // JSON cannot represent infinite values: a record with an infinite value could be written but not read
        let RunResults { curve, sensitivities, values } = &mut results;
        let finite = curve.iter().take_while(|point| point.is_finite()).count();
        let rows = &sensitivities.force_n;
        let rows = rows.iter().take_while(|row| row.iter().all(|x| x.is_finite())).count();
        if finite < curve.len() || rows < sensitivities.force_n.len() {
            curve.truncate(finite);
            sensitivities.force_n.truncate(rows.min(finite));
            end =
                Err("the curve, or the derivative of a force, has values that are not finite"
                    .into());
        }
        if let Some((name, value)) = values.iter().find(|(_, value)| !value.is_finite()) {
            end = Err(format!("{name} = {value} is not a finite number"));
            values.retain(|_, value| value.is_finite());
        }
        Ok(Some(RunRecord::new(run, self.names, end, results, seconds)))
    }

    fn report_progress(&self) {
        let (finished, total, fraction) = {
            let state = self.state();
            let total = state.records.len();
            let finished = state.records.iter().flatten().count();
            (finished, total, state.fractions.iter().sum::<f64>() / total.max(1) as f64)
        };
        self.progress.update(finished, total, fraction);
    }
}
