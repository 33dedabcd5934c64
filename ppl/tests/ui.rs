//! What the compiler says to mistakes in models.

use std::process::Command;

/// Messages of rustc itself stand in the expected output: it is that of one version.
const TOOLCHAIN: &str = "rustc 1.95.";

#[test]
fn messages() {
    let rustc = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let version = Command::new(rustc).arg("--version").output();
    let version = version.map(|output| String::from_utf8_lossy(&output.stdout).into_owned());
    match version {
        Ok(version) if version.starts_with(TOOLCHAIN) => {}
        other => {
            eprintln!("SKIPPED: expected messages are those of {TOOLCHAIN}*, this is {other:?}");
            return;
        }
    }
    let cases = trybuild::TestCases::new();
    cases.compile_fail("tests/ui/*.rs");
    cases.pass("tests/ui/pass/*.rs");
}

/// One mistake, one error, in the line of the mistake. Where a type is wrong (`types.rs`), rustc
/// may explain it twice, in that line.
#[test]
fn one_mistake_is_one_error() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/ui");
    let mut mistakes_seen = 0;
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "rs") {
            continue;
        }
        let source = std::fs::read_to_string(&path).unwrap();
        let said = std::fs::read_to_string(path.with_extension("stderr")).unwrap();
        let numbered = (1..).zip(source.lines());
        let mistakes: Vec<u32> = numbered
            .filter(|(_, line)| line.trim_end().ends_with("//~"))
            .map(|(number, _)| number)
            .collect();
        // "error: …" and, in the line after it, " --> tests/ui/tilde.rs:6:37"
        let mut lines = said.lines();
        let mut errors: Vec<u32> = Vec::new();
        while let Some(line) = lines.next() {
            if line.starts_with("error") {
                let place = lines.find(|line| line.trim_start().starts_with("-->"));
                let line = place.and_then(|place| place.rsplit(':').nth(1)?.parse().ok());
                errors.push(line.unwrap());
            }
        }
        errors.sort_unstable();
        if path.ends_with("types.rs") {
            errors.dedup();
        }
        assert_eq!(mistakes, errors, "{}", path.display());
        mistakes_seen += mistakes.len();
    }
    assert!(mistakes_seen > 70, "{mistakes_seen} mistakes found");
}
