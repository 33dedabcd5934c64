//! Tests of the owner of files, and of the replacement and removal of files.

use super::*;
use crate::results_folder::written::WRITTEN;

const COMMAND: &str = "mesh";

fn folder(dir: &Path) -> ProductFolder {
    ProductFolder::new(dir, &[])
}

fn refused<T: std::fmt::Debug>(result: Result<T, WorkflowError>, name: &str) {
    let error = result.unwrap_err().to_string();
    for part in [name, "`breccia mesh` would replace it", "--out", "--replace"] {
        assert!(error.contains(part), "{part:?} is not in {error:?}");
    }
}

#[test]
fn own_files_are_replaced_and_removed_and_those_of_the_user_are_not() {
    let dir = tempfile::tempdir().unwrap();
    let read = |name: &str| std::fs::read_to_string(dir.path().join(name)).unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    // `late` acts as another process, which has not yet read the entries that `own` adds to the record
    let late = folder(dir.path());
    let own = folder(dir.path());
    own.write("mesh.msh", COMMAND, b"one").unwrap();
    late.write("mesh.msh", COMMAND, b"two").unwrap();
    own.write_with("mesh.msh", COMMAND, |path| {
        std::fs::write(path, "three").map_err(|e| WorkflowError::io(path, e))
    })
    .unwrap();
    assert_eq!(read("mesh.msh"), "three");

    // files of the user: one edited, one never written by the program
    write("mesh.msh", "edited");
    write("notes.txt", "notes");
    assert!(own.is_edited("mesh.msh").unwrap() && !own.is_edited("notes.txt").unwrap());
    for name in ["mesh.msh", "notes.txt"] {
        let before = read(name);
        refused(own.write(name, COMMAND, b"new"), name);
        refused(own.write_with(name, COMMAND, |_| Ok::<_, WorkflowError>(())), name);
        refused(own.begin_growing(name, COMMAND), name);
        refused(own.copy_from(&dir.path().join(WRITTEN), name, COMMAND), name);
        refused(own.claim_all(["mesh.*", "notes.txt"].iter().copied(), COMMAND, |_| true), "");
        own.remove(name).unwrap();
        own.remove_leftovers(&["mesh.msh", "notes.txt"], |_| false).unwrap();
        assert_eq!(read(name), before);
    }
    // a file with any content that the program has written belongs to the program
    write("mesh.msh", "one");
    own.remove_leftovers(&["mesh.*"], |_| false).unwrap();
    assert!(!dir.path().join("mesh.msh").exists());

    // only a file that is allowed by name is replaced
    let allowed = std::path::absolute(dir.path().join("notes.txt")).unwrap();
    ProductFolder::new(dir.path(), &[allowed]).write("notes.txt", COMMAND, b"new").unwrap();
    assert_eq!(read("notes.txt"), "new");
    own.write("notes.txt", COMMAND, b"newer").unwrap();
}

#[test]
fn a_kill_between_the_record_and_the_file_leaves_the_old_file_which_is_still_the_programs() {
    let dir = tempfile::tempdir().unwrap();
    let own = folder(dir.path());
    own.write("map.csv", COMMAND, b"one").unwrap();
    // as if the process was killed after recording the content and before renaming the file
    own.written.add("map.csv", ContentHash::of_bytes(b"two")).unwrap();
    assert_eq!(folder(dir.path()).owner("map.csv").unwrap(), Owner::Program);
    // as if the process was killed after renaming the file
    std::fs::write(dir.path().join("map.csv"), "two").unwrap();
    assert_eq!(folder(dir.path()).owner("map.csv").unwrap(), Owner::Program);
    // partial files have other names
    let partial = dir.path().join(".map.csv.partial");
    std::fs::create_dir(&partial).unwrap();
    std::fs::write(partial.join("map.csv"), "th").unwrap();
    own.write_with("map.csv", COMMAND, |path| {
        std::fs::write(path, "three").map_err(|e| WorkflowError::io(path, e))
    })
    .unwrap();
    assert!(!partial.exists());
    assert_eq!(std::fs::read_to_string(dir.path().join("map.csv")).unwrap(), "three");
}

#[test]
fn a_folder_is_a_product_as_a_file_is() {
    let dir = tempfile::tempdir().unwrap();
    let own = folder(dir.path());
    let store = |text: &'static str| {
        own.write_with("posterior.zarr", COMMAND, move |path| {
            std::fs::create_dir_all(path.join("c")).unwrap();
            std::fs::write(path.join("c/0"), text).map_err(|e| WorkflowError::io(path, e))
        })
    };
    store("one").unwrap();
    store("two").unwrap();
    let inner = dir.path().join("posterior.zarr/c/0");
    assert_eq!(std::fs::read_to_string(&inner).unwrap(), "two");
    std::fs::write(dir.path().join("posterior.zarr/notes.txt"), "of a person").unwrap();
    refused(store("three"), "posterior.zarr");
    assert_eq!(std::fs::read_to_string(&inner).unwrap(), "two");
}

#[test]
fn a_file_is_created_once() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("case.toml");
    create_file(&path, b"one").unwrap();
    let error = create_file(&path, b"two").unwrap_err();
    assert_eq!(error.kind(), std::io::ErrorKind::AlreadyExists);
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "one");
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1);
}
