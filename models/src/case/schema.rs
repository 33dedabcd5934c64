//! JSON Schema of case files, with which an editor completes and checks a case.
//!
//! The schema is derived from the types that read a case: descriptions are their doc comments, and their attributes
//! state the ranges. A test compares the schema with the reader.

#[cfg(test)]
pub(crate) mod tests;
#[cfg(test)]
pub(crate) mod validator;

use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema, json_schema};
use serde_json::{Map, Value};

use super::Case;

/// Path of the definitions in a schema.
const DEFINITIONS: &str = "#/definitions/";
/// End of the name of a definition without required keys: the keys of a table that replace keys of another table.
const CHANGES: &str = "Changes";

/// Returns the schema of a type that is read from a file. The schema conforms to draft 7 of JSON Schema, the latest
/// draft that Taplo reads, on which the TOML extensions of most editors are based.
pub(crate) fn schema_of<T: JsonSchema>(title: &str) -> Value {
    let settings =
        SchemaSettings::draft07().with_transform(RecursiveTransform(tidy as fn(&mut Schema)));
    let mut generator = settings.into_generator();
    let _ = (generator.subschema_for::<Case>(), generator.subschema_for::<T>());
    let mut definitions = generator.take_definitions(true);
    add_changes(&mut definitions, &Case::schema_name());
    let root = definitions.get(&*T::schema_name()).cloned().unwrap_or_default();
    let mut used = Map::new();
    add_used(&root, &definitions, &mut used);
    let mut schema = Map::from_iter([
        ("$schema".to_owned(), "http://json-schema.org/draft-07/schema#".into()),
        ("title".to_owned(), title.into()),
    ]);
    schema.extend(root.as_object().cloned().unwrap_or_default());
    schema.insert("definitions".to_owned(), used.into());
    schema.into()
}

/// Schema of a table whose keys replace or add keys of a case.
pub(crate) fn changed_case() -> Schema {
    json_schema!({ "$ref": format!("{DEFINITIONS}{}{CHANGES}", Case::schema_name()) })
}

/// Schema of a table whose keys replace or add keys of a case. Only keys of the given tables are allowed.
pub(super) fn changed_tables(tables: &[&str]) -> Schema {
    let case = format!("{DEFINITIONS}{}{CHANGES}", Case::schema_name());
    let table = |name: &&str| {
        (name.to_string(), json_schema!({ "$ref": format!("{case}/properties/{name}") }))
    };
    let tables: Vec<(String, Schema)> = tables.iter().map(table).collect();
    json_schema!({
        "type": "object",
        "properties": tables.into_iter().collect::<std::collections::BTreeMap<_, _>>(),
        "additionalProperties": false,
    })
}

/// Describes the values of a table of quantities: standard deviations in % from `least` to `most`.
pub(super) fn percent_of_quantities(least: f64, most: f64) -> impl FnMut(&mut Schema) {
    move |schema| {
        for key in ["properties", "patternProperties"] {
            let all = schema.get_mut(key).and_then(Value::as_object_mut);
            for value in all.into_iter().flat_map(Map::values_mut) {
                let text = "Standard deviation of this quantity in %.";
                *value = json_schema!({
                    "description": text, "type": "number", "minimum": least, "maximum": most,
                })
                .to_value();
            }
        }
    }
}

/// Removes null, which TOML cannot express, and details for programmers: links and examples in descriptions, formats of
/// numbers, and defaults of tables, whose keys have defaults.
fn tidy(schema: &mut Schema) {
    let Some(map) = schema.as_object_mut() else { return };
    map.remove("format");
    if map.get("default").is_some_and(|default| default.is_null() || default.is_object()) {
        map.remove("default");
    }
    if let Some(Value::String(text)) = map.get_mut("description") {
        *text = plain(text);
    }
    if let Some(Value::Array(types)) = map.get_mut("type") {
        types.retain(|name| name != "null");
        if let [only] = &types[..] {
            let only = only.clone();
            map.insert("type".to_owned(), only);
        }
    }
    let Some(Value::Array(forms)) = map.get_mut("anyOf") else { return };
    forms.retain(|form| form["type"] != "null");
    if let [only] = &forms[..] {
        let only = only.clone();
        map.remove("anyOf");
        match only {
            Value::Object(only) if map.is_empty() => *map = only,
            only => drop(map.insert("allOf".to_owned(), vec![only].into())),
        }
    }
}

/// Returns the text of a doc comment without sections, links and line breaks within paragraphs.
fn plain(text: &str) -> String {
    let text = text.split("\n# ").next().unwrap_or_default().trim();
    let paragraphs = text.split("\n\n").map(|paragraph| paragraph.replace('\n', " "));
    let mut text = paragraphs.collect::<Vec<_>>().join("\n\n");
    while let Some(end) = text.find("](") {
        let (Some(start), Some(length)) = (text[..end].rfind('['), text[end..].find(')')) else {
            break;
        };
        text = format!("{}{}{}", &text[..start], &text[start + 1..end], &text[end + length + 1..]);
    }
    text.replace("[`", "`").replace("`]", "`")
}

/// For each definition that the tables of `first` contain, adds a copy of the definition without required keys.
fn add_changes(definitions: &mut Map<String, Value>, first: &str) {
    let mut names = vec![first.to_owned()];
    while let Some(name) = names.pop() {
        let key = format!("{name}{CHANGES}");
        if definitions.contains_key(&key) {
            continue;
        }
        let mut changes = definitions.get(&name).cloned().unwrap_or_default();
        make_optional(&mut changes, definitions, &mut names);
        definitions.insert(key, changes);
    }
}

/// Removes the required keys of a table and of the tables within it, but not of tables in lists. Pushes the names of
/// the definitions to which the table refers.
fn make_optional(schema: &mut Value, definitions: &Map<String, Value>, names: &mut Vec<String>) {
    let Some(map) = schema.as_object_mut() else { return };
    // the only key of a table is the name of a variant
    if map.get("properties").and_then(Value::as_object).is_none_or(|keys| keys.len() > 1) {
        map.remove("required");
    }
    if let Some(Value::String(path)) = map.get_mut("$ref")
        && let Some(name) = path.strip_prefix(DEFINITIONS).map(str::to_owned)
        && definitions
            .get(&name)
            .is_some_and(|definition| definition.to_string().contains("\"object\""))
    {
        path.push_str(CHANGES);
        names.push(name);
    }
    for key in ["properties", "patternProperties"] {
        let tables = map.get_mut(key).and_then(Value::as_object_mut);
        let all = tables.into_iter().flat_map(Map::values_mut);
        all.for_each(|one| make_optional(one, definitions, names));
    }
    for key in ["allOf", "anyOf", "oneOf"] {
        let forms = map.get_mut(key).and_then(Value::as_array_mut);
        forms.into_iter().flatten().for_each(|one| make_optional(one, definitions, names));
    }
    if let Some(rest) = map.get_mut("additionalProperties") {
        make_optional(rest, definitions, names);
    }
}

/// Copies the definitions to which a schema refers, directly or through other definitions.
fn add_used(schema: &Value, definitions: &Map<String, Value>, used: &mut Map<String, Value>) {
    let text = schema.to_string();
    for after in text.split(&format!("\"{DEFINITIONS}")).skip(1) {
        let name = after.split(['"', '/']).next().unwrap_or_default();
        if let (false, Some(definition)) = (used.contains_key(name), definitions.get(name)) {
            used.insert(name.to_owned(), definition.clone());
            add_used(definition, definitions, used);
        }
    }
}
