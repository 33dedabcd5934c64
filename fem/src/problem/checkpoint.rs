//! The state of a run on disk, from which it goes on bit by bit as if it had never stopped.
//!
//! A file holds a line `breccia-state 9`, the fingerprint of the problem and the state in postcard's
//! format, and a checksum of all that (FNV-1a, u64, little endian). What the linear solver keeps from
//! step to step is not in it: a run with a checkpoint forgets that whenever it saves.

use std::io::{self, ErrorKind};
use std::path::PathBuf;

use super::fingerprint::Fingerprint;
use super::state::RunState;
use crate::error::{CheckpointError, FemError};
use crate::parallel::Ranks;
use fem_file::{read_regular, write_atomically};

/// Where a run keeps its state, and how often it saves.
///
/// # Example
/// ```no_run
/// # fn go(problem: fem::Problem) -> Result<(), fem::FemError> {
/// let checkpoint = fem::Checkpoint { path: "run.state".into(), every: 10 };
/// // the first time from the start, after a kill from the last saved step
/// let outcome = problem.run_resumable(&checkpoint, &mut ())?;
/// # Ok(())
/// # }
/// ```
#[derive(Clone, Debug)]
pub struct Checkpoint {
    /// The file; it is replaced in one move, never half written.
    pub path: PathBuf,
    /// Load steps from one save to the next, at least 1.
    pub every: u32,
}

/// What every version of the format begins with, and this one.
const MAGIC: &[u8] = b"breccia-state ";
const VERSION: &[u8] = b"breccia-state 9\n";

impl Checkpoint {
    /// Writes a state.
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

    /// Reads a state; `None` if there is no file. The first of several ranks reads it for all.
    pub(crate) fn load(
        &self,
        fingerprint: u64,
        ranks: &Ranks,
    ) -> Result<Option<RunState>, FemError> {
        let read = match ranks.is_first().then(|| read_regular(&self.path)) {
            None => Ok(Vec::new()),
            Some(Err(error)) if error.kind() == ErrorKind::NotFound => Ok(Vec::new()),
            // one byte more tells an empty file from none
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
    let (of, content) = postcard::take_from_bytes::<u64>(content).map_err(|_| damaged)?;
    if of != fingerprint {
        return Err(CheckpointError::OtherProblem);
    }
    postcard::from_bytes(content).map_err(|_| damaged)
}
