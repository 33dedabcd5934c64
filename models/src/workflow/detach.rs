//! Detaches a case from its study: copies its results folder and the inputs outside of this folder to a separate
//! folder, in which no stage has to be run again.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use toml::Table;

use super::Workflow;
use super::copies::{Copies, ORIGIN};
use super::in_place::named_by_table;
use crate::case::{Case, CaseFile, PROGRAM, visit_paths};
use crate::experiment::SpecimenTable;
use crate::experiments::validation_folders::folder_of;
use crate::pipeline::freshness::{STAGES_FILE, finished_in};
use crate::pipeline::neighbours::Neighbours;
use crate::progress::say;
use crate::results_folder::content_hash::ContentHash;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::files::{INPUTS, SPECIMENS};
use crate::results_folder::folder_copies::{copy_file_with_time, copy_tree};
use crate::results_folder::locks;
use crate::results_folder::locks::holder;
use crate::results_folder::product_folder::{FolderAccess, Owner, ProductFolder};
use crate::results_folder::sources::{Move, Origin};
use crate::stages::table::STAGES;

/// Command that messages about written files name.
const COMMAND: &str = "study";

/// File with the identity of an ensemble's runs, in the folder of the runs.
const ENSEMBLE: &str = "ensemble.json";

/// Keys of images, which may consist of several files.
const IMAGES: [&str; 4] = [
    "specimen.image.stack",
    "specimen.image.labels",
    "specimen.image.region.mask",
    "specimen.image.further_stacks",
];

/// Copies the results folder `case` of a case of a study to the folder `dest`, which must not exist. Inputs outside of
/// the folder are copied to `dest/inputs`, and the paths in `case.toml` and in the table of the specimens are changed.
/// The program of a `[simulator]` is not copied. A stage that is finished in `case` is finished in `dest`.
///
/// # Errors
/// If `case` is not the folder of a case of a study, if a stage is running in it, if `dest` exists, or if a file cannot
/// be copied. `dest` is then removed.
pub fn detach(case: &Path, dest: &Path) -> Result<(), WorkflowError> {
    let absolute = |path: &Path| std::path::absolute(path).map_err(|e| WorkflowError::io(path, e));
    let (from, to) = (absolute(case)?, absolute(dest)?);
    check(&from, &to)?;
    let detached = Detached::new(&from, &to).copy();
    if detached.is_err() {
        // an error of the removal is ignored, because the error of the copying is more useful
        let _ = std::fs::remove_dir_all(&to);
    }
    detached
}

fn check(from: &Path, to: &Path) -> Result<(), WorkflowError> {
    let refuse = |text: String| Err(WorkflowError::Unusable(text));
    if !Neighbours::is_case_of_study(from) {
        return refuse(format!(
            "{} is not the folder of a case of a study; name a folder that `breccia status` lists for the study",
            from.display()
        ));
    }
    if to.exists() {
        return refuse(format!("{} exists; name a folder that does not exist", to.display()));
    }
    if to.starts_with(from) {
        return refuse(format!("{} is inside the folder of the case", to.display()));
    }
    if let Some((stage, process)) =
        STAGES.iter().find_map(|s| Some((s.name, holder(from, s.name)?)))
    {
        return refuse(format!("{process} is running the stage {stage} of {}", from.display()));
    }
    Ok(())
}

/// Reads the case of a results folder as a stage would read it.
fn case_in(dir: &Path) -> Result<CaseFile, WorkflowError> {
    let mut file = CaseFile::read(&dir.join("case.toml"))?;
    file.case = Copies::of(&file, dir)?.case;
    Ok(file)
}

/// A copied input.
struct CopiedInput {
    original: PathBuf,
    copy: PathBuf,
    /// Whether the table of the specimens names the input.
    is_of_specimen: bool,
}

/// The copy of a case.
struct Detached<'a> {
    from: &'a Path,
    to: &'a Path,
    inputs: Vec<CopiedInput>,
    /// Number of folders created so far in the folder of the copied inputs.
    count: usize,
}

impl<'a> Detached<'a> {
    fn new(from: &'a Path, to: &'a Path) -> Self {
        Self { from, to, inputs: Vec::new(), count: 0 }
    }

    fn copy(mut self) -> Result<(), WorkflowError> {
        let old = case_in(self.from)?;
        if old.case.calibration.joint.is_some() {
            let text = "the folder is a test of a case with several tests, and its posterior is the joint posterior";
            return Err(WorkflowError::Unusable(text.to_owned()));
        }
        copy_tree(self.from, self.to)?;
        for name in [locks::FOLDER, ORIGIN] {
            let path = self.to.join(name);
            let removed = match path.is_dir() {
                true => std::fs::remove_dir_all(&path),
                false if path.exists() => std::fs::remove_file(&path),
                false => Ok(()),
            };
            removed.map_err(|e| WorkflowError::io(&path, e))?;
        }
        self.copy_inputs(&old.case)?;
        self.copy_images_of_specimens()?;

        // opening the folder writes the cases and the tables of the validations
        let (interrupt, access) =
            (AtomicBool::new(false), FolderAccess { reuse: true, replace: Vec::new() });
        let new = CaseFile::read(&self.to.join("case.toml"))?;
        let workflow = Workflow::open_with(&new, self.to, 1, &interrupt, &access)?;
        let name_of = |name: &str| self.new_name(name);
        let of_case = moves(&old, self.from, &workflow.file, self.to, &name_of)?;
        move_records(&of_case[0], self.to)?;
        let files = files_read_in(self.from);
        move_runs(self.to, &|identity| moved_identity(identity, &of_case, &files))?;
        for (name, validation) in &workflow.validations {
            let folder = folder_of(name);
            let (from, to) = (self.from.join(&folder), self.to.join(&folder));
            let old = case_in(&from)?;
            let name_of = |name: &str| self.new_name_in_validation(name);
            let of_validation = moves(&old, &from, &validation.file, &to, &name_of)?;
            move_records(&of_validation[0], &to)?;
            let files = files_read_in(&from);
            move_runs(&to, &|identity| moved_identity(identity, &of_validation, &files))?;
        }
        Ok(())
    }

    /// Copies the inputs that the case names, and writes the case with the new paths.
    fn copy_inputs(&mut self, case: &Case) -> Result<(), WorkflowError> {
        let refused = |e: String| WorkflowError::Unusable(format!("case.toml: {e}"));
        let mut table = Table::try_from(case).map_err(|e| refused(e.to_string()))?;
        let mut copied = Ok(());
        visit_paths(&mut table, &mut |key, path| {
            if copied.is_ok() {
                match self.copied(key, path) {
                    Ok(new) => *path = new,
                    Err(error) => copied = Err(error),
                }
            }
        });
        copied?;
        let case: Case = table.try_into().map_err(|e: toml::de::Error| refused(e.to_string()))?;
        rewrite(self.to, "case.toml", &case.to_toml())
    }

    /// Copies an input of the case. Returns its path relative to the folder of the copied case.
    fn copied(&mut self, key: &str, path: &str) -> Result<String, WorkflowError> {
        let original = self.from.join(path);
        let shown = |path: &Path| path.to_string_lossy().into_owned();
        if let Ok(inner) = original.strip_prefix(self.from) {
            return Ok(shown(inner));
        }
        // a key in the keys `set` of a test or a candidate begins with the name of this test or candidate
        let is = |name: &str| key.ends_with(name);
        if is(PROGRAM) {
            say("note", &format!("the program {path} is not copied"));
            return Ok(path.to_owned());
        }
        if !original.exists() {
            return Ok(path.to_owned());
        }
        let files: Vec<PathBuf> = if is("experiments.table") {
            named_by_table(&original).into_iter().map(|named| named.path).collect()
        } else if IMAGES.iter().any(|image| is(image)) {
            fem::image_files(&original)
        } else {
            Vec::new()
        };
        let copy = self.copy_input(&original, &files, false)?;
        Ok(shown(copy.strip_prefix(self.to).unwrap_or(&copy)))
    }

    /// Copies an input and the files that belong to it, which lie in the same folder or below, to a new folder. Returns
    /// the path of the copy.
    fn copy_input(
        &mut self,
        original: &Path,
        files: &[PathBuf],
        is_of_specimen: bool,
    ) -> Result<PathBuf, WorkflowError> {
        let is_copy = |input: &&CopiedInput| {
            input.original == original && input.is_of_specimen == is_of_specimen
        };
        if let Some(input) = self.inputs.iter().find(is_copy) {
            return Ok(input.copy.clone());
        }
        self.count += 1;
        let folder = self.to.join(INPUTS).join(self.count.to_string());
        let parent = original.parent().unwrap_or(original);
        let mut copy = PathBuf::new();
        let all = files.iter().map(PathBuf::as_path).filter(|file| *file != original);
        for file in all.chain([original]).filter(|file| file.exists()) {
            let Ok(inner) = file.strip_prefix(parent) else {
                return Err(WorkflowError::Unusable(format!(
                    "{} belongs to {} and lies in another folder; move it to {}",
                    file.display(),
                    original.display(),
                    parent.display()
                )));
            };
            copy = folder.join(inner);
            if let Some(parent) = copy.parent() {
                std::fs::create_dir_all(parent).map_err(|e| WorkflowError::io(parent, e))?;
            }
            match file.is_dir() {
                true => copy_tree(file, &copy)?,
                false => copy_file_with_time(file, &copy)?,
            }
            let (original, copy) = (file.to_owned(), copy.clone());
            self.inputs.push(CopiedInput { original, copy, is_of_specimen });
        }
        Ok(copy)
    }

    /// Copies the images that the table of measured specimens names, and writes the table with the new paths.
    fn copy_images_of_specimens(&mut self) -> Result<(), WorkflowError> {
        let path = self.to.join(SPECIMENS);
        if !path.is_file() {
            return Ok(());
        }
        let specimens = SpecimenTable::read(&path)?.specimens;
        let mut images: Vec<PathBuf> = specimens.into_iter().filter_map(|s| s.image).collect();
        images.retain(|image| image.is_absolute() && image.exists());
        // a path may be the beginning of another path
        images.sort_by_key(|image| std::cmp::Reverse(image.as_os_str().len()));
        images.dedup();
        let mut text = fem::read_regular_text(&path).map_err(|e| WorkflowError::io(&path, e))?;
        let before = text.clone();
        for image in images {
            let copy = match image.strip_prefix(self.from) {
                Ok(inner) => self.to.join(inner),
                Err(_) => self.copy_input(&image, &fem::image_files(&image), true)?,
            };
            let inner = copy.strip_prefix(self.to).unwrap_or(&copy);
            let new = Path::new("..").join(inner);
            text = text.replace(&*image.to_string_lossy(), &new.to_string_lossy());
        }
        if text == before { Ok(()) } else { rewrite(self.to, SPECIMENS, &text) }
    }

    /// Returns the name of a file in the records of the copy. `name` is its name in the records of the original case.
    fn new_name(&self, name: &str) -> String {
        let Some((copy, is_of_specimen)) = self.copy_of(name) else { return name.to_owned() };
        let inner = copy.strip_prefix(self.to).unwrap_or(&copy).to_string_lossy().into_owned();
        if is_of_specimen { format!("experiments/../{inner}") } else { inner }
    }

    /// Returns the name of a copied file in the records of the folder of a validation.
    fn new_name_in_validation(&self, name: &str) -> String {
        let copy = self.copy_of(name);
        copy.map_or_else(|| name.to_owned(), |(copy, _)| copy.to_string_lossy().into_owned())
    }

    /// Path of the copy of an input with an absolute path, and whether the table of the specimens names the input.
    fn copy_of(&self, name: &str) -> Option<(PathBuf, bool)> {
        self.inputs.iter().find_map(|input| {
            let inner = Path::new(name).strip_prefix(&input.original).ok()?;
            let copy = match inner.as_os_str().is_empty() {
                true => input.copy.clone(),
                false => input.copy.join(inner),
            };
            Some((copy, input.is_of_specimen))
        })
    }
}

/// Returns the move of the case, followed by the moves of its candidates that are another test: the runs of such a
/// candidate have a separate case.
fn moves<'m>(
    old: &CaseFile,
    from: &'m Path,
    new: &CaseFile,
    to: &'m Path,
    new_name: &'m dyn Fn(&str) -> String,
) -> Result<Vec<Move<'m>>, WorkflowError> {
    let moved = |old: &Case, new: &Case| Move {
        from: Origin::of(old, from),
        to: Origin::of(new, to),
        new_name,
    };
    let mut moves = vec![moved(&old.case, &new.case)];
    let candidates = old.case.further_tests.candidate.iter().zip(&new.case.further_tests.candidate);
    for (before, after) in candidates.filter(|(before, _)| before.is_another_test()) {
        moves.push(moved(&old.of_candidate(before)?.case, &new.of_candidate(after)?.case));
    }
    Ok(moves)
}

/// Replaces the content of a file of the copied folder. A file of the program remains a file of the program.
fn rewrite(dir: &Path, name: &str, text: &str) -> Result<(), WorkflowError> {
    let folder = ProductFolder::new(dir, &[]);
    if folder.owner(name)? == Owner::User {
        let path = dir.join(name);
        return std::fs::write(&path, text).map_err(|e| WorkflowError::io(&path, e));
    }
    folder.write(name, COMMAND, text.as_bytes()).map(drop)
}

/// Changes the records of the finished stages.
fn move_records(moved: &Move<'_>, dir: &Path) -> Result<(), WorkflowError> {
    let records = finished_in(dir);
    if records.is_empty() {
        return Ok(());
    }
    let records: BTreeMap<_, _> =
        records.into_iter().map(|(stage, record)| (stage, record.moved(moved))).collect();
    let text = toml::to_string(&records).expect("names and fingerprints are plain text");
    rewrite(dir, STAGES_FILE, &text)
}

/// Names of all files that stages in the folder have read.
fn files_read_in(dir: &Path) -> BTreeSet<String> {
    let records = finished_in(dir);
    records.values().flat_map(|record| record.files_read()).map(str::to_owned).collect()
}

/// Changes the identity of the runs in a folder and its subfolders, and the names of the folders of the runs, which are
/// hashes of the identity.
fn move_runs(dir: &Path, moved: &dyn Fn(&str) -> String) -> Result<(), WorkflowError> {
    let path = dir.join(ENSEMBLE);
    if !path.is_file() {
        let entries = std::fs::read_dir(dir).map_err(|e| WorkflowError::io(dir, e))?;
        for entry in entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()) {
            move_runs(&entry, moved)?;
        }
        return Ok(());
    }
    let bytes = fem::read_regular(&path).map_err(|e| WorkflowError::io(&path, e))?;
    let Ok(mut json) = serde_json::from_slice::<serde_json::Value>(&bytes) else { return Ok(()) };
    let Some((program, identity)) = json["fingerprint"].as_str().and_then(|s| s.split_once('\n'))
    else {
        return Ok(());
    };
    let new = moved(identity);
    let is_named_by_identity = dir.file_name().is_some_and(|name| *name == *hash_of(identity));
    if new == identity || !is_named_by_identity {
        return Ok(());
    }
    let target = dir.with_file_name(hash_of(&new));
    json["fingerprint"] = format!("{program}\n{new}").into();
    std::fs::write(&path, json.to_string())
        .and_then(|()| std::fs::rename(dir, &target))
        .map_err(|e| WorkflowError::io(&target, e))
}

fn hash_of(identity: &str) -> String {
    ContentHash::of(identity).to_string()
}

/// Changes the lines `name = fingerprint` of an identity of runs. Consecutive lines of files are sorted by name, like the
/// lines of every identity. A line is not changed if its fingerprint differs from the fingerprint of the case.
fn moved_identity(identity: &str, moves: &[Move<'_>], files: &BTreeSet<String>) -> String {
    let mut lines: Vec<String> = Vec::new();
    let mut of_files: BTreeMap<String, String> = BTreeMap::new();
    for line in identity.lines() {
        let entry = line.rsplit_once(" = ");
        if let Some((name, sum)) = entry.filter(|(name, _)| files.contains(*name)) {
            let (name, sum) = moves[0].file(name, sum);
            of_files.insert(name, sum);
            continue;
        }
        lines.extend(
            std::mem::take(&mut of_files).into_iter().map(|(n, sum)| format!("{n} = {sum}")),
        );
        let part = entry.and_then(|(key, sum)| {
            Some(format!("{key} = {}", moves.iter().find_map(|moved| moved.part(key, sum))?))
        });
        lines.push(part.unwrap_or_else(|| line.to_owned()));
    }
    lines.extend(of_files.into_iter().map(|(name, sum)| format!("{name} = {sum}")));
    lines.iter().map(|line| format!("{line}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::CaseFile;

    /// If runs have read an image outside of the folder of the case, the moved identity of the runs contains the name
    /// of the copied image, and the fingerprints of the keys of the copied case.
    #[test]
    fn the_identity_of_runs_is_that_of_the_copied_case() {
        let dir = tempfile::tempdir().unwrap();
        let [from, to] = ["from", "to"].map(|name| dir.path().join(name));
        std::fs::create_dir_all(&from).unwrap();
        std::fs::create_dir_all(to.join("inputs/1")).unwrap();
        let image = dir.path().join("scan.tif");
        std::fs::write(&image, "voxels").unwrap();
        std::fs::write(to.join("inputs/1/scan.tif"), "voxels").unwrap();
        std::fs::write(from.join("a.csv"), "a").unwrap();
        std::fs::write(to.join("a.csv"), "a").unwrap();
        let old = CaseFile::default_case().case;
        let mut new = old.clone();
        new.design.seed += 1;
        let name = image.to_string_lossy().into_owned();
        let new_name = |file: &str| match file == name {
            true => "inputs/1/scan.tif".to_owned(),
            false => file.to_owned(),
        };
        let (old, new) = (Origin::of(&old, &from), Origin::of(&new, &to));
        let identity = |origin: &Origin<'_>, files: [&str; 2]| {
            let mut sources = crate::results_folder::sources::Sources::default();
            ["design", "material"].iter().for_each(|key| sources.read_part(origin, key));
            files.iter().for_each(|file| sources.read_file(origin, file));
            let lines = sources.lines(&["design", "material"], &files);
            format!("{lines}level = 0.7 mm\n")
        };
        let (before, after) =
            (identity(&old, [&name, "a.csv"]), identity(&new, ["inputs/1/scan.tif", "a.csv"]));
        assert_ne!(before, after);
        let files = [name.clone(), "a.csv".to_owned()].into();
        let moves = [Move { from: old, to: new, new_name: &new_name }];
        assert_eq!(moved_identity(&before, &moves, &files), after);
        // the identity of another case is not changed
        let other = "design = 0123456789abcdef\n";
        assert_eq!(moved_identity(other, &moves, &files), other);
    }
}
