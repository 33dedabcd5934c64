//! Checks the order of layers that each crate's `lib.rs` states: a module imports only modules of lower layers, and no
//! files import each other in a cycle.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use super::exceptions::{FOREIGN_IMPLS, UNORDERED};
use super::imports::{Crate, Import};

/// Number of files above which a module must state the order of its children.
const MOST_FILES: usize = 15;

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

/// Folder of the repository that is checked. The environment variable may name another checkout.
pub(super) fn workspace() -> PathBuf {
    match std::env::var_os("BRECCIA_WORKSPACE") {
        Some(folder) => folder.into(),
        None => Path::new(env!("CARGO_MANIFEST_DIR")).join(".."),
    }
}

/// Returns the modules in the order that a crate's page states, lowest layer first. The page has lines such as ``//! 3.
/// `mesh` …``. If a line lists several modules, these are ordered, too.
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
fn every_crate_states_the_order_of_its_modules() {
    for name in CRATES {
        let folder = workspace().join(name);
        let package = Crate::read(&folder);
        let text = std::fs::read_to_string(folder.join("src/lib.rs")).expect("lib.rs is there");
        let stated: BTreeSet<String> = stated_order(&text).into_iter().collect();
        let modules: BTreeSet<String> =
            package.top_modules().into_iter().map(String::from).collect();
        let unlisted: Vec<_> = modules.difference(&stated).collect();
        let gone: Vec<_> = stated.difference(&modules).collect();
        assert!(
            unlisted.is_empty() && gone.is_empty(),
            "{name}/src/lib.rs: the order of modules lacks {unlisted:?} and names {gone:?}, which is not there"
        );
    }
}

#[test]
fn imports_are_from_lower_layers() {
    let mut wrong = Vec::new();
    for name in CRATES {
        let folder = workspace().join(name);
        let package = Crate::read(&folder);
        let text = std::fs::read_to_string(folder.join("src/lib.rs")).expect("lib.rs is there");
        let order = stated_order(&text);
        let layer = |module: &str| order.iter().position(|listed| listed == module);
        for import in without_exceptions(name, package.imports()) {
            let (Some(from), Some(to)) =
                (package.top_module_of(&import.from), package.top_module_of(&import.to))
            else {
                continue;
            };
            if let (Some(low), Some(high)) = (layer(&from), layer(&to))
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
fn no_files_import_each_other_in_a_cycle() {
    let mut wrong = Vec::new();
    for name in CRATES {
        let package = Crate::read(&workspace().join(name));
        for cycle in cycles(&without_exceptions(name, package.imports())) {
            wrong.push(format!("{name}:\n{}", shown(&cycle)));
        }
    }
    assert!(wrong.is_empty(), "cycles of files:\n{}", wrong.join("\n"));
}

/// `file: impl Type`, the form in which exceptions are listed.
fn listed(import: &Import) -> String {
    format!("{}: {}", inside(&import.from), import.name)
}

/// Imports of a crate, without the `impl`s in the list of exceptions.
fn without_exceptions(name: &str, imports: BTreeSet<Import>) -> BTreeSet<Import> {
    let excused: Vec<&str> =
        FOREIGN_IMPLS.iter().filter(|(of, _)| *of == name).map(|(_, what)| *what).collect();
    let is_excused = |import: &Import| {
        let back = Import { from: import.to.clone(), to: import.from.clone(), ..import.clone() };
        excused.contains(&listed(import).as_str()) || excused.contains(&listed(&back).as_str())
    };
    imports.into_iter().filter(|import| !is_excused(import)).collect()
}

/// An exception that is no longer needed must be removed from the list.
#[test]
fn every_exception_is_needed() {
    let mut gone = Vec::new();
    for name in CRATES {
        let package = Crate::read(&workspace().join(name));
        let imports = package.imports();
        let present: BTreeSet<String> = package.foreign_impls().iter().map(listed).collect();
        let excused = FOREIGN_IMPLS.iter().filter(|(of, _)| *of == name);
        gone.extend(excused.filter(|(_, what)| !present.contains(*what)).map(|e| format!("{e:?}")));
        let large: Vec<String> =
            package.large_modules(MOST_FILES).iter().map(|path| path.join("::")).collect();
        let excused = UNORDERED.iter().filter(|(of, _)| *of == name);
        let needed = |module: &str| {
            large.iter().any(|path| path == module)
                && faults_of_order(&package, &imports, module).is_some()
        };
        gone.extend(excused.filter(|(_, module)| !needed(module)).map(|e| format!("{e:?}")));
    }
    assert!(gone.is_empty(), "remove these exceptions from exceptions.rs:\n{}", gone.join("\n"));
}

/// Describes faults in the order of a module's children: children that the module does not list, and imports of a child
/// in a higher layer.
fn faults_of_order(package: &Crate, imports: &BTreeSet<Import>, module: &str) -> Option<String> {
    let path: Vec<String> = module.split("::").map(String::from).collect();
    let text = std::fs::read_to_string(package.file(&path)).expect("the file was read before");
    let order = stated_order(&text);
    let stated: BTreeSet<String> = order.iter().cloned().collect();
    let children = package.children(&path);
    if stated != children {
        let [lacks, extra] = [(&children, &stated), (&stated, &children)]
            .map(|(a, b)| a.difference(b).cloned().collect::<Vec<_>>());
        return Some(format!("the order of its modules lacks {lacks:?} and names {extra:?}"));
    }
    let layer = |file: &Path| {
        let child = package.child_of(&path, file)?;
        order.iter().position(|name| name == child)
    };
    let upward: Vec<Import> = imports
        .iter()
        .filter(|import| matches!((layer(&import.from), layer(&import.to)), (Some(a), Some(b)) if a < b))
        .cloned()
        .collect();
    (!upward.is_empty()).then(|| format!("imports go up:\n{}", shown(&upward)))
}

#[test]
fn large_modules_state_the_order_of_their_children() {
    let mut wrong = Vec::new();
    for name in CRATES {
        let package = Crate::read(&workspace().join(name));
        let imports = package.imports();
        for path in package.large_modules(MOST_FILES) {
            let module = path.join("::");
            if UNORDERED.contains(&(name, module.as_str())) {
                continue;
            }
            if let Some(fault) = faults_of_order(&package, &imports, &module) {
                wrong.push(format!("{name}, module {module}: {fault}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{} modules:\n{}", wrong.len(), wrong.join("\n"));
}

fn inside(file: &Path) -> String {
    let parts: Vec<_> = file.iter().map(|part| part.to_string_lossy()).collect();
    let start = parts.iter().rposition(|part| part == "src").map_or(0, |at| at + 1);
    parts[start..].join("/")
}

/// Formats one line for each pair of files: the names that the first file imports from the second.
fn shown(imports: &[Import]) -> String {
    let mut pairs: BTreeMap<(String, String), Vec<&str>> = BTreeMap::new();
    for import in imports {
        pairs.entry((inside(&import.from), inside(&import.to))).or_default().push(&import.name);
    }
    let lines =
        pairs.iter().map(|((from, to), names)| format!("  {from} <- {to}: {}", names.join(", ")));
    lines.collect::<Vec<_>>().join("\n")
}

/// Imports within each set of files that import each other directly or indirectly.
fn cycles(imports: &BTreeSet<Import>) -> Vec<Vec<Import>> {
    let mut next: BTreeMap<&Path, BTreeSet<&Path>> = BTreeMap::new();
    for import in imports {
        next.entry(&import.from).or_default().insert(&import.to);
    }
    let reached = |start: &Path| {
        let mut seen = BTreeSet::new();
        let mut unvisited: Vec<PathBuf> = vec![start.to_owned()];
        while let Some(file) = unvisited.pop() {
            for &to in next.get(file.as_path()).into_iter().flatten() {
                if seen.insert(to.to_owned()) {
                    unvisited.push(to.to_owned());
                }
            }
        }
        seen
    };
    let reach: BTreeMap<&Path, BTreeSet<PathBuf>> =
        next.keys().map(|&file| (file, reached(file))).collect();
    let mut all_cycles = Vec::new();
    let mut done: BTreeSet<&Path> = BTreeSet::new();
    for (&file, all) in &reach {
        if !all.contains(file) || done.contains(file) {
            continue;
        }
        let cycle: BTreeSet<&Path> = reach
            .iter()
            .filter(|(other, back)| all.contains(**other) && back.contains(file))
            .map(|(other, _)| *other)
            .collect();
        let within = |i: &&Import| cycle.contains(&*i.from) && cycle.contains(&*i.to);
        all_cycles.push(imports.iter().filter(within).cloned().collect());
        done.extend(cycle);
    }
    all_cycles
}

#[test]
fn a_cycle_is_found() {
    let import =
        |from: &str, to: &str| Import { from: from.into(), to: to.into(), name: "X".into() };
    let imports = [import("a", "b"), import("b", "c"), import("c", "a"), import("c", "d")];
    let detected = cycles(&imports.iter().cloned().collect());
    assert_eq!(detected.len(), 1);
    assert_eq!(detected[0], imports[..3]);
}

#[test]
fn an_order_is_read() {
    let page = "//! # Modules\n//! 1. `error`, `fields`: what all, or most, use\n//! 2. `mesh` as `x`\n//! text";
    assert_eq!(stated_order(page), ["error", "fields", "mesh"]);
}
