//! Keys of a case that are given on the command line.

use std::path::Path;

use toml::Table;

use crate::error::InputError;

/// A key with its value, from the command line.
pub(super) fn parsed(entry: &str, path: &Path) -> Result<Table, InputError> {
    entry.parse().map_err(|_| {
        let help = "Write a key by its path and a value of TOML, as --set specimen.spacing_mm=0.3.";
        InputError::new(path, "--set", entry, "is no key with a value", help)
    })
}
