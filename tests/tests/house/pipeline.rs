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
    let is_of = |file: &Path, module: &str| models.top_module_of(file).as_deref() == Some(module);
    let mut imports = 0;
    for import in models.imports().into_iter().filter(|import| is_of(&import.from, "pipeline")) {
        imports += 1;
        let (from, to) = (import.from.display(), import.to.display());
        assert!(
            MODULES.iter().any(|module| is_of(&import.to, module)),
            "{from} imports {} of {to}",
            import.name
        );
        let is_case = is_of(&import.to, "case");
        assert!(
            !is_case || OF_CASE.contains(&import.name.as_str()),
            "{from} imports {} of {to}; move what knows the case to `case_inputs`",
            import.name
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
