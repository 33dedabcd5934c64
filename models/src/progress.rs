//! Progress on stderr: a bar on a terminal, otherwise a line for each tenth of the work.

use std::cell::RefCell;
use std::io::Write as _;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};

use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

/// Number of steps of a bar, large enough to show fractions of a run.
const RESOLUTION: u64 = 10_000;

/// All bars of the program, one below another.
static BARS: LazyLock<MultiProgress> = LazyLock::new(MultiProgress::new);

thread_local! {
    /// Name of the part of a study (a laboratory or a case) that this thread works on; `None` outside of studies.
    static SPEAKER: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Runs `work` for the part `name` of a study. All lines and bars of this thread then show the name.
pub(crate) fn speaking_for<T>(name: &str, work: impl FnOnce() -> T) -> T {
    let before = SPEAKER.replace(Some(name.to_owned()));
    let done = work();
    SPEAKER.set(before);
    done
}

/// Returns the name of the part of a study that this thread works on; `None` outside of studies.
pub(crate) fn speaker() -> Option<String> {
    SPEAKER.with_borrow(Clone::clone)
}

/// A progress bar, or a line for every tenth if stderr is not a terminal.
pub(crate) struct Bar {
    title: String,
    /// Part of a study that the bar belongs to.
    part: Option<String>,
    bar: ProgressBar,
    /// Number of tenths already printed as plain lines.
    printed_tenths: AtomicU64,
}

impl Bar {
    /// Starts a bar at zero.
    pub(crate) fn new(title: &str) -> Self {
        Self::for_part(speaker(), title)
    }

    /// Starts a bar at zero for a part of a study. Needed on a thread that is not assigned to the part.
    pub(crate) fn for_part(part: Option<String>, title: &str) -> Self {
        let bar = BARS.add(ProgressBar::new(RESOLUTION));
        let style = ProgressStyle::with_template("{prefix} {wide_bar} {percent:>3}%  {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        let suffix = part.as_ref().map(|name| format!(" {name}")).unwrap_or_default();
        bar.set_prefix(format!("{title:>10}{suffix}"));
        bar.set_position(0);
        Self { title: title.to_owned(), part, bar, printed_tenths: AtomicU64::new(0) }
    }

    /// Sets the completed fraction, from 0 to 1, and a message about the current work.
    pub(crate) fn set(&self, fraction: f64, message: &str) {
        let position = (fraction.clamp(0.0, 1.0) * RESOLUTION as f64) as u64;
        if self.bar.is_hidden() {
            let tenth = 10 * position / RESOLUTION;
            if tenth > self.printed_tenths.fetch_max(tenth, Ordering::Relaxed) {
                print_line(
                    self.part.as_deref(),
                    &self.title,
                    &format!("{:>3} %  {message}", 10 * tenth),
                );
            }
        } else {
            self.bar.set_message(message.to_owned());
            self.bar.set_position(position);
        }
    }

    /// Prints a line above the bar.
    pub(crate) fn note(&self, message: &str) {
        print_line(self.part.as_deref(), "note", message);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.bar.finish_and_clear();
        BARS.remove(&self.bar);
    }
}

/// Prints a message of a stage in a line above all bars.
pub(crate) fn say(title: &str, message: &str) {
    print_line(speaker().as_deref(), title, message);
}

fn print_line(part: Option<&str>, title: &str, message: &str) {
    let prefix = part.map(|name| format!("{name}: ")).unwrap_or_default();
    let line = format!("{title:>10} {prefix}{message}\n");
    // errors are ignored, because a closed terminal must not end the program; the line is written in one call, so that
    // lines of other threads do not mix with it
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
