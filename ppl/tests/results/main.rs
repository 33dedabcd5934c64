//! Results of a run: diagnostics, posteriors, warnings, files, and the refusal of invalid input.

mod bad_input;
mod checks;
mod diagnostics;
mod posterior;
mod warnings;
