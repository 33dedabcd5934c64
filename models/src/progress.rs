//! Progress on stderr: a bar on a terminal, a line now and then elsewhere.

use std::io::Write as _;
use std::sync::atomic::{AtomicU64, Ordering};

use indicatif::{ProgressBar, ProgressStyle};

/// Steps of a bar: fine enough for fractions of a run.
const RESOLUTION: u64 = 10_000;

/// One bar, or, where stderr is no terminal, a line at every tenth.
pub(crate) struct Bar {
    title: String,
    bar: ProgressBar,
    /// Tenths already told in plain lines.
    told: AtomicU64,
}

impl Bar {
    /// Starts a bar at zero.
    pub(crate) fn new(title: &str) -> Self {
        let bar = ProgressBar::new(RESOLUTION);
        let style = ProgressStyle::with_template("{prefix:>10} {wide_bar} {percent:>3}%  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_prefix(title.to_owned());
        bar.set_position(0);
        Self { title: title.to_owned(), bar, told: AtomicU64::new(0) }
    }

    /// Sets the fraction done, from 0 to 1, and what is going on.
    pub(crate) fn set(&self, fraction: f64, message: &str) {
        let position = (fraction.clamp(0.0, 1.0) * RESOLUTION as f64) as u64;
        if self.bar.is_hidden() {
            let tenth = 10 * position / RESOLUTION;
            if tenth > self.told.fetch_max(tenth, Ordering::Relaxed) {
                say(&self.title, &format!("{:>3} %  {message}", 10 * tenth));
            }
        } else {
            self.bar.set_message(message.to_owned());
            self.bar.set_position(position);
        }
    }
}

impl Bar {
    /// A line above the bar.
    pub(crate) fn note(&self, message: &str) {
        self.bar.suspend(|| say("note", message));
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
    }
}

/// A stage's own line.
pub(crate) fn say(title: &str, message: &str) {
    // a terminal that has gone away is no reason to stop
    let _ = writeln!(std::io::stderr(), "{title:>10} {message}");
}
