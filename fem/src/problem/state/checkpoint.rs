//! Checkpoint of a run, from which the run resumes with bitwise the same result as an uninterrupted run.
//!
//! A file contains the line `breccia-state 12`, the fingerprint of the problem and the state in postcard's format, and
//! a checksum of everything before it (FNV-1a, u64, little endian). Data that the linear solver reuses from step to
//! step is not included: a run with a checkpoint discards this data whenever it saves.

use std::io::{self, ErrorKind};
use std::path::PathBuf;

use super::state::RunState;
use crate::error::{CheckpointError, FemError};
use crate::parallel::Ranks;
use crate::problem::definition::Fingerprint;
use fem_file::{read_regular, write_atomically};

/// File in which a run saves its state, and the number of load steps between saves.
///
/// # Example
/// ```no_run
/// # fn go(problem: fem::Problem) -> Result<(), fem::FemError> {
/// let checkpoint = fem::Checkpoint { path: "run.state".into(), every: 10 };
/// // starts from the unloaded body the first time; after an interruption, resumes from the last saved step
/// let outcome = problem.run_resumable(&checkpoint, &mut ())?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// Path of the file. The file is replaced atomically, so it is never incomplete.
    pub path: PathBuf,
    /// Number of load steps between two saves, at least 1.
    pub every: u32,
}

/// First bytes of a file of any version of the format.
const MAGIC: &[u8] = b"breccia-state ";
/// First line of a file of this version of the format.
const VERSION: &[u8] = b"breccia-state 12\n";

impl Checkpoint {
    /// Writes a state to the file.
    pub(crate) fn save(&self, state: &RunState, fingerprint: u64) -> Result<(), FemError> {
        postcard::to_extend(&(fingerprint, state), VERSION.to_vec())
            .map_err(io::Error::other)
            .and_then(|mut bytes| {
                let sum = Fingerprint::new().add(&bytes).value();
                bytes.extend(sum.to_le_bytes());
                write_atomically(&self.path, &bytes)
            })
            .map_err(|error| FemError::io("write", &self.path, error))
    }

    /// Reads the state; `None` if there is no file. The first rank reads the file for all ranks.
    pub(crate) fn load(
        &self,
        fingerprint: u64,
        ranks: &Ranks,
    ) -> Result<Option<RunState>, FemError> {
        let read = match ranks.is_first().then(|| read_regular(&self.path)) {
            None => Ok(Vec::new()),
            Some(Err(error)) if error.kind() == ErrorKind::NotFound => Ok(Vec::new()),
            // append a byte, so that the message for an empty file differs from the message for a missing file
            Some(Ok(bytes)) => Ok([&bytes[..], b" "].concat()),
            Some(Err(error)) => Err(FemError::io("read", &self.path, error)),
        };
        let read = ranks.agreed(read)?;
        let first = ranks.gather(&read).swap_remove(0);
        let Some((_, bytes)) = first.split_last() else { return Ok(None) };
        decode(bytes, fingerprint)
            .map(Some)
            .map_err(|source| FemError::Checkpoint { path: self.path.clone(), source })
    }

    pub(crate) fn validate(&self) -> Result<(), FemError> {
        if self.every > 0 {
            return Ok(());
        }
        Err(FemError::parameter("checkpoint", "every", 0.0, "at least 1 load step"))
    }
}

fn decode(bytes: &[u8], fingerprint: u64) -> Result<RunState, CheckpointError> {
    let damaged = CheckpointError::Damaged;
    let (body, sum) = bytes.split_last_chunk::<8>().ok_or(damaged)?;
    if Fingerprint::new().add(body).value() != u64::from_le_bytes(*sum) || !body.starts_with(MAGIC)
    {
        return Err(damaged);
    }
    let content = body.strip_prefix(VERSION).ok_or(CheckpointError::Version)?;
    let (stored_fingerprint, content) =
        postcard::take_from_bytes::<u64>(content).map_err(|_| damaged)?;
    if stored_fingerprint != fingerprint {
        return Err(CheckpointError::OtherProblem);
    }
    postcard::from_bytes(content).map_err(|_| damaged)
}
