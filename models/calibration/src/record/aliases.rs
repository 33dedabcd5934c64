//! Other names of values in a case.

use schemars::{Schema, json_schema};

/// Adds other names to the schema of an enumeration.
pub(super) fn aliases(names: &'static [&'static str]) -> impl FnMut(&mut Schema) {
    move |schema| {
        if let Some(forms) = schema.get_mut("oneOf").and_then(|forms| forms.as_array_mut()) {
            forms.push(json_schema!({ "type": "string", "enum": names }).to_value());
        }
    }
}
