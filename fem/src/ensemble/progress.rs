//! Progress reports of a running ensemble.

use super::RunRecord;

/// Receives progress reports of an ensemble; by default every method does nothing.
///
/// Methods are called from the threads that run the tests. `()` ignores all reports.
pub trait EnsembleProgress: Sync {
    /// Called after each change: `finished` of `total` runs have finished or failed. `fraction` (0 to 1) is
    /// the completed fraction of the ensemble, including partially completed runs.
    fn update(&self, finished: usize, total: usize, fraction: f64) {
        let _ = (finished, total, fraction);
    }

    /// Called after this process has started a run.
    fn started(&self, id: usize) {
        let _ = id;
    }

    /// Called when a run in progress has completed this fraction of its work (0 to 1).
    fn advanced(&self, id: usize, fraction: f64) {
        let _ = (id, fraction);
    }

    /// Called after this process has finished a run or recorded its failure.
    fn ended(&self, record: &RunRecord) {
        let _ = record;
    }

    /// Called with a warning for the user, for example that a run will be computed again because its file is damaged.
    fn warning(&self, message: &str) {
        let _ = message;
    }
}

impl EnsembleProgress for () {}
