//! `breccia schema`: the schemas are valid, and the program accepts no case that they refuse.

use std::collections::BTreeMap;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::accepted::{schema, validator};
use super::{SMALL, breccia};

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(path: &str) -> String {
    std::fs::read_to_string(workspace().join(path)).expect(path)
}

/// Files that the repository supplies, and files with mistakes: kind, text, and whether the file is right.
fn files() -> Vec<(&'static str, String, bool)> {
    let cases = [
        "models/cases/default.toml",
        "models/cases/fast-and-slow.toml",
        "models/cases/own-data/case.toml",
        "studies/bonded-granular/coarse.toml",
        "studies/viscoelastic/base.toml",
    ];
    let studies = ["studies/bonded-granular.toml", "studies/viscoelastic.toml"];
    let mut files: Vec<_> = cases.iter().map(|path| ("case", read(path), true)).collect();
    files.extend(studies.iter().map(|path| ("study", read(path), true)));
    files.push(("case", SMALL.to_owned(), true));
    for (from, to) in [
        ("radius_mm = 2.5", "radus_mm = 2.5"),
        ("radius_mm = 2.5", "radius_mm = \"2.5\""),
        ("poisson = 0.25", "poisson = 0.5"),
        ("order = 1", "order = 3"),
        ("matrix.viscosity_mpa_s = [0.05, 0.55]", "matrix.viscosity = [0.05, 0.55]"),
        ("[0.05, 0.55]", "[0.05]"),
        ("length_mm = 0.06", ""),
        ("steps = 4", "steps = 4.5"),
    ] {
        assert!(SMALL.contains(from), "{from}");
        files.push(("case", SMALL.replacen(from, to, 1), false));
    }
    files
}

#[test]
fn the_schemas_accept_supplied_files_and_refuse_mistakes() {
    let dir = tempfile::tempdir().unwrap();
    let schemas: BTreeMap<_, _> = ["case", "study"].map(|kind| (kind, schema(kind))).into();
    for (kind, text, is_right) in files() {
        let table = serde_json::to_value(text.parse::<toml::Table>().unwrap()).unwrap();
        let checked = validator::check(&schemas[kind], &schemas[kind], &table, "");
        assert_eq!(checked.is_ok(), is_right, "{checked:?}\n{text}");
        if !is_right {
            std::fs::write(dir.path().join("bad.toml"), text).unwrap();
            assert_eq!(breccia(dir.path(), &["check", "bad.toml"]).status.code(), Some(1));
        }
    }
}

/// The schemas conform to draft 7, and an independent validator agrees about the files.
#[test]
fn another_validator_agrees() {
    let python = std::env::var("BRECCIA_PYTHON").unwrap_or_else(|_| "python3".into());
    let probe = Command::new(&python).args(["-c", "import jsonschema"]).output();
    if !probe.is_ok_and(|output| output.status.success()) {
        // written to standard error directly, because the test harness hides the output of a passing test
        let note = "SKIPPED: no Python with jsonschema (set BRECCIA_PYTHON to one that has it)";
        writeln!(std::io::stderr(), "{note}").expect("stderr is open");
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let files = files().into_iter().map(|(kind, text, is_right)| {
        let table: toml::Table = text.parse().unwrap();
        serde_json::json!([kind, table, is_right])
    });
    let input = serde_json::json!({
        "schemas": { "case": schema("case"), "study": schema("study") },
        "files": files.collect::<Vec<_>>(),
    });
    let path = dir.path().join("input.json");
    std::fs::write(&path, input.to_string()).unwrap();
    let script = "import json, sys, jsonschema\n\
                  data = json.load(open(sys.argv[1]))\n\
                  validator = jsonschema.Draft7Validator\n\
                  for schema in data['schemas'].values():\n    validator.check_schema(schema)\n\
                  for kind, file, is_right in data['files']:\n    \
                  errors = [e.message for e in validator(data['schemas'][kind]).iter_errors(file)]\n    \
                  assert (not errors) == is_right, (errors, file)\n";
    let output = Command::new(python).args(["-c", script]).arg(path).output().expect("starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
}
