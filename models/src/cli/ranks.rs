//! Processes that a launcher such as `mpirun` has started together.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use fem::Ranks;

use super::failure::Failure;

/// Environment variables in which launchers pass the number of processes: Open MPI, MPICH and its derivatives, and
/// Slurm with PMI-2.
const SIZES: [&str; 3] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MPI_LOCALNRANKS"];

/// Rank of this process and path of the saved state from which an interrupted simulation resumes; set for several
/// ranks.
static STATE: OnceLock<(usize, PathBuf)> = OnceLock::new();

/// Returns the number of processes that a launcher has started; `None` without a launcher.
fn launched() -> Option<usize> {
    let size = |name: &str| std::env::var(name).ok()?.parse().ok();
    // PMIx does not pass the number of processes, but Slurm does in its own variable
    let of_slurm = || std::env::var_os("PMIX_RANK").and_then(|_| size("SLURM_STEP_NUM_TASKS"));
    SIZES.into_iter().find_map(size).or_else(of_slurm)
}

/// Returns the ranks of a simulation: all processes of the launcher, or this process alone.
#[cfg(feature = "mpi")]
pub(super) fn ranks() -> Result<Ranks, Failure> {
    match launched() {
        None => Ok(Ranks::default()),
        Some(_) => Ok(fem_mpi::ranks()?),
    }
}

/// Returns a single rank. Fails if a launcher has started several processes, because all processes would compute the
/// same results.
#[cfg(not(feature = "mpi"))]
pub(super) fn ranks() -> Result<Ranks, Failure> {
    match launched() {
        Some(count) if count > 1 => Err(Failure::WithoutMpi(count)),
        _ => Ok(Ranks::default()),
    }
}

/// Refuses to run in several processes, because all processes would compute the same results.
pub(super) fn refuse(command: &str) -> Result<(), Failure> {
    match launched() {
        Some(count) if count > 1 => Err(Failure::NotShared { command: command.into(), count }),
        _ => Ok(()),
    }
}

/// Stores the path of the saved state of a simulation on several ranks.
pub(super) fn remember(ranks: &Ranks, results: &Path) {
    if ranks.size() > 1 {
        let _ = STATE.set((ranks.rank(), results.join("simulate.state")));
    }
}

/// Message to print at a termination signal, if the simulation runs on several ranks. If one process dies, the
/// launcher ends all others. Ranks 0 and 1 both print the message, so that the message also appears if one of these
/// two processes has died.
pub(super) fn farewell() -> Option<String> {
    let (rank, state) = STATE.get()?;
    let saved = state.is_file();
    let state = state.display();
    (*rank < 2).then(|| match saved {
        true => format!("the run was stopped by a signal; the same command resumes from {state}"),
        false => format!("the run was stopped by a signal before the first {state} was saved"),
    })
}
