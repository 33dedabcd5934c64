//! The interface for messages between ranks.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// Messages between the ranks of a run. All ranks call the same methods in the same order.
///
/// If a rank ends, a call that waits for its message must not wait for ever. Either the implementation ends
/// the whole run, or the call unwinds; the current step of the run then returns
/// [`FemError::RankLost`](crate::FemError::RankLost).
pub trait Communicator: std::fmt::Debug + Send + Sync {
    /// The number of this rank, from 0.
    fn rank(&self) -> usize;

    /// The number of ranks.
    fn size(&self) -> usize;

    /// Sends a message to each of the given ranks and receives a message from each of them. Each of these
    /// ranks must call `exchange` with this rank at the same time. The received messages are in the order of
    /// the given ranks.
    fn exchange(&self, messages: Vec<(usize, Vec<u8>)>) -> Vec<Vec<u8>>;

    /// Sends `own` to all ranks. Returns the messages of all ranks, in the order of the ranks, on every rank.
    fn gather(&self, own: &[u8]) -> Vec<Vec<u8>>;

    /// Concatenated messages of all ranks, as [`Self::gather`]; all messages must have the same length.
    fn gather_even(&self, own: &[u8]) -> Vec<u8> {
        self.gather(own).concat()
    }
}

/// Payload of the unwinding of a call that waits for a rank that has ended: the number of that rank.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RankLost(pub(crate) usize);

/// Runs `work`, which may call a communicator. Returns an error if another rank has ended.
pub(crate) fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, RankLost> {
    // unwind safe: the run ends, so partially changed data are not used again
    catch_unwind(AssertUnwindSafe(work)).map_err(|cause| match cause.downcast::<RankLost>() {
        Ok(lost) => *lost,
        Err(panic) => resume_unwind(panic),
    })
}
