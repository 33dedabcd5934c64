//! MPI processes, on one machine or on several, as the ranks of one `fem` simulation.
//!
//! This crate is apart from `fem` so that a build with MPI does not compile `fem` a second time. The
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

/// Why MPI cannot be started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum MpiError {
    /// A process can start MPI once.
    #[error(
        "MPI was started before in this process: call `fem_mpi::ranks` once and clone its ranks"
    )]
    StartedBefore,
    /// The library cannot be called from a thread other than the first.
    #[error(
        "this MPI library can be used by single-threaded programs alone: take one that is built with \
         support of threads (MPI_THREAD_SERIALIZED)"
    )]
    NoThreads,
}

/// The processes that `mpirun` or another launcher has started together.
struct Mpi {
    /// Ends MPI when it is dropped.
    _universe: Universe,
    rank: usize,
    size: usize,
}

impl fmt::Debug for Mpi {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Mpi").field("rank", &self.rank).field("size", &self.size).finish()
    }
}

/// The processes of this run of `mpirun`, or this process alone if no launcher has started it.
///
/// MPI ends when the last clone of the ranks is dropped. A process that panics ends all processes.
///
/// # Errors
/// [`MpiError`] for a second call in one process, or for an MPI library without threads.
pub fn ranks() -> Result<Ranks, MpiError> {
    // one thread at a time calls MPI, but not always the first thread
    let (universe, threading) =
        mpi::initialize_with_threading(Threading::Serialized).ok_or(MpiError::StartedBefore)?;
    if threading < Threading::Serialized {
        return Err(MpiError::NoThreads);
    }
    let world = SimpleCommunicator::world();
    let (rank, size) = (world.rank() as usize, world.size() as usize);
    Ok(Ranks::new(Mpi { _universe: universe, rank, size }))
}

/// The bytes of a message as MPI counts them.
fn count(bytes: usize) -> i32 {
    i32::try_from(bytes).expect("messages of MPI stay below 2 GiB")
}

/// An empty message at an address of its own: that of an empty `Vec` is the one by which Open MPI knows
/// MPI_IN_PLACE.
fn placed(message: &[u8]) -> &[u8] {
    static SOMEWHERE: [u8; 8] = [0; 8];
    if message.is_empty() { &SOMEWHERE[4..4] } else { message }
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
                let send = process(*rank).immediate_send(scope, placed(message));
                sends.push(WaitGuard::from(send));
            }
            // messages between two processes come in the order in which they were sent
            let received =
                messages.iter().map(|(rank, _)| process(*rank).receive_vec::<u8>().0).collect();
            drop(sends);
            received
        }))
    }

    fn gather(&self, own: &[u8]) -> Result<Vec<Vec<u8>>, RankLost> {
        let world = SimpleCommunicator::world();
        let mut counts = vec![0i32; self.size];
        world.all_gather_into(&count(own.len()), &mut counts[..]);
        let mut places = Vec::with_capacity(self.size);
        let mut total = 0;
        for &each in &counts {
            places.push(count(total));
            total += each as usize;
        }
        if total == 0 {
            return Ok(vec![Vec::new(); self.size]);
        }
        let mut all = vec![0u8; total];
        let mut partition = PartitionMut::new(&mut all[..], &counts[..], &places[..]);
        world.all_gather_varcount_into(placed(own), &mut partition);
        let of = |(&place, &each): (&i32, &i32)| all[place as usize..][..each as usize].to_vec();
        Ok(places.iter().zip(&counts).map(of).collect())
    }

    fn gather_even(&self, own: &[u8]) -> Result<Vec<u8>, RankLost> {
        let mut all = vec![0u8; own.len() * self.size];
        SimpleCommunicator::world().all_gather_into(own, &mut all[..]);
        Ok(all)
    }
}

impl Drop for Mpi {
    fn drop(&mut self) {
        if std::thread::panicking() {
            // the others would wait for this process for ever
            SimpleCommunicator::world().abort(1);
        }
    }
}
