//! MPI processes, on one machine or on several, as the ranks of one `fem` simulation.
//!
//! This crate is separate from `fem` so that a build with MPI does not compile `fem` a second time. The
//! crate is empty without its feature `mpi`, which needs an MPI library and libclang.
//!
//! ```ignore
//! let ranks = fem_mpi::ranks()?;
//! println!("process {} of {}", ranks.rank(), ranks.size());
//! # Ok::<(), fem_mpi::MpiError>(())
//! ```

#![cfg(feature = "mpi")]

use std::fmt;

use fem::{Communicator, RankLost, Ranks};
use mpi::Threading;
use mpi::datatype::PartitionMut;
use mpi::environment::Universe;
use mpi::request::WaitGuard;
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator as _, CommunicatorCollectives as _, Destination as _, Source as _};

/// Reason why MPI cannot be started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MpiError {
    /// MPI was started a second time in one process.
    #[error(
        "MPI was already started in this process: call `fem_mpi::ranks` once and clone the returned ranks"
    )]
    StartedBefore,
    /// The MPI library does not support programs with several threads.
    #[error(
        "this MPI library supports single-threaded programs only: use an MPI library that was built with \
         support for threads (MPI_THREAD_SERIALIZED)"
    )]
    NoThreads,
}

/// Communicator of the processes that `mpirun` or another launcher has started together.
struct Mpi {
    /// Handle of MPI: MPI ends when the handle is dropped.
    _universe: Universe,
    rank: usize,
    size: usize,
}

impl fmt::Debug for Mpi {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Mpi").field("rank", &self.rank).field("size", &self.size).finish()
    }
}

/// Returns the processes of this run of `mpirun` as ranks, or a single rank if no launcher has started this process.
///
/// MPI ends when the last clone of the ranks is dropped. A process that panics ends all processes.
///
/// # Errors
/// [`MpiError`] for a second call in one process, or for an MPI library without support for threads.
pub fn ranks() -> Result<Ranks, MpiError> {
    // only one thread at a time calls MPI, but this thread is not always the first thread of the process
    let (universe, threading) =
        mpi::initialize_with_threading(Threading::Serialized).ok_or(MpiError::StartedBefore)?;
    if threading < Threading::Serialized {
        return Err(MpiError::NoThreads);
    }
    let world = SimpleCommunicator::world();
    let (rank, size) = (world.rank() as usize, world.size() as usize);
    Ok(Ranks::new(Mpi { _universe: universe, rank, size }))
}

/// Converts the length of a message in bytes to the integer type of MPI.
fn count(bytes: usize) -> i32 {
    i32::try_from(bytes).expect("messages of MPI stay below 2 GiB")
}

/// Returns the message, or an empty slice at a valid address if the message is empty. The address of an empty `Vec`
/// equals the value of MPI_IN_PLACE in Open MPI, which would change the meaning of the call.
fn with_valid_address(message: &[u8]) -> &[u8] {
    static BYTES: [u8; 8] = [0; 8];
    if message.is_empty() { &BYTES[4..4] } else { message }
}

impl Communicator for Mpi {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn exchange(&self, messages: Vec<(usize, Vec<u8>)>) -> Result<Vec<Vec<u8>>, RankLost> {
        let world = SimpleCommunicator::world();
        let process = |rank: usize| world.process_at_rank(rank as i32);
        Ok(mpi::request::scope(|scope| {
            let mut sends = Vec::with_capacity(messages.len());
            for (rank, message) in &messages {
                let send = process(*rank).immediate_send(scope, with_valid_address(message));
                sends.push(WaitGuard::from(send));
            }
            // MPI delivers messages between two processes in the order in which they were sent
            let received =
                messages.iter().map(|(rank, _)| process(*rank).receive_vec::<u8>().0).collect();
            drop(sends);
            received
        }))
    }

    fn gather(&self, message: &[u8]) -> Result<Vec<Vec<u8>>, RankLost> {
        let world = SimpleCommunicator::world();
        let mut counts = vec![0i32; self.size];
        world.all_gather_into(&count(message.len()), &mut counts[..]);
        let mut offsets = Vec::with_capacity(self.size);
        let mut total = 0;
        for &each in &counts {
            offsets.push(count(total));
            total += each as usize;
        }
        if total == 0 {
            return Ok(vec![Vec::new(); self.size]);
        }
        let mut all = vec![0u8; total];
        let mut partition = PartitionMut::new(&mut all[..], &counts[..], &offsets[..]);
        world.all_gather_varcount_into(with_valid_address(message), &mut partition);
        let part =
            |(&offset, &each): (&i32, &i32)| all[offset as usize..][..each as usize].to_vec();
        Ok(offsets.iter().zip(&counts).map(part).collect())
    }

    fn gather_even(&self, message: &[u8]) -> Result<Vec<u8>, RankLost> {
        let mut all = vec![0u8; message.len() * self.size];
        SimpleCommunicator::world().all_gather_into(message, &mut all[..]);
        Ok(all)
    }
}

impl Drop for Mpi {
    fn drop(&mut self) {
        if std::thread::panicking() {
            // end all processes: otherwise the other processes would wait for this process for ever
            SimpleCommunicator::world().abort(1);
        }
    }
}
