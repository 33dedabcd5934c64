//! Locks of a results folder, which ensure that only one of several processes writes the products of a
//! stage.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use super::error::WorkflowError;
use crate::progress::say;

/// Folder of the lock files; it exists once a stage has been started.
pub(crate) const FOLDER: &str = ".locks";

/// Time between two attempts to take a lock.
const WAIT: Duration = Duration::from_millis(200);

/// Waits for the lock `name` of the folder and takes the lock; if waiting is necessary, prints a message under the
/// name of `stage`. The lock is released when the returned file is dropped, or when the process ends for any reason.
///
/// # Errors
/// [`WorkflowError::Interrupted`] while waiting; an error if the file system does not support locks.
pub(crate) fn lock(
    dir: &Path,
    name: &str,
    stage: &str,
    interrupt: &AtomicBool,
) -> Result<File, WorkflowError> {
    let path = lock_path(dir, name);
    let folder = dir.join(FOLDER);
    std::fs::create_dir_all(&folder).map_err(|e| WorkflowError::io(&folder, e))?;
    let mut options = OpenOptions::new();
    let mut file = options
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .open(&path)
        .map_err(|e| WorkflowError::io(&path, e))?;
    let mut is_reported = false;
    loop {
        match file.try_lock() {
            Ok(()) => break,
            Err(TryLockError::WouldBlock) if interrupt.load(Ordering::Relaxed) => {
                return Err(WorkflowError::Interrupted);
            }
            Err(TryLockError::WouldBlock) => {
                if !std::mem::replace(&mut is_reported, true) {
                    say(stage, &format!("waiting for {}", holder_of(&mut file)));
                }
                std::thread::sleep(WAIT);
            }
            Err(TryLockError::Error(source)) => return Err(WorkflowError::Lock { path, source }),
        }
    }
    // the content of the file is information for users; the lock is valid even if this write fails
    let _ = file
        .set_len(0)
        .and_then(|()| write!(file, "process {} on {}", std::process::id(), machine()));
    Ok(file)
}

/// Returns a description of the process that holds a lock, if there is one. Changes nothing.
pub(crate) fn holder(dir: &Path, name: &str) -> Option<String> {
    let mut file = File::open(lock_path(dir, name)).ok()?;
    match file.try_lock_shared() {
        Err(TryLockError::WouldBlock) => Some(holder_of(&mut file)),
        _ => None,
    }
}

/// Whether a stage has ever been started in the folder.
pub(crate) fn has_locks(dir: &Path) -> bool {
    dir.join(FOLDER).is_dir()
}

fn lock_path(dir: &Path, name: &str) -> PathBuf {
    dir.join(FOLDER).join(name)
}

fn holder_of(file: &mut File) -> String {
    let mut text = String::new();
    match file.read_to_string(&mut text) {
        Ok(_) if !text.is_empty() => text,
        _ => "another process".to_owned(),
    }
}

/// Name of this machine; "this machine" if unknown.
fn machine() -> String {
    let named = |variable| std::env::var(variable).ok().filter(|name| !name.is_empty());
    named("SLURMD_NODENAME")
        .or_else(|| std::fs::read_to_string("/proc/sys/kernel/hostname").ok())
        .or_else(|| named("HOSTNAME"))
        .map_or_else(|| "this machine".to_owned(), |name| name.trim().to_owned())
}
