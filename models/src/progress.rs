//! Progress on stderr: a bar on a terminal, otherwise a line for each tenth of the work.

use std::cell::RefCell;
use std::io::Write as _;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicU64, Ordering};

use console::Term;
use indicatif::{HumanDuration, MultiProgress, ProgressBar, ProgressState, ProgressStyle};

/// Number of steps of a bar, large enough to show fractions of a run.
const RESOLUTION: u64 = 10_000;

/// Columns of the title of a line.
const TITLE_WIDTH: usize = 10;

/// Fewest columns to which the text of a message is wrapped.
const NARROWEST: usize = 30;

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
    /// What the bar counts.
    label: String,
    /// Part of a study that the bar belongs to.
    part: Option<String>,
    bar: ProgressBar,
    /// Number of tenths already printed as plain lines.
    printed_tenths: AtomicU64,
}

impl Bar {
    /// Starts a bar at zero. `title` is the stage, and `label` names the counted items.
    pub(crate) fn new(title: &str, label: &str) -> Self {
        Self::for_part(speaker(), title, label)
    }

    /// Starts a bar at zero for a part of a study. Needed on a thread that is not assigned to the part.
    pub(crate) fn for_part(part: Option<String>, title: &str, label: &str) -> Self {
        let bar = BARS.add(ProgressBar::new(RESOLUTION));
        let template = "{prefix} {wide_bar} {percent:>3}%  {msg}{left}";
        let style = ProgressStyle::with_template(template);
        let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
        bar.set_style(style.with_key("left", write_time_left));
        let part_of_prefix = part.as_ref().map(|name| format!("{name}: ")).unwrap_or_default();
        bar.set_prefix(format!("{title:>TITLE_WIDTH$} {part_of_prefix}{label}"));
        bar.set_position(0);
        let (title, label) = (title.to_owned(), label.to_owned());
        Self { title, label, part, bar, printed_tenths: AtomicU64::new(0) }
    }

    /// Sets the completed fraction, from 0 to 1, and a message about the current work.
    pub(crate) fn set(&self, fraction: f64, message: &str) {
        let position = (fraction.clamp(0.0, 1.0) * RESOLUTION as f64) as u64;
        if self.bar.is_hidden() {
            let tenth = 10 * position / RESOLUTION;
            if tenth > self.printed_tenths.fetch_max(tenth, Ordering::Relaxed) {
                let text = format!("{:>3} %  {}: {message}", 10 * tenth, self.label);
                print_line(self.part.as_deref(), &self.title, &text);
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

/// Writes the estimated time until a bar is full; nothing before the first progress.
fn write_time_left(state: &ProgressState, text: &mut dyn std::fmt::Write) {
    if state.pos() > 0 && state.pos() < RESOLUTION {
        // after an error, the line shows no remaining time
        let _ = write!(text, ", {:#} left", HumanDuration(state.eta()));
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
    let columns = Term::stderr().size_checked().map(|(_, columns)| usize::from(columns));
    let line = titled(title, &format!("{prefix}{message}"), columns);
    // errors are ignored, because a closed terminal must not end the program; the line is written in one call, so that
    // lines of other threads do not mix with it
    BARS.suspend(|| drop(std::io::stderr().write_all(line.as_bytes())));
}

/// Returns a line with a title. If the line is longer than the terminal of this width in columns, it is wrapped between
/// words, and the further lines are indented to the message.
fn titled(title: &str, message: &str, columns: Option<usize>) -> String {
    let title = format!("{title:>TITLE_WIDTH$} ");
    let Some(columns) = columns else { return format!("{title}{message}\n") };
    let indent = title.chars().count();
    let width = columns.saturating_sub(indent).max(NARROWEST);
    let lines: Vec<&str> = message.lines().flat_map(|line| wrapped(line, width)).collect();
    format!("{title}{}\n", lines.join(&format!("\n{:indent$}", "")))
}

/// Divides a text at spaces into lines of at most `width` characters. A longer word is a line of its own.
fn wrapped(text: &str, width: usize) -> Vec<&str> {
    let mut lines = Vec::new();
    let mut rest = text;
    while rest.chars().count() > width {
        // leading spaces belong to the first word
        let start = rest.len() - rest.trim_start().len();
        let spaces = || rest.char_indices().filter(|&(index, c)| c == ' ' && index > start);
        // a space directly after the last column ends the line too
        let in_width = rest.char_indices().nth(width).map_or(rest.len(), |(index, _)| index);
        let last = spaces().take_while(|&(index, _)| index <= in_width).last();
        let Some((end, _)) = last.or_else(|| spaces().next()) else { break };
        lines.push(rest[..end].trim_end());
        rest = rest[end..].trim_start();
    }
    lines.push(rest);
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_is_wrapped_between_words_to_the_width_of_the_terminal() {
        let message = "the surrogate's share of the uncertainty of ξ is 12.3 %, above 10.0 % of sequential.share";
        assert_eq!(titled("note", message, None), format!("      note {message}\n"));
        for columns in [1, 45, 60, 80, 200] {
            let text = titled("note", message, Some(columns));
            let lines: Vec<&str> = text.lines().collect();
            let most = columns.max(NARROWEST + TITLE_WIDTH + 1);
            assert!(lines.iter().all(|line| line.chars().count() <= most), "{columns}: {text}");
            assert!(lines[1..].iter().all(|line| line.starts_with("           ")), "{text}");
            let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
            assert_eq!(words(&text)[1..], words(message), "{columns}");
            assert_eq!(lines.len() == 1, columns == 200, "{text}");
        }
        // a path is longer than a line, and is not divided
        assert_eq!(wrapped("see /a/long/path now", 5), ["see", "/a/long/path", "now"]);
        assert_eq!(wrapped("12345 78", 5), ["12345", "78"]);
        assert_eq!(wrapped("ξξξξξ ηη", 5), ["ξξξξξ", "ηη"]);
    }

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
