//! Pool of the cores of this machine, shared by the stages of several cases.

use std::collections::BTreeSet;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

/// Pool of the available cores. Waiting tasks get cores in the order of their ranks, so that work that started first
/// ends first.
#[derive(Clone, Debug)]
pub(crate) struct Cores(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug)]
struct State {
    free: usize,
    /// Rank of each waiting task, with a number that increases in the order of arrival.
    waiting: BTreeSet<(usize, u64)>,
    next: u64,
}

/// A core taken from the pool. Dropping the value returns the core to the pool.
#[derive(Debug)]
pub(crate) struct Core(Cores);

impl Cores {
    /// Creates a pool of `count` cores, at least one.
    pub(crate) fn new(count: usize) -> Self {
        let state = State { free: count.max(1), waiting: BTreeSet::new(), next: 0 };
        Self(Arc::new(Shared { state: Mutex::new(state), changed: Condvar::new() }))
    }

    /// Waits for a core. The lowest rank is served first; tasks of equal rank are served in order of arrival.
    pub(crate) fn take(&self, rank: usize) -> Core {
        let mut state = self.state();
        let request = (rank, state.next);
        state.next += 1;
        state.waiting.insert(request);
        while state.free == 0 || state.waiting.first() != Some(&request) {
            state = self.0.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.waiting.remove(&request);
        state.free -= 1;
        drop(state);
        // another core may be free for the next waiting task
        self.0.changed.notify_all();
        Core(self.clone())
    }

    /// Takes up to `most` free cores without waiting. Takes no core if any task is waiting.
    pub(crate) fn spare(&self, most: usize) -> Vec<Core> {
        let mut state = self.state();
        let count = if state.waiting.is_empty() { state.free.min(most) } else { 0 };
        state.free -= count;
        (0..count).map(|_| Core(self.clone())).collect()
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Core {
    fn drop(&mut self) {
        self.0.state().free += 1;
        self.0.0.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::*;

    #[test]
    fn no_more_work_at_a_time_than_there_are_cores() {
        let cores = Cores::new(3);
        let (at_work, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        std::thread::scope(|scope| {
            for rank in 0..8 {
                let (cores, at_work, most) = (&cores, &at_work, &most);
                scope.spawn(move || {
                    for _ in 0..50 {
                        let _core = cores.take(rank);
                        most.fetch_max(
                            at_work.fetch_add(1, Ordering::SeqCst) + 1,
                            Ordering::SeqCst,
                        );
                        std::thread::yield_now();
                        at_work.fetch_sub(1, Ordering::SeqCst);
                    }
                });
            }
        });
        assert_eq!(most.into_inner(), 3);
        assert_eq!(cores.spare(10).len(), 3, "all are given back");
    }

    #[test]
    fn who_began_first_is_served_first_and_spare_ones_are_those_nobody_waits_for() {
        let cores = Cores::new(1);
        let served = Mutex::new(Vec::new());
        let only = cores.take(0);
        assert!(cores.spare(1).is_empty());
        std::thread::scope(|scope| {
            for rank in [3, 1, 2] {
                let (cores, served) = (&cores, &served);
                scope.spawn(move || {
                    let _core = cores.take(rank);
                    served.lock().unwrap().push(rank);
                });
            }
            while cores.state().waiting.len() < 3 {
                std::thread::yield_now();
            }
            drop(only);
        });
        assert_eq!(served.into_inner().unwrap(), [1, 2, 3]);
        assert_eq!(cores.spare(5).len(), 1);
    }
}
