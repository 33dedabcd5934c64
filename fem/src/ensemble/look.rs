//! A look at an ensemble from outside, which changes nothing.

use std::fs::{self, File, TryLockError};
use std::path::Path;

use super::record_file::StoredRun;
use super::store::{Store, run_of_lock, run_of_record};
use super::{EnsembleError, RunRecord};

/// What an ensemble's directory holds at this moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EnsembleState {
    /// Runs that are finished or have failed, by their number.
    pub records: Vec<RunRecord>,
    /// Numbers of the runs that a process is making now, on whatever machine.
    pub under_way: Vec<usize>,
    /// Numbers of the runs whose files cannot be read: they will be made again.
    pub damaged: Vec<usize>,
    /// Numbers of the runs whose checksum is missing or does not match: an ensemble that needs them stops.
    pub edited: Vec<usize>,
}

impl EnsembleState {
    /// Looks at the directory of an ensemble, which processes may be writing to; of one that is not there
    /// nothing is found.
    ///
    /// Whether a run is under way is known from its lock, not from a clock: the lock of a process that was
    /// killed is gone.
    ///
    /// # Errors
    /// [`EnsembleError::Io`] if the directory or a file cannot be read.
    pub fn of(directory: &Path) -> Result<EnsembleState, EnsembleError> {
        let entries = match fs::read_dir(directory) {
            Ok(entries) => entries,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Ok(EnsembleState::default());
            }
            Err(error) => return Err(EnsembleError::io("read", directory, error)),
        };
        let (mut recorded, mut locks) = (Vec::new(), Vec::new());
        for entry in entries {
            let entry = entry.map_err(|e| EnsembleError::io("read", directory, e))?;
            let name = entry.file_name();
            let name = name.to_string_lossy();
            if let Some(id) = run_of_record(&name) {
                recorded.push(id);
            } else if let Some(id) = run_of_lock(&name)
                && is_locked(&entry.path())
            {
                locks.push(id);
            }
        }
        recorded.sort_unstable();
        locks.sort_unstable();
        let store = Store::at(directory);
        let mut state = EnsembleState::default();
        for id in recorded {
            match store.read(id)? {
                StoredRun::Record(record) => state.records.push(record),
                StoredRun::Damaged(_) => state.damaged.push(id),
                StoredRun::Edited(_) => state.edited.push(id),
                StoredRun::Nothing => {}
            }
        }
        // a failed run that is made again has a record and a lock; one just written has both for a moment
        locks.retain(|id| !state.records.iter().any(|record| record.id == *id));
        state.under_way = locks;
        Ok(state)
    }
}

/// Whether a process holds the lock. A worker that comes while this one looks finds it taken for that
/// moment, and comes again.
fn is_locked(path: &Path) -> bool {
    File::open(path)
        .is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
}
