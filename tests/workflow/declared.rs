//! Stages read only what they declare.

use std::path::Path;

use models::Stage;
use models::workflow::{JOINT_STAGES, STAGES};

use super::finished_tiny;

#[test]
fn the_stages_of_a_finished_case_have_read_what_they_declare() {
    let out = finished_tiny().dir.path().join("results");
    let text = std::fs::read_to_string(out.join("stages.toml")).unwrap();
    for stage in STAGES.iter() {
        assert!(text.contains(&format!("[{}]", stage.name)), "{}", stage.name);
    }
    check_reads(&out);
}

/// Checks the records of all stages in a results folder, and in the folders of its tests and validations: each key of
/// the case and each product of another stage that a stage has read must be declared.
fn check_reads(out: &Path) {
    for folder in ["tests", "validation"] {
        let entries = std::fs::read_dir(out.join(folder)).into_iter().flatten().flatten();
        entries.for_each(|entry| check_reads(&entry.path()));
    }
    let Ok(text) = std::fs::read_to_string(out.join("stages.toml")) else { return };
    let Ok(records) = text.parse::<toml::Table>() else { return };
    let stages: Vec<&Stage> = match out.join("tests").is_dir() {
        true => JOINT_STAGES.iter().collect(),
        false => STAGES.iter().collect(),
    };
    let writers = |name: &str| {
        let writes = |stage: &&&Stage| {
            let record = records.get(stage.name).and_then(|record| record.get("products"));
            record.is_some_and(|products| products.get(name).is_some())
        };
        stages.iter().find(writes).map(|stage| stage.name)
    };
    let mut undeclared = Vec::new();
    for stage in &stages {
        let Some(record) = records.get(stage.name) else { continue };
        let names = |table: &str| {
            let entries = record.get(table).and_then(toml::Value::as_table);
            entries.into_iter().flat_map(|all| all.keys().cloned()).collect::<Vec<_>>()
        };
        for key in names("case").into_iter().filter(|key| !stage.reads.has_key(key)) {
            undeclared.push(format!("{}: key {key:?}", stage.name));
        }
        for name in names("files") {
            // files without a writer are inputs of the case, or products that do not exist
            let is_of_other = writers(&name).is_some_and(|writer| writer != stage.name);
            if is_of_other && !stage.reads.has_product(&name) {
                undeclared.push(format!("{}: product {name}", stage.name));
            }
        }
    }
    assert!(undeclared.is_empty(), "declare in stages/reads.rs:\n{}", undeclared.join("\n"));
}
