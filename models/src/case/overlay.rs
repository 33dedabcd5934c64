//! Changes individual keys of a case, which are named by dotted paths.

use toml::{Table, Value};

/// Creates the nested tables that `a.b = value` means in TOML.
pub(crate) fn nested(key: &str, value: Value) -> Table {
    match key.split_once('.') {
        Some((first, rest)) => Table::from_iter([(first.to_owned(), nested(rest, value).into())]),
        None => Table::from_iter([(key.to_owned(), value)]),
    }
}

/// Copies all values of `set` into `table`, recursively for tables within tables.
pub(crate) fn merge(table: &mut Table, set: &Table) {
    for (key, value) in set {
        match (table.get_mut(key), value) {
            (Some(Value::Table(inner)), Value::Table(set)) => merge(inner, set),
            _ => drop(table.insert(key.clone(), value.clone())),
        }
    }
}

/// Removes a key, given by its dotted path. Returns whether the key was present.
pub(crate) fn remove(table: &mut Table, key: &str) -> bool {
    match key.split_once('.') {
        Some((first, rest)) => match table.get_mut(first) {
            Some(Value::Table(inner)) => remove(inner, rest),
            _ => false,
        },
        None => table.remove(key).is_some(),
    }
}
