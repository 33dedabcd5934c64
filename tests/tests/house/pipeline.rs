//! Checks that the pipeline of `models` knows no material, no quantity of interest and no statistics.

use std::path::Path;

use super::imports::Crate;
use super::layers::workspace;

/// Modules of `models` from which the pipeline imports.
const MODULES: [&str; 4] = ["case", "pipeline", "progress", "results_folder"];

/// Items of the case that the pipeline imports: the case as a table of keys.
const OF_CASE: [&str; 2] = ["Case", "CaseFile"];

/// Crates and modules of other crates that the pipeline must not name.
const FOREIGN: [&str; 8] = [
    "surrogate::",
    "ppl::",
    "breccia_calibration::",
    "crate::qoi",
    "crate::prior",
    "crate::fracture",
    "crate::experiment::",
    "fem::{",
];

#[test]
fn the_pipeline_knows_no_material_and_no_statistics() {
    let models = Crate::read(&workspace().join("models"));
    let mut imports = 0;
    // the table of the stages has methods of `Stage`, which count as imports in both directions
    for import in models.imports().into_iter().filter(|import| !import.name.starts_with("impl ")) {
        let module_of = |file: &Path| models.top_module_of(file);
        // the root of the crate has no module
        let (Some(from), Some(to)) = (module_of(&import.from), module_of(&import.to)) else {
            continue;
        };
        if from != "pipeline" {
            continue;
        }
        imports += 1;
        let (file, name) = (import.from.display(), &import.name);
        assert!(MODULES.contains(&to.as_str()), "{file} imports {name} of {to}");
        assert!(
            to != "case" || OF_CASE.contains(&name.as_str()),
            "{file} imports {name} of {to}; move what knows the case to `case_inputs`"
        );
    }
    assert!(imports > 20, "{imports} imports");
    let folder = workspace().join("models/src/pipeline");
    for entry in std::fs::read_dir(folder).expect("the folder is there").flatten() {
        let text = std::fs::read_to_string(entry.path()).expect("a source file");
        for name in FOREIGN {
            assert!(!text.contains(name), "{}: {name}", entry.path().display());
        }
    }
}
