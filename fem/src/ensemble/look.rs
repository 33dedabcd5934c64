//! The state of an ensemble, read from its directory without changing it.

use std::fs::{self, File, TryLockError};
use std::path::Path;

use super::record_file::StoredRun;
use super::store::{Store, run_of_lock, run_of_record};
use super::{EnsembleError, RunRecord};

/// The current content of an ensemble's directory.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct EnsembleState {
    /// Records of runs that have finished or failed, in the order of their numbers.
    pub records: Vec<RunRecord>,
    /// Numbers of the runs that a process on any machine is computing.
    pub under_way: Vec<usize>,
    /// Numbers of the runs whose files are damaged; these runs will be computed again.
    pub damaged: Vec<usize>,
    /// Numbers of the runs whose checksum is missing or does not match. An ensemble that needs one of these
    /// runs returns an error.
    pub edited: Vec<usize>,
}

impl EnsembleState {
    /// Reads the state of an ensemble from its directory while processes may be writing to it. The state is
    /// empty if the directory does not exist.
    ///
    /// A run is in progress if its lock is held. The test needs no clock, because the operating system releases the
    /// lock of a killed process.
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
        // a run that has a record is not under way, even if a process still holds its lock to retry it or is about to
        // remove the lock
        locks.retain(|id| !state.records.iter().any(|record| record.id == *id));
        state.under_way = locks;
        Ok(state)
    }
}

/// Whether a process holds the lock. The test holds a shared lock for a very short time. A worker that tries to lock
/// the run during this time repeats its attempt after a short delay.
fn is_locked(path: &Path) -> bool {
    File::open(path)
        .is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
}
