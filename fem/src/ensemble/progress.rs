//! What an ensemble tells while it runs.

use super::RunRecord;

/// Listens to an ensemble; every method does nothing unless it is overridden.
///
/// Methods are called from the threads that run the tests. `()` is the silent listener.
pub trait EnsembleProgress: Sync {
    /// Something changed: so many of all runs are finished (or failed), and with the parts of
    /// those under way this fraction of the ensemble is done (0 to 1).
    fn update(&self, finished: usize, total: usize, fraction: f64) {
        let _ = (finished, total, fraction);
    }

    /// This process has begun a run.
    fn started(&self, id: usize) {
        let _ = id;
    }

    /// A run under way has done this fraction of its work (0 to 1).
    fn advanced(&self, id: usize, fraction: f64) {
        let _ = (id, fraction);
    }

    /// This process has finished a run, or recorded its failure.
    fn ended(&self, record: &RunRecord) {
        let _ = record;
    }

    /// Something a person should know, such as a damaged file that will be made anew.
    fn warning(&self, message: &str) {
        let _ = message;
    }
}

impl EnsembleProgress for () {}
