//! What ranks ask of the machinery between them.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

/// Messages between the ranks of a run, each of which calls the same methods in the same order.
///
/// A rank that is gone ends a call that waits for it: where the machinery does not end the whole run, the
/// call unwinds, and the step of the run that it belongs to gives
/// [`FemError::RankLost`](crate::FemError::RankLost).
pub trait Communicator: std::fmt::Debug + Send + Sync {
    /// The number of this rank, from zero.
    fn rank(&self) -> usize;

    /// How many there are.
    fn size(&self) -> usize;

    /// Sends a message to each of some other ranks, which send one to this rank at the same time; theirs, in
    /// the same order.
    fn exchange(&self, messages: Vec<(usize, Vec<u8>)>) -> Vec<Vec<u8>>;

    /// The messages of all ranks, in their order, on every rank.
    fn gather(&self, own: &[u8]) -> Vec<Vec<u8>>;

    /// The same where all have one length.
    fn gather_even(&self, own: &[u8]) -> Vec<u8> {
        self.gather(own).concat()
    }
}

/// What a call unwinds with when another rank is gone: its number.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RankLost(pub(crate) usize);

/// Does something that calls a communicator, and says if another rank was gone.
pub(crate) fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, RankLost> {
    // what was half changed is not used again: the run is over
    catch_unwind(AssertUnwindSafe(work)).map_err(|cause| match cause.downcast::<RankLost>() {
        Ok(lost) => *lost,
        Err(panic) => resume_unwind(panic),
    })
}
