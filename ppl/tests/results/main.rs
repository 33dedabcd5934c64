//! What becomes of draws: diagnostics, posteriors, warnings, files, and what is refused on the way.

mod bad_input;
mod checks;
mod diagnostics;
mod posterior;
mod warnings;
