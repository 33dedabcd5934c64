//! The `breccia` program.

use std::process::ExitCode;

fn main() -> ExitCode {
    models::program(models::Registry::standard())
}
