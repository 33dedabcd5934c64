//! A case that is another one but for some keys, which are named by their paths.

use toml::{Table, Value};

/// `a.b = value` as tables.
pub(crate) fn nested(key: &str, value: Value) -> Table {
    match key.split_once('.') {
        Some((first, rest)) => Table::from_iter([(first.to_owned(), nested(rest, value).into())]),
        None => Table::from_iter([(key.to_owned(), value)]),
    }
}

/// Gives a table what another one has otherwise, key by key.
pub(crate) fn merge(table: &mut Table, set: &Table) {
    for (key, value) in set {
        match (table.get_mut(key), value) {
            (Some(Value::Table(inner)), Value::Table(set)) => merge(inner, set),
            _ => drop(table.insert(key.clone(), value.clone())),
        }
    }
}

/// Takes a key out, by its path; whether it was there.
pub(crate) fn remove(table: &mut Table, key: &str) -> bool {
    match key.split_once('.') {
        Some((first, rest)) => match table.get_mut(first) {
            Some(Value::Table(inner)) => remove(inner, rest),
            _ => false,
        },
        None => table.remove(key).is_some(),
    }
}
