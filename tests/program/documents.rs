//! Checks that every command and every option of `breccia` that a document names exists.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::{breccia, said};

fn documents() -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut found = vec![root.join("README.md"), root.join("CONTRIBUTING.md")];
    let mut folders = vec![root.join("docs")];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => folders.push(path),
                false if path.extension().is_some_and(|end| end == "md") => found.push(path),
                false => {}
            }
        }
    }
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).unwrap();
        (path, text)
    };
    found.into_iter().map(read).collect()
}

/// Lines of code blocks, and texts between backticks on other lines.
fn code(text: &str) -> Vec<String> {
    let (mut found, mut is_block) = (Vec::new(), false);
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            is_block = !is_block;
        } else if is_block {
            found.push(line.split(" #").next().unwrap_or(line).to_owned());
        } else {
            found.extend(line.split('`').skip(1).step_by(2).map(str::to_owned));
        }
    }
    found
}

/// The words after `breccia` in a line of code: a command and its arguments.
fn words(line: &str) -> Option<Vec<&str>> {
    let cargo = ["cargo run --release -- ", "cargo run -- "];
    let start = cargo.iter().find_map(|cargo| line.split_once(cargo).map(|(_, rest)| rest));
    let start = start.or_else(|| {
        let (before, rest) = line.split_once("breccia ")?;
        // the name of another program may end in "breccia"
        before.chars().next_back().is_none_or(|c| c.is_whitespace()).then_some(rest)
    })?;
    Some(start.split_whitespace().collect())
}

#[test]
fn every_command_and_option_of_the_documents_is_there() {
    let dir = tempfile::tempdir().unwrap();
    let mut helps: BTreeMap<String, Option<String>> = BTreeMap::new();
    let (mut wrong, mut commands) = (Vec::new(), 0);
    for (file, text) in documents() {
        for line in code(&text) {
            let Some(words) = words(&line) else { continue };
            // `breccia segment | mesh | …`, `breccia help STAGE`, `breccia --help`
            let first = words.first().copied().unwrap_or_default();
            let name: String =
                first.chars().take_while(|c| c.is_alphanumeric() || *c == '-').collect();
            if name.is_empty() || name.starts_with('-') || name == "help" || name != first {
                continue;
            }
            commands += 1;
            let help = helps.entry(name.clone()).or_insert_with(|| {
                let (code, help, _) = said(&breccia(dir.path(), &[&name, "--help"]));
                (code == Some(0)).then_some(help)
            });
            let Some(help) = help else {
                wrong.push(format!("{}: breccia {name}", file.display()));
                continue;
            };
            for option in words.iter().filter_map(|word| word.strip_prefix("--")) {
                let option: String =
                    option.chars().take_while(|c| c.is_alphanumeric() || *c == '-').collect();
                if !option.is_empty() && !help.contains(&format!("--{option}")) {
                    wrong.push(format!("{}: breccia {name} --{option}", file.display()));
                }
            }
        }
    }
    assert!(commands > 30, "{commands} commands in the documents");
    assert!(wrong.is_empty(), "not there:\n{}", wrong.join("\n"));
}
