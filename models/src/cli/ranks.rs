//! The processes that a launcher such as `mpirun` has started together.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use fem::Ranks;

use super::failure::Failure;

/// What launchers say of how many processes there are: Open MPI's, those of MPICH and its kin, and Slurm's with PMI-2.
const SIZES: [&str; 3] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS"];

/// Where the run of several ranks goes on from when it is ended from outside.
static STATE: OnceLock<(usize, PathBuf)> = OnceLock::new();

/// How many processes a launcher has started; `None` without one.
fn launched() -> Option<usize> {
    let size = |name: &str| std::env::var(name).ok()?.parse().ok();
    // PMIx says nothing of the number but through Slurm
    let of_slurm = || std::env::var_os("PMIX_RANK").and_then(|_| size("SLURM_STEP_NUM_TASKS"));
    SIZES.into_iter().find_map(size).or_else(of_slurm)
}

/// The ranks of a simulation: those of the launcher, or this process alone.
#[cfg(feature = "mpi")]
pub(super) fn ranks() -> Result<Ranks, Failure> {
    match launched() {
        None => Ok(Ranks::default()),
        Some(_) => Ok(fem_mpi::ranks()?),
    }
}

/// This process alone: several would all do the same.
#[cfg(not(feature = "mpi"))]
pub(super) fn ranks() -> Result<Ranks, Failure> {
    match launched() {
        Some(count) if count > 1 => Err(Failure::WithoutMpi(count)),
        _ => Ok(Ranks::default()),
    }
}

/// Refuses several processes that would all do the same.
pub(super) fn refuse(command: &str) -> Result<(), Failure> {
    match launched() {
        Some(count) if count > 1 => Err(Failure::NotShared { command: command.into(), count }),
        _ => Ok(()),
    }
}

/// Remembers where the state of a shared simulation is.
pub(super) fn remember(ranks: &Ranks, results: &Path) {
    if ranks.size() > 1 {
        let _ = STATE.set((ranks.rank(), results.join("simulate.state")));
    }
}

/// What to say when a process of several is told to end, as all are when one of them has died. The
/// first two say it: one of them lives.
pub(super) fn farewell() -> Option<String> {
    let (rank, state) = STATE.get()?;
    let saved = state.is_file();
    let state = state.display();
    (*rank < 2).then(|| match saved {
        true => format!("the run is ended from outside; the same command goes on from {state}"),
        false => format!("the run is ended from outside before its first {state} was saved"),
    })
}
