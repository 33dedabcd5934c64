//! The directory of an ensemble: its manifest, one file per run, and locks that are released when their
//! process ends.

use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::record_file::{self, Checksums, StoredRun};
use super::{EnsembleError, RunRecord};
use fem_file::{read_regular, write_atomically};

const MANIFEST: &str = "ensemble.json";
/// The format of the files that this version writes, in which each record has a checksum.
const FORMAT: u32 = 2;
/// The older format of the files, in which records have no checksums. Records without checksums are accepted in a
/// directory whose manifest has this format.
const WITHOUT_CHECKSUMS: u32 = 1;
/// Longest time for which a process holds the shared lock of a run to test whether the run is in progress.
const MOMENT: Duration = Duration::from_millis(30);

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Manifest {
    format: u32,
    fingerprint: String,
}

/// The files of an ensemble.
#[derive(Debug)]
pub(super) struct Store {
    directory: PathBuf,
    checksums: Checksums,
}

impl Store {
    /// Returns the files of an ensemble's directory without checking the fingerprint.
    pub(super) fn at(directory: &Path) -> Store {
        let manifest = read_regular(&directory.join(MANIFEST)).ok();
        let manifest = manifest.and_then(|bytes| serde_json::from_slice(&bytes).ok());
        let format = manifest.map_or(FORMAT, |manifest: Manifest| manifest.format);
        Store { directory: directory.into(), checksums: checksums_of(format) }
    }

    /// Opens a directory and checks its fingerprint, or creates the directory with this fingerprint.
    pub(super) fn open(directory: &Path, fingerprint: &str) -> Result<Store, EnsembleError> {
        fs::create_dir_all(directory).map_err(|e| EnsembleError::io("create", directory, e))?;
        let mut store = Store { directory: directory.into(), checksums: Checksums::Required };
        let path = directory.join(MANIFEST);

        // if several processes start at once, only one of them writes the manifest
        let lock_path = directory.join(".ensemble.lock");
        let lock =
            File::create(&lock_path).map_err(|e| EnsembleError::io("open", &lock_path, e))?;
        lock.lock().map_err(|source| EnsembleError::Lock { path: lock_path, source })?;
        if !path.exists() {
            let manifest = Manifest { format: FORMAT, fingerprint: fingerprint.into() };
            return store.write_json(MANIFEST, &manifest).map(|()| store);
        }

        let bytes = read_regular(&path).map_err(|e| EnsembleError::io("read", &path, e))?;
        let manifest: Manifest = serde_json::from_slice(&bytes)
            .map_err(|source| EnsembleError::Manifest { path: path.clone(), source })?;
        if !(WITHOUT_CHECKSUMS..=FORMAT).contains(&manifest.format) {
            return Err(EnsembleError::Format { path, found: manifest.format, expected: FORMAT });
        }
        if manifest.fingerprint != fingerprint {
            return Err(EnsembleError::Foreign {
                directory: directory.into(),
                difference: difference(&manifest.fingerprint, fingerprint),
            });
        }
        store.checksums = checksums_of(manifest.format);
        Ok(store)
    }

    pub(super) fn path(&self, id: usize) -> PathBuf {
        self.directory.join(file_name(id))
    }

    pub(super) fn read(&self, id: usize) -> Result<StoredRun, EnsembleError> {
        let path = self.path(id);
        let bytes = match read_regular(&path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                return Ok(StoredRun::Nothing);
            }
            Err(error) => return Err(EnsembleError::io("read", &path, error)),
        };
        Ok(record_file::parse(&bytes, id, self.checksums))
    }

    /// Writes a record atomically: at any moment either the whole file or no file exists. The caller must
    /// hold the lock of the run.
    pub(super) fn write(&self, record: &RunRecord) -> Result<(), EnsembleError> {
        let path = self.path(record.id);
        record_file::to_bytes(record)
            .and_then(|bytes| write_atomically(&path, &bytes))
            .map_err(|source| EnsembleError::Write { path, source })
    }

    /// Renames a file that is not a record of its run, and returns the new path. The run can then be computed
    /// again, and the content of the file is kept. The caller must hold the lock of the run.
    pub(super) fn set_aside(&self, id: usize) -> Result<PathBuf, EnsembleError> {
        let path = self.path(id);
        let name = |k: usize| match k {
            0 => format!("{}.damaged", file_name(id)),
            _ => format!("{}.damaged-{k}", file_name(id)),
        };
        let aside = (0..).map(|k| self.directory.join(name(k))).find(|aside| !aside.exists());
        let aside = aside.expect("a folder has finitely many files");
        match fs::rename(&path, &aside) {
            Ok(()) => Ok(aside),
            Err(error) => Err(EnsembleError::io("rename", &path, error)),
        }
    }

    fn write_json(&self, name: &str, value: &impl Serialize) -> Result<(), EnsembleError> {
        let path = self.directory.join(name);
        let write = || -> std::io::Result<()> {
            let mut bytes = serde_json::to_vec_pretty(value)?;
            bytes.push(b'\n');
            write_atomically(&path, &bytes)
        };
        write().map_err(|source| EnsembleError::Write { path, source })
    }

    /// Locks a run for this process. Returns `None` if another process holds the lock. The operating system releases
    /// the lock when the file is closed or the process ends in any way.
    pub(super) fn lock(&self, id: usize) -> Result<Option<File>, EnsembleError> {
        let path = self.lock_path(id);
        let file = File::create(&path).map_err(|e| EnsembleError::io("open", &path, e))?;
        let mut locked = file.try_lock();
        if matches!(locked, Err(TryLockError::WouldBlock)) {
            // wait, because a process that only reads the state of the ensemble releases its shared lock within
            // `MOMENT`
            std::thread::sleep(MOMENT);
            locked = file.try_lock();
        }
        match locked {
            Ok(()) => Ok(Some(file)),
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(source)) => Err(EnsembleError::Lock { path, source }),
        }
    }

    /// Removes the lock file of a run.
    ///
    /// Call this method only after the record of the run has been written: a process that locks the removed
    /// file afterwards finds the record and does not compute the run.
    pub(super) fn remove_lock(&self, id: usize) {
        // ignore the error: a lock file that was not removed has no effect
        let _ = fs::remove_file(self.lock_path(id));
    }

    fn lock_path(&self, id: usize) -> PathBuf {
        self.directory.join(format!(".{}.lock", file_name(id)))
    }
}

fn checksums_of(format: u32) -> Checksums {
    if format == WITHOUT_CHECKSUMS { Checksums::Optional } else { Checksums::Required }
}

/// Returns the run number in the file name of a record; `None` for other file names.
pub(super) fn run_of_record(name: &str) -> Option<usize> {
    name.strip_prefix("run-")?.strip_suffix(".json")?.parse().ok()
}

/// Returns the run number in the file name of a lock; `None` for other file names.
pub(super) fn run_of_lock(name: &str) -> Option<usize> {
    run_of_record(name.strip_prefix('.')?.strip_suffix(".lock")?)
}

fn file_name(id: usize) -> String {
    format!("run-{id:06}.json")
}

/// Describes the lines in which two fingerprints differ.
fn difference(stored: &str, asked: &str) -> String {
    let only_in = |a: &str, b: &str| -> String {
        let lines: Vec<String> = a
            .lines()
            .filter(|line| !b.lines().any(|other| other == *line))
            .take(5)
            .map(|line| format!("`{}`", line.trim()))
            .collect();
        if lines.is_empty() { "no further settings".into() } else { lines.join(", ") }
    };
    format!("stored: {}; requested: {}", only_in(stored, asked), only_in(asked, stored))
}
