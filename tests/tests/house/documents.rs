//! Checks that the links, paths, packages, examples and benches that documents name exist.

use std::path::{Path, PathBuf};

use super::layers::workspace;

/// Folders of the repository that a path begins with.
const FOLDERS: [&str; 9] =
    [".ci/", "docs/", "fem/", "models/", "ppl/", "ppl-macros/", "studies/", "surrogate/", "tests/"];

/// All documents, with their text.
fn documents() -> Vec<(PathBuf, String)> {
    fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).expect("a folder of the repository") {
            let path = entry.expect("an entry").path();
            let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if path.is_dir() {
                if name != "target" && !name.starts_with('.') {
                    collect(&path, found);
                }
            } else if name.ends_with(".md") && name != "CHANGELOG.md" {
                found.push(path);
            }
        }
    }
    let mut found = Vec::new();
    collect(&workspace(), &mut found);
    let read = |path: PathBuf| {
        let text = std::fs::read_to_string(&path).expect("a readable document");
        (path, text)
    };
    let documents: Vec<_> = found.into_iter().map(read).collect();
    assert!(documents.len() > 10, "{} documents", documents.len());
    documents
}

/// Texts between backticks, each within one line.
fn spans(text: &str) -> Vec<&str> {
    let lines = text.lines().filter(|line| !line.trim_start().starts_with("```"));
    lines.flat_map(|line| line.split('`').skip(1).step_by(2)).collect()
}

/// Whether a path exists; the path may contain `*` or `{a,b}`.
fn is_there(folder: &Path, path: &str) -> bool {
    if let Some((before, (list, after))) =
        path.split_once('{').and_then(|(before, rest)| Some((before, rest.split_once('}')?)))
    {
        return list.split(',').all(|part| is_there(folder, &format!("{before}{part}{after}")));
    }
    let Some((before, after)) = path.split_once('*') else { return folder.join(path).exists() };
    let (parent, start) = before.rsplit_once('/').unwrap_or(("", before));
    let Ok(entries) = std::fs::read_dir(folder.join(parent)) else { return false };
    let end = after.split('/').next().unwrap_or_default();
    entries.flatten().any(|entry| {
        let name = entry.file_name().to_string_lossy().into_owned();
        name.starts_with(start) && name.ends_with(end)
    })
}

#[test]
fn every_link_of_a_document_leads_to_a_file() {
    let mut wrong = Vec::new();
    for (file, text) in documents() {
        for (_, target) in text.match_indices("](").map(|(at, _)| text[at + 2..].split_at(0)) {
            let target = target.split(')').next().unwrap_or_default();
            let target = target.split('#').next().unwrap_or_default();
            // links of rustdoc to items and links to the web are not checked
            let is_file = target.contains(['.', '/']) && !target.contains("::");
            if !is_file || target.contains("://") || target.contains(['\n', ' ', '`']) {
                continue;
            }
            if !file.with_file_name("").join(target).exists() {
                wrong.push(format!("{}: {target}", file.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "links that lead nowhere:\n{}", wrong.join("\n"));
}

#[test]
fn every_path_of_the_repository_that_a_document_names_is_there() {
    let mut wrong = Vec::new();
    for (file, text) in documents() {
        for span in spans(&text) {
            let words = span.split([' ', '(', ')', '"', '=']).filter(|word| {
                // paths with placeholders are not checked
                FOLDERS.iter().any(|folder| word.starts_with(folder)) && !word.contains(['<', '…'])
            });
            for word in words {
                let path = word.trim_end_matches(['.', ',', ':', ';', '/']);
                if !is_there(&workspace(), path) {
                    wrong.push(format!("{}: {path}", file.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "paths that are not there:\n{}", wrong.join("\n"));
}

/// The word after each occurrence of an option in a text.
fn arguments<'t>(text: &'t str, option: &str) -> Vec<&'t str> {
    let after = text.match_indices(option).map(|(at, _)| &text[at + option.len()..]);
    after.filter_map(|rest| rest.split([' ', '\n', '`', ')', ',', ';']).next()).collect()
}

#[test]
fn every_example_bench_and_package_that_a_document_names_is_there() {
    let root = workspace();
    let crates = [
        "fem",
        "fem/file",
        "fem/image",
        "fem/mesh",
        "fem/mpi",
        "fem/pictures",
        "models",
        "models/calibration",
        "ppl",
        "ppl-macros",
        "surrogate",
        "tests",
    ];
    let manifests: Vec<String> = crates
        .iter()
        .filter_map(|name| std::fs::read_to_string(root.join(name).join("Cargo.toml")).ok())
        .collect();
    let is_package =
        |name: &str| manifests.iter().any(|text| text.contains(&format!("name = \"{name}\"")));
    let has_file = |folder: &str, name: &str| {
        crates.iter().any(|own| {
            let folder = root.join(own).join(folder);
            folder.join(format!("{name}.rs")).exists() || folder.join(name).join("main.rs").exists()
        })
    };
    let mut wrong = Vec::new();
    for (file, text) in documents() {
        let mut check = |option: &str, is_there: &dyn Fn(&str) -> bool| {
            for line in text.lines().filter(|line| line.contains("cargo ")) {
                let named = arguments(line, option);
                let missing = named.into_iter().filter(|name| {
                    !name.is_empty()
                        && name.chars().all(|c| c.is_alphanumeric() || "-_".contains(c))
                });
                for name in missing.filter(|name| !is_there(name)) {
                    wrong.push(format!("{}: {option}{name}", file.display()));
                }
            }
        };
        check(" --example ", &|name| has_file("examples", name));
        check(" --bench ", &|name| has_file("benches", name));
        check(" -p ", &is_package);
    }
    assert!(wrong.is_empty(), "not there:\n{}", wrong.join("\n"));
}

/// Each page below `docs/` is listed in the index and in the table of contents of the book.
#[test]
fn every_page_is_in_the_index_and_in_the_book() {
    let docs = workspace().join("docs");
    let lists = ["README.md", "SUMMARY.md"].map(|name| {
        let text = std::fs::read_to_string(docs.join(name)).expect("a list of pages");
        (name, text)
    });
    let mut pages = 0;
    for (path, _) in documents() {
        let Ok(page) = path.strip_prefix(&docs) else { continue };
        let page = page.to_string_lossy();
        if lists.iter().any(|(name, _)| page == *name) {
            continue;
        }
        pages += 1;
        for (name, text) in &lists {
            assert!(text.contains(&format!("({page})")), "docs/{name} does not list docs/{page}");
        }
    }
    assert!(pages > 20, "{pages} pages");
}

#[test]
fn paths_with_patterns_are_expanded() {
    let root = workspace();
    assert!(is_there(&root, "docs/*.md") && is_there(&root, "fem/{src,tests}"));
    assert!(!is_there(&root, "docs/*.exe") && !is_there(&root, "fem/{src,gone}"));
    assert_eq!(spans("`a` and `b c`\n```sh\nd\n```\n"), ["a", "b c"]);
}
