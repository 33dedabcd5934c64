//! Progress reports of running chains.

use std::time::{Duration, Instant};

use crate::sampler::draws::report::DrawStats;

/// Observer of running chains; the methods are called from the threads of the chains.
///
/// # Example
/// ```
/// struct Print;
/// impl ppl::Progress for Print {
///     fn update(&self, s: &ppl::ChainStatus) {
///         println!("chain {}: {}/{}, {:.0} draws/s", s.chain, s.done, s.total, s.draws_per_second);
///     }
/// }
/// ```
pub trait Progress: Sync {
    /// Reports the progress of a chain. Each chain calls this method at most ten times per second,
    /// and once at its end.
    fn update(&self, status: &ChainStatus);
}

/// State of one running chain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainStatus {
    /// Index of the chain.
    pub chain: usize,
    /// Whether the chain is still in its warmup.
    pub tuning: bool,
    /// Number of completed transitions, warmup included.
    pub done: usize,
    /// Number of transitions requested, warmup included.
    pub total: usize,
    /// Transitions per second since the start of the chain.
    pub draws_per_second: f64,
    /// Number of divergent transitions after the warmup.
    pub divergences: u64,
    /// Step size of the most recent transition.
    pub step_size: f64,
    /// Whether the chain has ended.
    pub finished: bool,
}

const INTERVAL: Duration = Duration::from_millis(100);

/// Counts the transitions of a chain, and calls [`Progress::update`] at most ten times per second.
pub(crate) struct Meter<'a> {
    listener: Option<&'a dyn Progress>,
    status: ChainStatus,
    began: Instant,
    last_update: Instant,
}

impl<'a> Meter<'a> {
    pub(crate) fn new(listener: Option<&'a dyn Progress>, chain: usize, total: usize) -> Self {
        let now = Instant::now();
        let status = ChainStatus {
            chain,
            tuning: true,
            done: 0,
            total,
            draws_per_second: 0.0,
            divergences: 0,
            step_size: 0.0,
            finished: false,
        };
        Self { listener, status, began: now, last_update: now }
    }

    pub(crate) fn transition(&mut self, stats: &DrawStats) {
        self.status.done += 1;
        self.status.tuning = stats.tuning;
        self.status.divergences += u64::from(stats.divergent && !stats.tuning);
        self.status.step_size = stats.step_size;
        if self.listener.is_some() && self.last_update.elapsed() >= INTERVAL {
            self.update();
        }
    }

    pub(crate) fn finish(mut self) {
        self.status.finished = true;
        self.update();
    }

    fn update(&mut self) {
        if let Some(listener) = self.listener {
            let seconds = self.began.elapsed().as_secs_f64().max(f64::MIN_POSITIVE);
            self.status.draws_per_second = self.status.done as f64 / seconds;
            listener.update(&self.status);
            self.last_update = Instant::now();
        }
    }
}
