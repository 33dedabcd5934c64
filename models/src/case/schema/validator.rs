//! A validator for the tests, with the keywords of JSON Schema that the schemas of cases and studies contain.

use regex_lite::Regex;
use serde_json::Value;

/// Checks a value. `root` is the schema that contains the definitions, `at` is the path of the value.
///
/// # Errors
/// The path of the first part that does not conform, and the keyword.
pub(crate) fn check(root: &Value, schema: &Value, value: &Value, at: &str) -> Result<(), String> {
    let Some(rules) = schema.as_object() else {
        return if schema == true { Ok(()) } else { Err(format!("{at} is not allowed")) };
    };
    if let Some(path) = rules.get("$ref").and_then(Value::as_str) {
        let definition = root.pointer(&path[1..]).unwrap_or_else(|| panic!("no {path}"));
        return check(root, definition, value, at);
    }
    let valid = |schema: &Value, value: &Value, at: &str| check(root, schema, value, at);
    let entries = || value.as_object().into_iter().flatten();
    let items = || value.as_array().into_iter().flatten();
    for (keyword, rule) in rules {
        let bound = rule.as_f64().unwrap_or(f64::NAN);
        let number = value.as_f64();
        let forms = || rule.as_array().expect("a list of schemas").iter();
        let valid_forms = || forms().filter(|form| valid(form, value, at).is_ok()).count();
        let holds = match keyword.as_str() {
            "$schema" | "title" | "description" | "default" | "definitions" => true,
            "type" => rule
                .as_array()
                .map_or_else(|| is_a(value, rule), |all| all.iter().any(|one| is_a(value, one))),
            "const" => value == rule,
            "enum" => forms().any(|one| one == value),
            "minimum" => number.is_none_or(|x| x >= bound),
            "maximum" => number.is_none_or(|x| x <= bound),
            "exclusiveMinimum" => number.is_none_or(|x| x > bound),
            "exclusiveMaximum" => number.is_none_or(|x| x < bound),
            "minItems" => value.as_array().is_none_or(|all| all.len() as f64 >= bound),
            "maxItems" => value.as_array().is_none_or(|all| all.len() as f64 <= bound),
            "pattern" => {
                value.as_str().is_none_or(|text| matches(rule.as_str().unwrap_or_default(), text))
            }
            "required" => value.as_object().is_none_or(|map| {
                forms().all(|key| map.contains_key(key.as_str().unwrap_or_default()))
            }),
            "not" => valid(rule, value, at).is_err(),
            "anyOf" => valid_forms() > 0,
            "oneOf" => valid_forms() == 1,
            "allOf" => {
                forms().try_for_each(|form| valid(form, value, at))?;
                true
            }
            "items" => {
                for (k, item) in items().enumerate() {
                    let of_item = rule.as_array().map_or(rule, |rules| &rules[k]);
                    valid(of_item, item, &format!("{at}[{k}]"))?;
                }
                true
            }
            "propertyNames" => {
                entries().try_for_each(|(key, _)| {
                    valid(rule, &key.as_str().into(), &format!("{at}.{key}"))
                })?;
                true
            }
            "properties" | "patternProperties" | "additionalProperties" => {
                for (key, inner) in entries() {
                    if let Some(of_key) = rule_of_key(rules, keyword, key) {
                        valid(of_key, inner, &format!("{at}.{key}"))?;
                    }
                }
                true
            }
            other => panic!("the validator has no keyword {other:?}"),
        };
        if !holds {
            return Err(format!("{at} = {value} violates {keyword} {rule}"));
        }
    }
    Ok(())
}

/// The schema for the value of a key according to one of the keywords for tables.
fn rule_of_key<'a>(
    rules: &'a serde_json::Map<String, Value>,
    keyword: &str,
    key: &str,
) -> Option<&'a Value> {
    let named = rules.get("properties").and_then(|all| all.get(key));
    let patterns = rules.get("patternProperties").and_then(Value::as_object);
    let matched = patterns.and_then(|all| all.iter().find(|(pattern, _)| matches(pattern, key)));
    match keyword {
        "properties" => named,
        "patternProperties" => matched.map(|(_, rule)| rule),
        _ => rules.get(keyword).filter(|_| named.is_none() && matched.is_none()),
    }
}

fn matches(pattern: &str, text: &str) -> bool {
    Regex::new(pattern).expect("a regular expression").is_match(text)
}

fn is_a(value: &Value, name: &Value) -> bool {
    match name.as_str() {
        Some("object") => value.is_object(),
        Some("array") => value.is_array(),
        Some("string") => value.is_string(),
        Some("boolean") => value.is_boolean(),
        Some("number") => value.is_number(),
        Some("integer") => value.as_f64().is_some_and(|x| x.fract() == 0.0),
        _ => panic!("the validator has no type {name}"),
    }
}
