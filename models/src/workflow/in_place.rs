//! Check that no input file of a case has the path of a file that the program writes.

use std::path::{Path, PathBuf};

use crate::case::{CaseFile, named_paths};
use crate::experiment::curve_file;
use crate::pipeline::freshness::STAGES_FILE;
use crate::results_folder::error::{InputInPlace, WorkflowError};
use crate::results_folder::files::{IMPORTED, SPECIMENS, VALUES, same_file};
use crate::results_folder::pattern::{folder, matches};
use crate::results_folder::written::WRITTEN;
use crate::specimen_files::recorded_file;
use crate::stages::table::STAGES;
use crate::table_format::DetectedTable;

/// Files that are copied into a results folder when the folder is opened. If an input of the case already
/// has the path of such a copy, the input is used without copying.
const OPENING: [&str; 9] = [
    "case.toml",
    "origin.toml",
    "specimen.msh",
    "candidates/#.msh",
    "simulator/*",
    IMPORTED,
    VALUES,
    SPECIMENS,
    "experiments/curves/*.csv",
];

/// Files in which the program records its state, and the table of a study.
const RECORDS: [&str; 4] = [STAGES_FILE, WRITTEN, "study.toml", "study.csv"];

/// Files that `breccia simulate` writes.
pub(super) const SIMULATION: [&str; 8] = [
    "curve.csv",
    "effort.csv",
    "fields.pvd",
    "fields/step-#.vtu",
    "fields/last.vtu",
    "damage/step-#.png",
    "failure.txt",
    "simulate.state",
];

/// Files that `breccia surfaces` writes.
pub(super) const SURFACES: [&str; 2] = ["surfaces/grain-#.stl", "surfaces.csv"];

/// A file or folder that is an input of a case.
pub(super) struct Named {
    /// Key of the case, or description of the entry in the table of specimens.
    key: String,
    pub(super) path: PathBuf,
}

/// Checks a results folder: fails if an input of the case has the path of a product.
///
/// # Errors
/// [`WorkflowError::InputInPlace`].
pub(super) fn check_inputs(source: &CaseFile, dir: &Path) -> Result<(), WorkflowError> {
    let root = resolved(dir);
    for Named { key, path: input } in named_by(source) {
        let absolute = resolved(&input);
        let refuse = |product: &str| {
            Err(WorkflowError::InputInPlace(Box::new(InputInPlace {
                case: source.path.clone(),
                key: key.clone(),
                input: input.clone(),
                product: product.to_owned(),
                dir: dir.to_owned(),
            })))
        };
        if absolute.is_dir() && root.starts_with(&absolute) {
            return refuse("the results, in the folder of the input");
        }
        let Ok(name) = absolute.strip_prefix(&root) else { continue };
        let name = name.to_string_lossy().replace('\\', "/");
        // true if the product's folder is the input folder `name` or is within it
        let lies_within =
            |pattern: &str| format!("{}/", folder(pattern)).starts_with(&format!("{name}/"));
        let is_meant =
            |pattern: &&str| matches(pattern, &name) || (absolute.is_dir() && lies_within(pattern));
        // an input at the path of its own copy is used without copying
        if !absolute.is_dir() && OPENING.iter().any(|pattern| matches(pattern, &name)) {
            continue;
        }
        let is_measured = !is_virtual(source);
        let products = STAGES.iter().flat_map(|stage| stage.products).copied();
        let products = products.filter(|p| !(is_measured && p.starts_with("experiments/")));
        let all = products.chain(SIMULATION).chain(SURFACES).chain(RECORDS);
        if let Some(product) = all.into_iter().find(is_meant) {
            return refuse(product);
        }
    }
    Ok(())
}

fn is_virtual(source: &CaseFile) -> bool {
    source.case.experiments.as_ref().is_some_and(|e| e.virtual_specimens.is_some())
}

/// Lists all existing files that a case names, and the files that its tables of specimens and image headers name.
fn named_by(source: &CaseFile) -> Vec<Named> {
    let mut named = vec![Named { key: "the case".to_owned(), path: source.path.clone() }];
    for (key, path) in named_paths(source) {
        if key.contains("specimen.image.") {
            // the header of an image refers to a separate file of values
            let files = fem::image_files(&path).into_iter();
            named.extend(files.map(|path| Named { key: key.clone(), path }));
        }
        if key.ends_with("experiments.table") {
            named.extend(named_by_table(&path));
        }
        named.push(Named { key, path });
    }
    named.retain(|named| named.path.exists());
    named
}

/// Lists the curves and images that a table of specimens names. Empty if the table cannot be read; this error is
/// reported later.
pub(super) fn named_by_table(file: &Path) -> Vec<Named> {
    let Ok(DetectedTable { table, .. }) = DetectedTable::read(file, &["id"], &[]) else {
        return Vec::new();
    };
    let mut named = Vec::new();
    for row in table.rows() {
        let id = row.text("id");
        let curve = recorded_file(file, id).unwrap_or_else(|_| curve_file(file, id));
        named.push(Named { key: format!("the curve of specimen {id}"), path: curve });
        let image = row.text("image");
        if !image.is_empty() {
            let files = fem::image_files(&file.with_file_name(image)).into_iter();
            let key = format!("the image of specimen {id}");
            named.extend(files.map(|path| Named { key: key.clone(), path }));
        }
    }
    named
}

/// Returns an absolute path with resolved links; the last components of the path need not exist.
fn resolved(path: &Path) -> PathBuf {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    for front in path.ancestors() {
        if let (Ok(canonical), Ok(rest)) = (front.canonicalize(), path.strip_prefix(front)) {
            return if rest.as_os_str().is_empty() { canonical } else { canonical.join(rest) };
        }
    }
    path
}

/// Whether the case file is the `case.toml` in the results folder.
pub(super) fn is_case_of_folder(source: &CaseFile, dir: &Path) -> bool {
    same_file(&source.path, &dir.join("case.toml"))
}

#[cfg(test)]
mod tests {
    use super::*;

    const CASE: &str = "[specimen]\nspacing_mm = 0.7\n[specimen.image]\nstack = \"STACK\"\nvoxel_mm = 0.1\n\
        [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[material.grain]\nyoung_mpa = 22000\npoisson = 0.25\n\
        [test]\ndisplacement_mm = 0.2\n";

    fn check(stack: &str, out: &str) -> Result<(), WorkflowError> {
        let dir = tempfile::tempdir().unwrap();
        for folder in ["images", "slices/inner"] {
            std::fs::create_dir_all(dir.path().join(folder)).unwrap();
        }
        for file in ["scan.tif", "own.tif", "images/2-labels.tif", "images/3.tif", "curve.csv"] {
            std::fs::write(dir.path().join(file), "").unwrap();
        }
        let text = CASE.replace("STACK", stack);
        let case = CaseFile::parse(&text, &dir.path().join("my.toml")).unwrap();
        check_inputs(&case, &dir.path().join(out))
    }

    #[test]
    fn an_input_at_the_path_of_a_product_is_refused_and_no_other() {
        for (stack, out) in [
            ("scan.tif", "."),
            ("./images/../scan.tif", "slices/.."),
            ("images/2-labels.tif", "."),
            ("images", "."),
            (".", "."),
            ("slices", "slices/inner/out"),
            ("curve.csv", "."),
        ] {
            let error = check(stack, out).expect_err(stack).to_string();
            for part in ["my.toml", "specimen.image.stack", "--out"] {
                assert!(error.contains(part), "{part:?} is not in {error:?}");
            }
        }
        for (stack, out) in [
            ("own.tif", "."),
            ("images/3.tif", "."),
            ("slices", "."),
            ("scan.tif", "out"),
            ("images", "out"),
        ] {
            check(stack, out).unwrap();
        }
    }

    /// Files in the keys of a test are inputs, in the folder of the case and in the folder of the test.
    #[test]
    fn an_input_of_a_test_at_the_path_of_a_product_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let tests = dir.path().join("tests/slow");
        std::fs::create_dir_all(&tests).unwrap();
        for file in ["mesh.msh", "tests/slow/mesh.msh", "tests/slow/own.msh"] {
            std::fs::write(dir.path().join(file), "").unwrap();
        }
        let check = |mesh: &str, out: &Path| {
            let text = CASE.replace("STACK", "gone.tif")
                + &format!("[[tests]]\nname = \"slow\"\nset.specimen.mesh = \"{mesh}\"\n");
            let (case, _) = CaseFile::parse_all(&text, &dir.path().join("my.toml"));
            check_inputs(&case.unwrap(), out)
        };
        for (mesh, out) in [("mesh.msh", dir.path()), ("tests/slow/mesh.msh", tests.as_path())] {
            let error = check(mesh, out).unwrap_err().to_string();
            assert!(error.contains("tests (slow).set.specimen.mesh"), "{error}");
        }
        check("tests/slow/own.msh", &tests).unwrap();
        check("mesh.msh", &tests).unwrap();
    }
}
