//! Property tests with absurd values: each case is accepted or refused with a message, and never causes a panic.

use std::path::Path;

use proptest::prelude::*;
use toml::{Table, Value};

use super::{Case, CaseFile};

/// Collects the dotted keys of all values.
fn keys(table: &Table, front: &str, paths: &mut Vec<String>) {
    for (key, value) in table {
        paths.push(format!("{front}{key}"));
        if let Value::Table(inner) = value {
            keys(inner, &format!("{front}{key}."), paths);
        }
    }
}

/// Replaces the value of a dotted key.
fn put(table: &mut Table, key: &str, value: Value) {
    match key.split_once('.') {
        Some((first, rest)) => {
            if let Some(Value::Table(inner)) = table.get_mut(first) {
                put(inner, rest, value);
            }
        }
        None => {
            table.insert(key.to_owned(), value);
        }
    }
}

fn absurd() -> impl Strategy<Value = Value> {
    let number = prop_oneof![
        any::<f64>(),
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(-1.0),
        Just(0.0),
        Just(1e-300),
        Just(1e300),
    ];
    let whole = prop_oneof![any::<i64>(), Just(-1), Just(0), Just(1_000_000_000), Just(i64::MAX)];
    let leaf = prop_oneof![
        number.prop_map(Value::Float),
        whole.prop_map(Value::Integer),
        ".{0,12}".prop_map(Value::String),
        any::<bool>().prop_map(Value::Boolean),
        Just(Value::Table(Table::new())),
    ];
    let list = prop::collection::vec(leaf.clone(), 0..4).prop_map(Value::Array);
    prop_oneof![4 => leaf, 1 => list]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn absurd_values_are_refused_in_words(
        changes in prop::collection::vec((any::<prop::sample::Index>(), absurd()), 1..4),
    ) {
        let mut table: Table = CaseFile::default_case().case.to_toml().parse().unwrap();
        let mut all = Vec::new();
        keys(&table, "", &mut all);
        for (key_index, value) in changes {
            put(&mut table, &all[key_index.index(all.len())], value);
        }
        match CaseFile::parse(&table.to_string(), Path::new("case.toml")) {
            Ok(file) => {
                prop_assert!(file.geometry().is_ok());
                // an accepted case can be written and read again
                let again = CaseFile::parse(&file.case.to_toml(), &file.path);
                prop_assert!(again.is_ok(), "{again:?}");
            }
            Err(error) => {
                prop_assert!(!error.problem.is_empty() && error.help.ends_with('.'), "{error}");
            }
        }
    }

    #[test]
    fn any_text_is_a_case_or_none(text in "\\PC{0,200}") {
        let _ = CaseFile::parse(&text, Path::new("case.toml"));
        let broken = Case::TEMPLATE.replacen("= ", &format!("= {text}"), 1);
        let _ = CaseFile::parse(&broken, Path::new("case.toml"));
    }
}
