//! The page of the guide from `cargo new` to a first posterior: the test writes and compiles the files of the page and
//! runs its test.

use std::path::Path;
use std::process::Command;

use crate::rustc_with_ppl;

const PAGE: &str = include_str!("../../docs/guide/first_crate.md");

/// The first code block of the page in a given language.
fn block(language: &str) -> &'static str {
    let start = format!("```{language}\n");
    let (_, rest) = PAGE.split_once(&start).unwrap_or_else(|| panic!("no block {language}"));
    rest.split_once("```").expect("a block ends").0
}

fn succeed(command: &mut Command) -> String {
    let output = command.output().expect("the program starts");
    let text =
        [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert!(output.status.success(), "{command:?}\n{}{}", text[0], text[1]);
    text[0].clone()
}

#[test]
fn a_first_crate_as_on_the_page() {
    let folder = tempfile::tempdir().unwrap();
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let new = block("console").lines().next().expect("a command");
    let arguments: Vec<&str> = new.split(' ').skip(1).collect();
    succeed(Command::new(&cargo).args(arguments).args(["--vcs", "none"]).current_dir(&folder));
    let package = folder.path().join("heights");

    // the manifest of the page, with the path of this checkout
    let ppl = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../ppl").canonicalize().unwrap();
    let manifest = block("toml").replace("../breccia/ppl", &ppl.to_string_lossy());
    let parsed: toml::Value = toml::from_str(&manifest).expect("a manifest");
    assert!(parsed["profile"]["dev"]["opt-level"].as_integer() > Some(0));
    std::fs::write(package.join("Cargo.toml"), &manifest).unwrap();
    std::fs::write(package.join("src/lib.rs"), block("rust")).unwrap();
    std::fs::create_dir(package.join("tests")).unwrap();
    std::fs::write(package.join("tests/posterior.rs"), block("rust,ignore")).unwrap();
    let metadata = ["metadata", "--offline", "--no-deps", "--format-version=1"];
    let metadata = succeed(Command::new(&cargo).args(metadata).current_dir(&package));
    assert!(metadata.contains("\"heights\""), "{metadata}");

    // linked with the `ppl` of this test, so that `ppl` is not compiled again
    let library = package.join("libheights.rlib");
    succeed(
        rustc_with_ppl()
            .args(["--crate-type=lib", "--crate-name=heights", "-o"])
            .args([&library, &package.join("src/lib.rs")]),
    );
    let test = package.join("posterior");
    succeed(
        rustc_with_ppl()
            .args(["--test", "--crate-name=posterior", "--extern"])
            .arg(format!("heights={}", library.display()))
            .arg("-o")
            .args([&test, &package.join("tests/posterior.rs")]),
    );
    let said = succeed(Command::new(&test).arg("--nocapture"));
    assert!(said.contains("1 passed") && said.contains("predicted"), "{said}");
}
