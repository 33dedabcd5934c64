//! Keys of a case by their paths: given other values, taken out.

use std::path::Path;

use toml::{Table, Value};

use crate::error::InputError;

/// `a.b = value` as tables.
pub(super) fn nested(key: &str, value: Value) -> Table {
    match key.split_once('.') {
        Some((first, rest)) => Table::from_iter([(first.to_owned(), nested(rest, value).into())]),
        None => Table::from_iter([(key.to_owned(), value)]),
    }
}

/// A key with its value, from the command line.
pub(super) fn parsed(entry: &str, path: &Path) -> Result<Table, InputError> {
    entry.parse().map_err(|_| {
        let help = "Write a key by its path and a value of TOML, as --set specimen.spacing_mm=0.3.";
        InputError::new(path, "--set", entry, "is no key with a value", help)
    })
}

/// Gives a table what another one has otherwise, key by key.
pub(super) fn merge(table: &mut Table, set: &Table) {
    for (key, value) in set {
        match (table.get_mut(key), value) {
            (Some(Value::Table(inner)), Value::Table(set)) => merge(inner, set),
            _ => drop(table.insert(key.clone(), value.clone())),
        }
    }
}

/// Takes a key out, by its path; whether it was there.
pub(super) fn remove(table: &mut Table, key: &str) -> bool {
    match key.split_once('.') {
        Some((first, rest)) => match table.get_mut(first) {
            Some(Value::Table(inner)) => remove(inner, rest),
            _ => false,
        },
        None => table.remove(key).is_some(),
    }
}
