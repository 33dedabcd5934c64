//! Each crate keeps to the order of rooms that its `lib.rs` states: an import goes down only, and no
//! files import each other in a circle.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::imports::{Crate, Import};

const CRATES: [&str; 10] = [
    "fem",
    "fem/file",
    "fem/image",
    "fem/mesh",
    "fem/pictures",
    "models",
    "models/calibration",
    "ppl",
    "ppl-macros",
    "surrogate",
];

/// Another checkout may be looked at in place of this one.
pub(super) fn workspace() -> PathBuf {
    match std::env::var_os("BRECCIA_HOUSE") {
        Some(folder) => folder.into(),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join(".."),
    }
}

/// The rooms that a crate's page lists, from the ground up: lines such as ``//! 3. `mesh` …``, in
/// which several names may stand in their order too.
fn stated_order(text: &str) -> Vec<String> {
    let mut order = Vec::new();
    for line in text.lines() {
        let Some(entry) = line.strip_prefix("//! ") else { continue };
        let Some((number, mut rest)) = entry.split_once(". `") else { continue };
        if number.parse::<u32>().is_err() {
            continue;
        }
        while let Some((name, after)) = rest.split_once('`') {
            order.push(name.to_owned());
            let Some(next) = after.strip_prefix(", `") else { break };
            rest = next;
        }
    }
    order
}

#[test]
fn every_crate_states_the_order_of_its_rooms() {
    for name in CRATES {
        let folder = workspace().join(name);
        let house = Crate::read(&folder);
        let text = std::fs::read_to_string(folder.join("src/lib.rs")).expect("lib.rs is there");
        let stated: BTreeSet<String> = stated_order(&text).into_iter().collect();
        let rooms: BTreeSet<String> = house.rooms().into_iter().map(String::from).collect();
        let unlisted: Vec<_> = rooms.difference(&stated).collect();
        let gone: Vec<_> = stated.difference(&rooms).collect();
        assert!(
            unlisted.is_empty() && gone.is_empty(),
            "{name}/src/lib.rs: the order of rooms lacks {unlisted:?} and names {gone:?}, which is not there"
        );
    }
}

#[test]
fn imports_go_down() {
    let mut wrong = Vec::new();
    for name in CRATES {
        let folder = workspace().join(name);
        let house = Crate::read(&folder);
        let text = std::fs::read_to_string(folder.join("src/lib.rs")).expect("lib.rs is there");
        let order = stated_order(&text);
        let floor = |room: &str| order.iter().position(|r| r == room);
        for import in house.imports() {
            let (Some(from), Some(to)) = (house.room_of(&import.from), house.room_of(&import.to))
            else {
                continue;
            };
            if let (Some(low), Some(high)) = (floor(&from), floor(&to))
                && low < high
            {
                let shown = shown(std::slice::from_ref(&import));
                wrong.push(format!("{name}: `{from}` imports from `{to}` above it:\n{shown}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{} imports go up:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn no_files_import_each_other_in_a_circle() {
    let mut wrong = Vec::new();
    for name in CRATES {
        let house = Crate::read(&workspace().join(name));
        for circle in circles(&house.imports()) {
            wrong.push(format!("{name}:\n{}", shown(&circle)));
        }
    }
    assert!(wrong.is_empty(), "circles of files:\n{}", wrong.join("\n"));
}

/// A line for each pair of files: what the first takes from the second.
fn shown(imports: &[Import]) -> String {
    let inside = |file: &Path| {
        let parts: Vec<_> = file.iter().map(|part| part.to_string_lossy()).collect();
        let start = parts.iter().rposition(|part| part == "src").map_or(0, |at| at + 1);
        parts[start..].join("/")
    };
    let mut pairs: BTreeMap<(String, String), Vec<&str>> = BTreeMap::new();
    for import in imports {
        pairs.entry((inside(&import.from), inside(&import.to))).or_default().push(&import.name);
    }
    let lines =
        pairs.iter().map(|((from, to), names)| format!("  {from} <- {to}: {}", names.join(", ")));
    lines.collect::<Vec<_>>().join("\n")
}

/// The imports within each set of files that reach each other.
fn circles(imports: &BTreeSet<Import>) -> Vec<Vec<Import>> {
    let mut next: BTreeMap<&Path, BTreeSet<&Path>> = BTreeMap::new();
    for import in imports {
        next.entry(&import.from).or_default().insert(&import.to);
    }
    let reached = |start: &Path| {
        let mut seen = BTreeSet::new();
        let mut open: Vec<PathBuf> = vec![start.to_owned()];
        while let Some(file) = open.pop() {
            for &to in next.get(file.as_path()).into_iter().flatten() {
                if seen.insert(to.to_owned()) {
                    open.push(to.to_owned());
                }
            }
        }
        seen
    };
    let reach: BTreeMap<&Path, BTreeSet<PathBuf>> =
        next.keys().map(|&file| (file, reached(file))).collect();
    let mut found = Vec::new();
    let mut done: BTreeSet<&Path> = BTreeSet::new();
    for (&file, all) in &reach {
        if !all.contains(file) || done.contains(file) {
            continue;
        }
        let circle: BTreeSet<&Path> = reach
            .iter()
            .filter(|(other, back)| all.contains(**other) && back.contains(file))
            .map(|(other, _)| *other)
            .collect();
        let within = |i: &&Import| circle.contains(&*i.from) && circle.contains(&*i.to);
        found.push(imports.iter().filter(within).cloned().collect());
        done.extend(circle);
    }
    found
}

#[test]
fn a_circle_is_found() {
    let import =
        |from: &str, to: &str| Import { from: from.into(), to: to.into(), name: "X".into() };
    let imports = [import("a", "b"), import("b", "c"), import("c", "a"), import("c", "d")];
    let found = circles(&imports.iter().cloned().collect());
    assert_eq!(found.len(), 1);
    assert_eq!(found[0], imports[..3]);
}

#[test]
fn an_order_is_read() {
    let page = "//! # Rooms\n//! 1. `error`, `fields`: what all, or most, use\n//! 2. `mesh` as `x`\n//! text";
    assert_eq!(stated_order(page), ["error", "fields", "mesh"]);
}
