//! Changes individual keys of a case, which are named by dotted paths.

use toml::{Table, Value};

/// Creates the nested tables that `a.b = value` means in TOML.
pub(crate) fn nested(key: &str, value: Value) -> Table {
    match key.split_once('.') {
        Some((first, rest)) => Table::from_iter([(first.to_owned(), nested(rest, value).into())]),
        None => Table::from_iter([(key.to_owned(), value)]),
    }
}

/// Keys of `[test]` that state a load of constant speed, and the key of the load program, which replaces them.
const CONSTANT_SPEED: [&str; 2] = ["displacement_mm", "duration_s"];
const PROGRAM: &str = "program";

/// Copies all values of `set` into `table`, recursively for tables within tables. A load program in `set` replaces the
/// constant speed in `table`, and the reverse.
pub(crate) fn merge(table: &mut Table, set: &Table) {
    if set.contains_key(PROGRAM) {
        CONSTANT_SPEED.iter().for_each(|key| drop(table.remove(*key)));
    } else if CONSTANT_SPEED.iter().any(|key| set.contains_key(*key)) {
        table.remove(PROGRAM);
    }
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
