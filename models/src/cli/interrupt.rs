//! Interruption of the program by Ctrl-C and by signals.

use std::io::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};

use super::ranks;

/// Set by Ctrl-C and by the signals TERM and HUP; a second signal ends the program at once.
pub(super) static INTERRUPT: AtomicBool = AtomicBool::new(false);

/// Installs the handler that sets [`INTERRUPT`]. If the handler cannot be installed, prints a note.
pub(super) fn handle_signals() {
    let handler = ctrlc::set_handler(|| {
        if INTERRUPT.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        // standard error may be closed already, so that errors of writing are ignored
        let _ = match ranks::farewell() {
            Some(text) => writeln!(std::io::stderr(), "{text}"),
            None => writeln!(
                std::io::stderr(),
                "\nstopping after the current load steps; press Ctrl-C again to stop at once"
            ),
        };
    });
    if let Err(error) = handler {
        let _ = writeln!(
            std::io::stderr(),
            "note: Ctrl-C will stop the program without saving unfinished work ({error})"
        );
    }
}
