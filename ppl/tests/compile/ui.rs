//! Messages of the compiler for mistakes in models.
//!
//! Every file of `tests/ui` is compiled. A line that ends in `//~` has one mistake and must give one error; in
//! `types.rs` it must give one or more.

use std::fmt::Write;
use std::path::Path;

use serde_json::Value;

use crate::{rustc, rustc_with_ppl};

/// The version of rustc whose messages the expected output contains.
const TOOLCHAIN: &str = "rustc 1.95.";

/// Environment variable that makes the test write the expected output.
const OVERWRITE: &str = "UI_OVERWRITE";

/// The errors of one file in the order of their lines.
struct Said {
    lines: Vec<u64>,
    text: String,
}

fn compile(source: &Path) -> Said {
    let out = tempfile::tempdir().unwrap();
    let output = rustc_with_ppl()
        .args(["--emit=metadata", "--error-format=json"])
        .arg("--out-dir")
        .arg(out.path())
        .arg(source)
        .output()
        .unwrap();
    let messages = String::from_utf8(output.stderr).unwrap();
    let mut errors: Vec<(u64, u64, String)> = messages
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).expect("rustc writes JSON"))
        .filter(|message| message["level"] == "error" && !message["spans"][0].is_null())
        .map(|message| shown(&message))
        .collect();
    errors.sort();
    let text = errors.iter().map(|(_, _, text)| text.as_str()).collect::<Vec<_>>().join("\n");
    Said { lines: errors.into_iter().map(|(line, _, _)| line).collect(), text }
}

/// Position, message, labels and advice of one error. Advice on the inside of the library is left out, such as the
/// lists of types that implement a trait, which change as the library grows.
fn shown(error: &Value) -> (u64, u64, String) {
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let spans = error["spans"].as_array().unwrap();
    let primary = spans.iter().find(|span| span["is_primary"] == true).unwrap();
    let place = |span: &Value| {
        (span["line_start"].as_u64().unwrap(), span["column_start"].as_u64().unwrap())
    };
    let (line, column) = place(primary);
    let mut shown = format!("{line}:{column}: {}\n", text(&error["message"]));
    for span in spans.iter().filter(|span| span["file_name"] == primary["file_name"]) {
        if span["label"].is_string() {
            let (line, column) = place(span);
            writeln!(shown, "    {line}:{column}: {}", text(&span["label"])).unwrap();
        }
    }
    for child in error["children"].as_array().unwrap() {
        let message = text(&child["message"]);
        let is_noise = message.contains("following other types implement")
            || message.starts_with("required ")
            || message.contains("originates in the macro")
            || message.contains("the full name for the type")
            || message.contains("consider using `--verbose`");
        if !is_noise && !message.is_empty() {
            let message = message.replace('\n', " ");
            writeln!(shown, "    {}: {message}", text(&child["level"])).unwrap();
        }
    }
    (line, column, shown)
}

/// Every mistake gives one error, in the line of the mistake, with the expected message.
#[test]
fn one_mistake_is_one_error() {
    let version = rustc().arg("--version").output();
    let version = version.map(|output| String::from_utf8_lossy(&output.stdout).into_owned());
    if !version.as_ref().is_ok_and(|version| version.starts_with(TOOLCHAIN)) {
        eprintln!("SKIPPED: expected messages are those of {TOOLCHAIN}*, this is {version:?}");
        return;
    }
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../ppl/tests/ui");
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut sources: Vec<_> =
        files.filter(|path| path.extension() == Some("rs".as_ref())).collect();
    sources.sort();
    let (mut seen, mut wrong) = (0, String::new());
    for source in sources {
        let said = compile(&source);
        let expected = source.with_extension("stderr");
        if std::env::var_os(OVERWRITE).is_some() {
            std::fs::write(&expected, &said.text).unwrap();
        }
        let code = std::fs::read_to_string(&source).unwrap();
        let numbered = (1..).zip(code.lines());
        let mistakes: Vec<u64> = numbered
            .filter(|(_, line)| line.trim_end().ends_with("//~"))
            .map(|(number, _)| number)
            .collect();
        let mut lines = said.lines;
        if source.ends_with("types.rs") {
            // if a type lacks two traits, rustc may report an error for each
            lines.dedup();
        }
        if mistakes != lines {
            writeln!(wrong, "{}: mistakes in the lines {mistakes:?}", source.display()).unwrap();
            writeln!(wrong, "but errors in the lines {lines:?}\n{}", said.text).unwrap();
        } else if std::fs::read_to_string(&expected).unwrap_or_default() != said.text {
            writeln!(wrong, "{}: now said\n{}", source.display(), said.text).unwrap();
        }
        seen += mistakes.len();
    }
    assert!(wrong.is_empty(), "{wrong}\nif the new words are right: {OVERWRITE}=1");
    assert!(seen > 100, "{seen} mistakes found");
}
