//! The interface for messages between ranks.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// Messages between the ranks of a run. All ranks call the same methods in the same order.
///
/// If a rank ends, a call that waits for a message of this rank must not wait for ever: either the implementation ends
/// the whole run, or the call returns [`RankLost`]. The current step of the run then returns
/// [`FemError::RankLost`](crate::FemError::RankLost).
pub trait Communicator: std::fmt::Debug + Send + Sync {
    /// The number of this rank, from 0.
    fn rank(&self) -> usize;

    /// The number of ranks.
    fn size(&self) -> usize;

    /// Sends a message to each of the given ranks and receives a message from each of them. Each of these ranks must
    /// call `exchange` with this rank at the same time. The received messages are in the order of the given ranks.
    ///
    /// # Errors
    /// [`RankLost`] if one of these ranks has ended.
    fn exchange(&self, messages: Vec<(usize, Vec<u8>)>) -> Result<Vec<Vec<u8>>, RankLost>;

    /// Sends `message` to all ranks. Returns the messages of all ranks, in the order of the ranks, on every rank.
    ///
    /// # Errors
    /// [`RankLost`] if another rank has ended.
    fn gather(&self, message: &[u8]) -> Result<Vec<Vec<u8>>, RankLost>;

    /// Gathers messages as [`Self::gather`] does, and concatenates them. All messages must have the same length.
    ///
    /// # Errors
    /// [`RankLost`] if another rank has ended.
    fn gather_even(&self, message: &[u8]) -> Result<Vec<u8>, RankLost> {
        Ok(self.gather(message)?.concat())
    }
}

/// Error of a message to or from a rank that has ended; the field is the number of the rank.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("rank {0} has ended")]
pub struct RankLost(pub usize);

/// Returns a message, or unwinds to [`guarded`] if another rank has ended.
///
/// Unwinding replaces error values here: the solver calls communicators in its innermost loops, and a run without
/// all its ranks cannot continue.
pub(super) fn received<T>(message: Result<T, RankLost>) -> T {
    message.unwrap_or_else(|lost| resume_unwind(Box::new(lost)))
}

/// Runs `work`, which may exchange messages with other ranks. Returns an error if another rank has ended.
pub(crate) fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, RankLost> {
    // AssertUnwindSafe is valid: the run ends, so partially changed data are not used again
    catch_unwind(AssertUnwindSafe(work)).map_err(|cause| match cause.downcast::<RankLost>() {
        Ok(lost) => *lost,
        Err(panic) => resume_unwind(panic),
    })
}
