//! Progress on stderr: a bar on a terminal, a line now and then elsewhere.

use std::cell::RefCell;
use std::io::Write as _;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

/// Steps of a bar: fine enough for fractions of a run.
const RESOLUTION: u64 = 10_000;

/// All bars of the program, one below the other.
static BARS: LazyLock<MultiProgress> = LazyLock::new(MultiProgress::new);

thread_local! {
    /// For whom this thread works, where there are several.
    static SPEAKER: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Works for one of several, whose name stands in all lines and bars of this thread.
pub(crate) fn speaking_for<T>(name: &str, work: impl FnOnce() -> T) -> T {
    let before = SPEAKER.replace(Some(name.to_owned()));
    let done = work();
    SPEAKER.set(before);
    done
}

/// For whom this thread works, where there are several.
pub(crate) fn speaker() -> Option<String> {
    SPEAKER.with_borrow(Clone::clone)
}

/// One bar, or, where stderr is no terminal, a line at every tenth.
pub(crate) struct Bar {
    title: String,
    of: Option<String>,
    bar: ProgressBar,
    /// Tenths already told in plain lines.
    told: AtomicU64,
}

impl Bar {
    /// Starts a bar at zero.
    pub(crate) fn new(title: &str) -> Self {
        Self::of(speaker(), title)
    }

    /// Starts one for whom the thread that shows it does not know.
    pub(crate) fn of(of: Option<String>, title: &str) -> Self {
        let bar = BARS.add(ProgressBar::new(RESOLUTION));
        let style = ProgressStyle::with_template("{prefix} {wide_bar} {percent:>3}%  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let of_whom = of.as_ref().map(|name| format!(" {name}")).unwrap_or_default();
        bar.set_prefix(format!("{title:>10}{of_whom}"));
        bar.set_position(0);
        Self { title: title.to_owned(), of, bar, told: AtomicU64::new(0) }
    }

    /// Sets the fraction done, from 0 to 1, and what is going on.
    pub(crate) fn set(&self, fraction: f64, message: &str) {
        let position = (fraction.clamp(0.0, 1.0) * RESOLUTION as f64) as u64;
        if self.bar.is_hidden() {
            let tenth = 10 * position / RESOLUTION;
            if tenth > self.told.fetch_max(tenth, Ordering::Relaxed) {
                tell(self.of.as_deref(), &self.title, &format!("{:>3} %  {message}", 10 * tenth));
            }
        } else {
            self.bar.set_message(message.to_owned());
            self.bar.set_position(position);
        }
    }

    /// A line above the bar.
    pub(crate) fn note(&self, message: &str) {
        tell(self.of.as_deref(), "note", message);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        BARS.remove(&self.bar);
    }
}

/// A stage's own line, above all bars.
pub(crate) fn say(title: &str, message: &str) {
    tell(speaker().as_deref(), title, message);
}

fn tell(of: Option<&str>, title: &str, message: &str) {
    let of_whom = of.map(|name| format!("{name}: ")).unwrap_or_default();
    let line = format!("{title:>10} {of_whom}{message}\n");
    // a terminal that has gone away is no reason to stop; in one piece, beside the lines of others
    BARS.suspend(|| drop(std::io::stderr().write_all(line.as_bytes())));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thread_speaks_for_whom_it_works() {
        assert_eq!(speaker(), None);
        speaking_for("M-50-01", || {
            assert_eq!(speaker().as_deref(), Some("M-50-01"));
            speaking_for("inner", || assert_eq!(speaker().as_deref(), Some("inner")));
            assert_eq!(speaker().as_deref(), Some("M-50-01"));
            assert_eq!(std::thread::scope(|s| s.spawn(speaker).join().unwrap()), None);
        });
        assert_eq!(speaker(), None);
    }
}
