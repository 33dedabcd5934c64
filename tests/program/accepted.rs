//! Checks that the schema accepts every case that the program accepts in these tests.

use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use serde_json::Value;

#[path = "../../models/src/case/schema/validator.rs"]
pub(crate) mod validator;

/// The schema that `breccia schema` prints.
pub(crate) fn schema(kind: &str) -> Value {
    let program = Command::new(env!("CARGO_BIN_EXE_breccia")).args(["schema", kind]).output();
    let output = program.expect("cargo has built the program");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Checks the cases that a successful command has read.
pub(crate) fn check_cases(folder: &Path, arguments: &[&str], is_success: bool) {
    static SCHEMA: OnceLock<Value> = OnceLock::new();
    if !is_success || arguments.iter().any(|argument| ["init", "study"].contains(argument)) {
        return;
    }
    for name in arguments.iter().filter(|name| name.ends_with(".toml")) {
        let text = std::fs::read_to_string(folder.join(name)).expect("the command has read it");
        let Ok(table) = text.parse::<toml::Table>() else { continue };
        if table.contains_key("base") {
            continue;
        }
        let schema = SCHEMA.get_or_init(|| schema("case"));
        let case = serde_json::to_value(table).expect("JSON");
        validator::check(schema, schema, &case, name).unwrap_or_else(|e| panic!("{e}\n{text}"));
    }
}
