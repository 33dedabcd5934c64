//! Finds lists that the deserialiser accepts and the schema does not.
//!
//! - A list in the place of a table: `design = []` or `[[design]]` in place of `[design]`. The deserialiser of a struct
//!   accepts a list with the values in the order of the fields. Such a list would set keys without their names, and an
//!   empty list would silently select all defaults.
//! - A list with too many values: `lean = [0.0, 0.1, 0.2]` in place of two values. The deserialiser of an array with a
//!   fixed length ignores further values.

use std::ops::Range;
use std::path::Path;
use std::sync::OnceLock;

use serde_json::Value;
use toml::de::{DeArray, DeTable, DeValue};

use super::Case;
use super::excerpt::excerpt;
use super::schema::schema_of;
use crate::error::InputError;

/// A list that the schema does not allow.
pub(crate) struct WrongList {
    /// Dotted path of the key.
    key: String,
    /// Range of the value, or of the header `[[key]]`.
    span: Range<usize>,
    fault: Fault,
}

/// Reason why a list is wrong.
enum Fault {
    /// The schema expects a table, not a list.
    ForTable,
    /// It has `length` values. The schema allows at most `most`.
    TooLong { length: usize, most: usize },
}

impl WrongList {
    /// Last part of the key, without the index of an item.
    pub(super) fn last_key(&self) -> &str {
        let last = self.key.rsplit('.').next().unwrap_or_default();
        last.split('[').next().unwrap_or_default()
    }

    /// Creates the error of a list in the `text` of the file `path`.
    pub(crate) fn error(&self, text: &str, path: &Path) -> InputError {
        let Self { key, span, fault } = self;
        let written = text.get(span.clone()).unwrap_or_default();
        let excerpt = Some(Box::new(excerpt(text, span.clone())));
        if let Fault::TooLong { length, most } = fault {
            let problem = format!("has {length} values; at most {most} are expected");
            let help = format!("Keep the {most} values that are meant.");
            return InputError { excerpt, ..InputError::new(path, key, written, problem, help) };
        }
        let is_header = written.starts_with("[[");
        let is_item = key.ends_with(']');
        let (value, help) = match (is_header, is_item) {
            (true, _) => {
                ("", format!("Write the header with single brackets, [{key}], and only once."))
            }
            (_, true) => (written, "Write each item as a table: { key = value, … }.".to_owned()),
            _ => {
                let last = self.last_key();
                let help = format!("Write it as a table: {last} = {{ key = value, … }}.");
                (written, help)
            }
        };
        let problem = "is a list; a table is expected";
        InputError { excerpt, ..InputError::new(path, key, value, problem, help) }
    }
}

/// Removes all lists from a case that its schema does not allow, and returns them.
pub(super) fn remove_wrong_lists(case: &mut DeTable<'_>) -> Vec<WrongList> {
    static SCHEMA: OnceLock<Value> = OnceLock::new();
    let schema = SCHEMA.get_or_init(|| schema_of::<Case>("Breccia case"));
    wrong_lists(case, schema)
}

/// Removes all lists from a file that `schema` does not allow, and returns them.
pub(crate) fn wrong_lists(file: &mut DeTable<'_>, schema: &Value) -> Vec<WrongList> {
    let mut search = Search { root: schema, found: Vec::new() };
    let forms = search.forms([schema]);
    search.table(file, &forms, "");
    search.found
}

struct Search<'s> {
    root: &'s Value,
    found: Vec<WrongList>,
}

impl<'s> Search<'s> {
    /// Resolves references and alternatives. The result contains all schemas that apply to a value or are alternatives
    /// for it.
    fn forms(&self, schemas: impl IntoIterator<Item = &'s Value>) -> Vec<&'s Value> {
        let mut open: Vec<&Value> = schemas.into_iter().collect();
        let mut forms: Vec<&Value> = Vec::new();
        while let Some(schema) = open.pop() {
            if forms.iter().any(|form| std::ptr::eq(*form, schema)) {
                continue;
            }
            forms.push(schema);
            let reference = schema["$ref"].as_str().and_then(|path| path.strip_prefix('#'));
            open.extend(reference.and_then(|path| self.root.pointer(path)));
            for key in ["allOf", "anyOf", "oneOf"] {
                open.extend(schema[key].as_array().into_iter().flatten());
            }
        }
        forms
    }

    /// Searches a table to whose value `forms` apply. `before` is the path of the table with a dot at its end.
    fn table(&mut self, table: &mut DeTable<'_>, forms: &[&'s Value], before: &str) {
        let mut wrong = Vec::new();
        for (name, value) in table.iter_mut() {
            let of_key = forms.iter().flat_map(|form| {
                let named = form["properties"].get(name.get_ref().as_ref());
                let patterns = form["patternProperties"].as_object().into_iter().flatten();
                let others =
                    patterns.map(|(_, schema)| schema).chain(form.get("additionalProperties"));
                // a key with its own schema needs no other schema
                named.into_iter().chain(others.filter(move |_| named.is_none()))
            });
            let of_key = self.forms(of_key);
            let key = format!("{before}{}", name.get_ref());
            let span = value.span();
            if let Some(fault) = self.fault(value.get_mut(), &of_key, &key) {
                self.found.push(WrongList { key, span, fault });
                wrong.push(name.clone());
            }
        }
        wrong.iter().for_each(|name| drop(table.remove(name)));
    }

    /// Returns why a value is a wrong list. If it is none, searches the value.
    fn fault(&mut self, value: &mut DeValue<'_>, forms: &[&'s Value], key: &str) -> Option<Fault> {
        match value {
            DeValue::Table(inner) => self.table(inner, forms, &format!("{key}.")),
            DeValue::Array(_) if !allows(forms, "array") => {
                return allows(forms, "object").then_some(Fault::ForTable);
            }
            DeValue::Array(list) => {
                let length = list.len();
                // a key with several forms has a reader of its own, which explains the forms
                let most = most_items(forms).filter(|_| !allows(forms, "object"));
                if let Some(most) = most.filter(|most| length > *most) {
                    return Some(Fault::TooLong { length, most });
                }
                self.items(list, forms, key);
            }
            _ => {}
        }
        None
    }

    fn items(&mut self, list: &mut DeArray<'_>, forms: &[&'s Value], key: &str) {
        let of_items = forms.iter().flat_map(|form| match &form["items"] {
            Value::Array(of_each) => of_each.iter().collect(),
            Value::Null => Vec::new(),
            of_all => vec![of_all],
        });
        let of_items = self.forms(of_items);
        if of_items.is_empty() {
            return;
        }
        let mut right = DeArray::new();
        for (index, mut item) in std::mem::replace(list, DeArray::new()).into_iter().enumerate() {
            let (key, span) = (format!("{key}[{index}]"), item.span());
            match self.fault(item.get_mut(), &of_items, &key) {
                Some(fault) => self.found.push(WrongList { key, span, fault }),
                None => right.push(item),
            }
        }
        *list = right;
    }
}

/// Returns the largest number of items of a list, if all schemas of lists limit it.
fn most_items(forms: &[&Value]) -> Option<usize> {
    let of_lists = forms.iter().filter(|form| allows(&[form], "array"));
    let most = of_lists.map(|form| form["maxItems"].as_u64().map(|most| most as usize));
    most.collect::<Option<Vec<_>>>()?.into_iter().max()
}

/// Whether one of the schemas allows a value of a type.
fn allows(forms: &[&Value], kind: &str) -> bool {
    /// Keywords that restrict a value or refer to schemas that do.
    const RESTRICTING: [&str; 9] = [
        "$ref",
        "allOf",
        "anyOf",
        "oneOf",
        "enum",
        "const",
        "properties",
        "required",
        "propertyNames",
    ];
    forms.iter().any(|form| match (form, &form["type"]) {
        (Value::Bool(allowed), _) => *allowed,
        (_, Value::String(only)) => only == kind,
        (_, Value::Array(types)) => types.iter().any(|name| name == kind),
        (Value::Object(form), _) => !RESTRICTING.iter().any(|keyword| form.contains_key(*keyword)),
        _ => false,
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::super::CaseFile;
    use super::*;

    /// Returns the first error of a text.
    fn mistakes(text: &str) -> Vec<String> {
        let (_, mistakes) = CaseFile::parse_all(text, Path::new("case.toml"));
        mistakes.iter().map(ToString::to_string).collect()
    }

    /// Removes the lines of a table and of the tables in it.
    fn without_table(text: &str, table: &str) -> String {
        let mut is_inside = false;
        let keep = |line: &&str| {
            if let Some(header) = line.trim().strip_prefix('[') {
                let name = header.trim_start_matches('[').split(']').next().unwrap_or_default();
                is_inside = name == table || name.starts_with(&format!("{table}."));
            }
            !is_inside
        };
        text.lines().filter(keep).map(|line| format!("{line}\n")).collect()
    }

    /// Every table of the schema with its dotted path. A table of free names (regions, parameters) has the name `matrix`.
    fn tables(root: &Value) -> BTreeSet<String> {
        let search = Search { root, found: Vec::new() };
        let mut all = BTreeSet::new();
        let mut open = vec![(String::new(), search.forms([root]), 0)];
        while let Some((path, forms, depth)) = open.pop() {
            if depth > 0 && allows(&forms, "object") && !allows(&forms, "array") {
                all.insert(path.clone());
            }
            if depth == 4 {
                continue;
            }
            let dot = if path.is_empty() { "" } else { "." };
            for form in &forms {
                for (key, value) in form["properties"].as_object().into_iter().flatten() {
                    open.push((format!("{path}{dot}{key}"), search.forms([value]), depth + 1));
                }
                if let Some(value) = form.get("additionalProperties").filter(|v| v.is_object()) {
                    open.push((format!("{path}{dot}matrix"), search.forms([value]), depth + 1));
                }
            }
        }
        all
    }

    #[test]
    fn a_list_is_refused_in_the_place_of_every_table() {
        let schema = schema_of::<Case>("case");
        let all = tables(&schema);
        for known in
            ["design", "experiments.read", "qoi", "material.matrix", "specimen.scan", "fidelity"]
        {
            assert!(all.contains(known), "{known}: {all:?}");
        }
        for table in &all {
            let inline = format!("{table} = []\n");
            let text = match table.split_once('.') {
                None => format!("{inline}{}", without_table(Case::TEMPLATE, table)),
                Some((first, rest)) => {
                    format!("{}[{first}]\n{rest} = []\n", without_table(Case::TEMPLATE, first))
                }
            };
            let mistakes = mistakes(&text);
            let of_key = |m: &&String| m.contains(&format!(": {table} = []: is a list"));
            let [mistake] = &mistakes.iter().filter(of_key).collect::<Vec<_>>()[..] else {
                panic!("{table}: {mistakes:#?}")
            };
            let line = match table.contains('.') {
                true => text.lines().count(),
                false => 1,
            };
            let location =
                format!("case.toml:{line}: {table} = []: is a list; a table is expected.");
            assert!(mistake.starts_with(&location), "{mistake}");
            let last = table.rsplit('.').next().unwrap();
            assert!(
                mistake.contains(&format!("help: Write it as a table: {last} = {{")),
                "{mistake}"
            );
        }
        assert!(all.len() > 40, "{all:?}");
    }

    #[test]
    fn lists_with_too_many_values_are_refused() {
        let case = Case::TEMPLATE;
        for (right, wrong, key) in [
            (
                "percentiles = [0.1, 99.9]",
                "percentiles = [0.1, 99.9, 100.0]",
                "specimen.image.percentiles",
            ),
            ("lean = [0.0, 0.0]", "lean = [0.0, 0.0, 0.2]", "specimen.scan.lean"),
        ] {
            assert!(case.contains(right), "{right}");
            let found = mistakes(&case.replacen(right, wrong, 1));
            assert_eq!(found.len(), 1, "{found:#?}");
            let problem = "has 3 values; at most 2 are expected";
            assert!(found[0].contains(key) && found[0].contains(problem), "{found:#?}");
        }
    }

    #[test]
    fn headers_with_two_brackets_and_items_that_are_lists_are_refused() {
        let template = Case::TEMPLATE;
        let start = template.find("\n[design]").unwrap() + 1;
        let line = template[..start].lines().count() + 1;
        let found = mistakes(&template.replacen("\n[design]", "\n[[design]]", 1));
        assert_eq!(found.len(), 1, "{found:#?}");
        for part in
            [&format!("case.toml:{line}: design: is a list")[..], "single brackets, [design]"]
        {
            assert!(found[0].contains(part), "{part}: {}", found[0]);
        }
        let found = mistakes(&format!("extend = [[9]]\n{template}"));
        assert!(found[0].contains("case.toml:1: extend[0] = [9]: is a list"), "{found:#?}");
    }
}
