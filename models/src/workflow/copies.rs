//! The results folder as an independent case: copies of the input files, the origin of the case, and error messages
//! that name the user's files instead of the copies.

use std::path::{Path, PathBuf};

use fem::EnsembleError;
use serde::{Deserialize, Serialize};

use super::in_place::is_case_of_folder;
use crate::case::{
    Case, CaseFile, make_absolute, validations_with_absolute_paths, with_absolute_paths,
};
use crate::error::InputError;
use crate::pipeline::freshness::STAGES_FILE;
use crate::progress::say;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::files::{IMPORTED, INPUTS, SPECIMENS, VALUES, same_file};
use crate::results_folder::product_folder::{Owner, ProductFolder};
use crate::specimen_files::{SpecimenFiles, recorded_file};

/// Name of the file that records to which case a results folder belongs.
pub(super) const ORIGIN: &str = "origin.toml";

/// Returns an error if the case is to be read from the results folder `dir`, which has results but no `case.toml`.
pub(crate) fn missing_case(dir: &Path) -> Option<InputError> {
    let case = dir.join("case.toml");
    if case.is_file() || !dir.join(STAGES_FILE).is_file() {
        return None;
    }
    let text = fem::read_regular_text(&dir.join(ORIGIN)).ok();
    let origin: Option<Origin> = text.and_then(|text| toml::from_str(&text).ok());
    let help = match origin {
        Some(Origin { case }) => format!(
            "Name the case of these results: {}. The program then writes it to the folder again.",
            case.display()
        ),
        None => "Name the case of these results. The program then writes it to the folder again."
            .to_owned(),
    };
    Some(InputError::new(&case, "", "", "is missing, and the folder has results", help))
}

/// Contents of `origin.toml`.
#[derive(Serialize, Deserialize)]
struct Origin {
    /// Path of the case file.
    case: PathBuf,
}

/// Command that messages about copies name. Every command writes the copies; `run` is the most common
/// command.
const COMMAND: &str = "run";

/// A copy of an input file of a case.
#[derive(Clone, Debug)]
struct CopiedFile {
    /// Name of the copy in the results folder.
    name: String,
    content: Vec<u8>,
    /// Path of the user's original file.
    original: PathBuf,
}

/// A case with copies of its input files in the results folder.
#[derive(Clone, Debug)]
pub(super) struct Copies {
    /// The case; its paths refer to the results folder.
    pub(super) case: Case,
    files: Vec<CopiedFile>,
    /// Pairs of paths: the copy, and the user's original file or folder.
    originals: Vec<(PathBuf, PathBuf)>,
    /// Path of the table of specimens and a description of its format, unless the format is plain (commas and decimal
    /// points).
    table_understood: Option<(PathBuf, String)>,
    /// Identifiers of specimens whose curves are exports of a testing machine, with a description of how each file
    /// was read.
    understood: Vec<(String, String)>,
}

impl Copies {
    /// Collects the files of a case that are copied to `dir`; nothing is written yet.
    ///
    /// # Errors
    /// If an input file of the case is invalid or cannot be read.
    pub(super) fn of(source: &CaseFile, dir: &Path) -> Result<Self, WorkflowError> {
        let mut copies = Self {
            case: source.case.clone(),
            files: Vec::new(),
            originals: Vec::new(),
            table_understood: None,
            understood: Vec::new(),
        };
        if source.path.is_file() {
            copies.originals.push((dir.join("case.toml"), source.path.clone()));
        }
        if !source.case.tests.is_empty() {
            // for a case with several tests, the copies are in the folders of the tests
            copies.case = with_absolute_paths(source)?;
            return Ok(copies);
        }
        // the folders of the validations have the copies
        copies.case.validation = validations_with_absolute_paths(source)?;
        if let Some(mesh) = &mut copies.case.specimen.mesh {
            let (from, to) = (source.beside(mesh), dir.join("specimen.msh"));
            if !same_file(&from, &to) {
                copies.files.push(copy_of("specimen.msh", &from)?);
                copies.originals.push((to, from));
            }
            *mesh = "specimen.msh".into();
        }
        if let Some(simulator) = &mut copies.case.simulator {
            for source_file in simulator.input.iter_mut().chain(&mut simulator.files) {
                let name =
                    format!("simulator/{}", source_file.file_name().unwrap_or_default().display());
                copies.files.extend(copied(
                    source,
                    dir,
                    &name,
                    source_file,
                    &mut copies.originals,
                )?);
            }
            // a program without a folder is searched in PATH
            if let Some(program) = simulator.command.first_mut()
                && Path::new(program.as_str()).components().count() > 1
            {
                let from = source.beside(Path::new(program.as_str()));
                let path = std::path::absolute(&from).map_err(|e| WorkflowError::io(&from, e))?;
                *program = path.display().to_string();
            }
        }
        let tables = [
            (copies.case.design.import.as_mut(), IMPORTED),
            (copies.case.experiments.as_mut().and_then(|e| e.values.as_mut()), VALUES),
        ];
        for (table, name) in tables {
            let Some(table) = table else { continue };
            copies.files.extend(copied(source, dir, name, table, &mut copies.originals)?);
        }
        for (number, candidate) in (1..).zip(&mut copies.case.further_tests.candidate) {
            make_absolute(&mut candidate.set, &source.path);
            let Some(mesh) = candidate.mesh() else { continue };
            let name = format!("candidates/{number}.msh");
            let (from, to) = (source.beside(Path::new(mesh)), dir.join(&name));
            if !same_file(&from, &to) {
                copies.files.push(copy_of(&name, &from)?);
                copies.originals.push((to, from));
            }
            candidate.set_mesh(&name);
        }
        let image = copies.case.specimen.image.iter_mut();
        let stacks = image.flat_map(|image| {
            let mask = image.segmentation.region.mask.iter_mut();
            let images = image.stack.iter_mut().chain(&mut image.labels);
            images.chain(image.further_stacks.iter_mut().flatten()).chain(mask)
        });
        for stack in stacks {
            // images are too large to be copied: make their paths absolute
            let from = source.beside(stack);
            *stack = found_from(dir, &from)?;
        }
        if let Some(import) = &mut copies.case.specimen.stl {
            let from = source.beside(&import.surfaces);
            import.surfaces = found_from(dir, &from)?;
        }
        let experiments = copies.case.experiments.as_mut();
        let measured = experiments.and_then(|e| Some((e.table.as_mut()?, &mut e.read, &e.test)));
        if let Some((table, read, test)) = measured {
            let (from, to) = (source.beside(table), dir.join(SPECIMENS));
            if from.is_file() {
                // the copies have the columns displacement_mm,force_N
                let options = read.take().unwrap_or_default();
                let SpecimenFiles { table: mut specimens, table_understood, understood, mistakes } =
                    SpecimenFiles::read(&from, &options).of_test(test.as_deref(), &from);
                if let Some(mistake) = mistakes.into_iter().next() {
                    return Err(mistake.into());
                }
                if !same_file(&from, &to) {
                    // scans are too large to be copied: make their paths absolute
                    for image in specimens.specimens.iter_mut().filter_map(|s| s.image.as_mut()) {
                        let image_path = from.with_file_name(&*image);
                        *image = std::path::absolute(&image_path)
                            .map_err(|e| WorkflowError::io(&image_path, e))?;
                    }
                    let files = specimens.to_files().map_err(|e| WorkflowError::io(&to, e))?;
                    // `files` contains the table first, and then one curve per specimen
                    let curves = specimens.specimens.iter().zip(&understood);
                    let curves = curves.map(|(specimen, how)| (Some(specimen), how.as_ref()));
                    for ((path, mut content), (specimen, how)) in files
                        .into_iter()
                        .zip([(None, table_understood.as_ref())].into_iter().chain(curves))
                    {
                        if let Some(how) = how {
                            content.splice(0..0, format!("# read as: {how}\n").into_bytes());
                        }
                        let original = match specimen {
                            None => from.clone(),
                            Some(specimen) => recorded_file(&from, &specimen.id)?,
                        };
                        if specimen.is_some() {
                            let copy = dir.join("experiments").join(&path);
                            copies.originals.push((copy, original.clone()));
                        }
                        let name = format!("experiments/{}", path.display());
                        copies.files.push(CopiedFile { name, content, original });
                    }
                    let ids = specimens.specimens.iter().map(|specimen| specimen.id.clone());
                    let read = ids.zip(understood).filter_map(|(id, how)| Some((id, how?)));
                    copies.understood = read.collect();
                    copies.table_understood = table_understood.map(|how| (from.clone(), how));
                    let (curves, copied) =
                        (from.with_file_name("curves"), dir.join("experiments/curves"));
                    copies.originals.extend([(to, from), (copied, curves)]);
                }
                *table = SPECIMENS.into();
            } else {
                // the table may not exist yet, since meshing does not need it; the experiments stage checks again
                *table = std::path::absolute(&from).map_err(|e| WorkflowError::io(&from, e))?;
            }
        }
        Ok(copies)
    }

    /// Checks that the results in a folder do not belong to another case.
    ///
    /// Two cases count as the same case if their files have the same path. Otherwise they count as the same case if the
    /// tables `specimen`, `prior`, `parameters`, `simulator` and `experiments`, the copied curves and the copied mesh are equal. A case file that
    /// was edited is therefore still the same case.
    ///
    /// # Errors
    /// [`WorkflowError::OtherFolder`] if the results belong to another case.
    pub(super) fn check_owner(&self, source: &CaseFile, dir: &Path) -> Result<(), WorkflowError> {
        if !dir.join("stages.toml").is_file() || is_case_of_folder(source, dir) {
            return Ok(());
        }
        let owner: Option<Origin> = fem::read_regular_text(&dir.join(ORIGIN))
            .ok()
            .and_then(|text| toml::from_str(&text).ok());
        let is_named = owner.as_ref().is_some_and(|owner| owner.case == name_of(source));
        if is_named || self.is_alike(dir) {
            return Ok(());
        }
        let owner = owner.map_or_else(|| dir.join("case.toml"), |owner| owner.case);
        Err(WorkflowError::OtherFolder { path: dir.to_owned(), owner })
    }

    /// Whether the case in the folder `dir` has the same specimen, prior, experiments and copied files as this case.
    fn is_alike(&self, dir: &Path) -> bool {
        let there: Option<toml::Table> =
            fem::read_regular_text(&dir.join("case.toml")).ok().and_then(|text| text.parse().ok());
        let (Some(there), Ok(here)) = (there, toml::Table::try_from(&self.case)) else {
            return false;
        };
        let part = |key: &str| there.get(key) == here.get(key);
        ["specimen", "prior", "parameters", "simulator", "experiments"].into_iter().all(part)
            && self.files.iter().all(|CopiedFile { name, content, .. }| {
                fem::read_regular(&dir.join(name)).is_ok_and(|now| now == *content)
            })
    }

    /// Writes the case, the copies of its input files, and the record of its origin. A copy that the user has edited
    /// is not overwritten.
    ///
    /// # Errors
    /// If a file of the user has the path of one of these files, or the folder cannot be written.
    pub(super) fn write(
        &self,
        source: &CaseFile,
        dir: &Path,
        folder: &ProductFolder,
    ) -> Result<(), WorkflowError> {
        let mut contents: Vec<(&str, Vec<u8>)> = Vec::new();
        for CopiedFile { name, content, original } in &self.files {
            if folder.has_bytes(name, content)
                || folder.is_replaceable(name)
                || !folder.is_edited(name)?
            {
                contents.push((name, content.clone()));
                continue;
            }
            let (edited, original) = (folder.path(name), original.display());
            say(
                "note",
                &format!(
                    "{} was edited and is used in place of {original}; --replace {name} copies that file again",
                    edited.display()
                ),
            );
        }
        if !is_case_of_folder(source, dir) {
            let origin = Origin { case: name_of(source) };
            let path = dir.join(ORIGIN);
            let text = toml::to_string(&origin)
                .map_err(|e| WorkflowError::Unusable(format!("{}: {e}", path.display())))?;
            contents.push((ORIGIN, text.into_bytes()));
        }
        // a `case.toml` written by the user in the results folder is not overwritten
        if !is_case_of_folder(source, dir) || folder.owner("case.toml")? == Owner::Program {
            contents.push(("case.toml", self.case.to_toml().into_bytes()));
        }
        // check all paths before the first file is written
        for (name, content) in &contents {
            if !folder.has_bytes(name, content) {
                folder.claim(name, COMMAND)?;
            }
        }
        if contents.iter().any(|(name, content)| !folder.has_bytes(name, content)) {
            self.say_what_was_understood();
        }
        let mut contents = contents.iter();
        contents.try_for_each(|(name, content)| folder.write(name, COMMAND, content).map(drop))
    }

    /// Prints how the files exported from testing machines were read, with one line for all files that were read in the
    /// same way.
    fn say_what_was_understood(&self) {
        if let Some((table, how)) = &self.table_understood {
            say("note", &format!("{} read as: {how}", table.display()));
        }
        let mut printed: Vec<&str> = Vec::new();
        for (id, how) in &self.understood {
            if printed.contains(&how.as_str()) {
                continue;
            }
            printed.push(how);
            let alike = self.understood.iter().filter(|(_, other)| other == how).count() - 1;
            let others = match alike {
                0 => String::new(),
                1 => " and 1 other".to_owned(),
                _ => format!(" and {alike} others"),
            };
            say("note", &format!("curve of {id}{others} read as: {how}"));
            if printed.len() == 5 {
                say(
                    "note",
                    "further curves are read in other ways: see the first lines of experiments/curves/*.csv",
                );
                break;
            }
        }
    }

    /// Adds the copies in the folder of a test or a validation, so that errors about these copies name the user's
    /// files, too.
    pub(super) fn add_originals_of(&mut self, inner: &Self) {
        self.originals.extend(inner.originals.iter().cloned());
    }

    /// Replaces the paths of copies in an error by the paths of the user's original files.
    pub(super) fn named_by_owner(&self, error: WorkflowError) -> WorkflowError {
        use WorkflowError as E;
        let user_path = |path: PathBuf| self.original(&path).unwrap_or(path);
        let user_text = |text: String| with_originals(text, &self.originals);
        match error {
            E::Input(e) => {
                let file = user_path(PathBuf::from(&e.file)).display().to_string();
                E::Input(InputError { file, ..e })
            }
            E::UnsoundMesh { path, source } => E::UnsoundMesh { path: user_path(path), source },
            E::Meshing { file, source } => E::Meshing { file: user_path(file), source },
            E::Segmentation { file, source } => E::Segmentation { file: user_path(file), source },
            E::Surfaces { file, source } => E::Surfaces { file: user_path(file), source },
            E::Separation { file, source } => E::Separation { file: user_path(file), source },
            E::Scan { file, source } => E::Scan { file: user_path(file), source },
            E::Packing { file, source } => E::Packing { file: user_path(file), source },
            E::Test { file, source } => E::Test { file: user_path(file), source },
            E::Unusable(text) => E::Unusable(user_text(text)),
            E::Rank { rank, message } => E::Rank { rank, message: user_text(message) },
            E::Ensemble(EnsembleError::FailsInEveryRun { message }) => {
                E::Ensemble(EnsembleError::FailsInEveryRun { message: user_text(message) })
            }
            other => other,
        }
    }

    /// Returns the user's original file for the path of a copy.
    fn original(&self, path: &Path) -> Option<PathBuf> {
        self.originals.iter().find_map(|(copy, original_path)| {
            let rest = path.strip_prefix(copy).ok()?;
            Some(if rest.as_os_str().is_empty() {
                original_path.clone()
            } else {
                original_path.join(rest)
            })
        })
    }
}

/// Replaces the paths of copies in a text by the paths of the original files. `originals` has pairs of the copy and the
/// original. A longer path that contains the path of a copy is not changed.
fn with_originals(text: String, originals: &[(PathBuf, PathBuf)]) -> String {
    let is_of_path = |c: char| c.is_alphanumeric() || "/\\-_.".contains(c);
    // a full stop after a path ends the sentence
    let continues = |rest: &str| {
        let rest = rest.strip_prefix('.').unwrap_or(rest);
        rest.starts_with(is_of_path)
    };
    let mut text = text;
    for (copy, original) in originals {
        let copy = copy.display().to_string();
        let mut start = 0;
        while let Some(found) = text[start..].find(&copy).map(|at| start + at) {
            let end = found + copy.len();
            start = end;
            if !text[..found].ends_with(is_of_path) && !continues(&text[end..]) {
                let original = original.display().to_string();
                text.replace_range(found..end, &original);
                start = found + original.len();
            }
        }
    }
    text
}

/// Returns the path by which the copied case in `dir` names a file that is not copied: an absolute path, or a relative
/// path of a file in the folder of the inputs of a detached case.
fn found_from(dir: &Path, file: &Path) -> Result<PathBuf, WorkflowError> {
    let absolute = |path: &Path| std::path::absolute(path).map_err(|e| WorkflowError::io(path, e));
    let (file, dir) = (absolute(file)?, absolute(dir)?);
    let inner = file.strip_prefix(&dir).ok().filter(|inner| inner.starts_with(INPUTS));
    Ok(inner.map_or_else(|| file.clone(), Path::to_owned))
}

/// Copies the file at `path` of a case to `name` in the results folder, and changes the path to the path of the
/// copy. Returns `None` if the file is already in the results folder.
fn copied(
    source: &CaseFile,
    dir: &Path,
    name: &str,
    path: &mut PathBuf,
    originals: &mut Vec<(PathBuf, PathBuf)>,
) -> Result<Option<CopiedFile>, WorkflowError> {
    let (from, to) = (source.beside(path), dir.join(name));
    *path = name.into();
    if same_file(&from, &to) {
        return Ok(None);
    }
    let copy = copy_of(name, &from)?;
    originals.push((to, from));
    Ok(Some(copy))
}

fn copy_of(name: &str, original: &Path) -> Result<CopiedFile, WorkflowError> {
    let content = fem::read_regular(original).map_err(|e| WorkflowError::io(original, e))?;
    Ok(CopiedFile { name: name.to_owned(), content, original: original.to_owned() })
}

/// Returns the canonical path of the case file, which identifies the case.
fn name_of(source: &CaseFile) -> PathBuf {
    source.path.canonicalize().unwrap_or_else(|_| source.path.clone())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_name_the_originals_of_copies() {
        let pair = |copy: &str, original: &str| (PathBuf::from(copy), PathBuf::from(original));
        let originals = [pair("out/case.toml", "bar.toml"), pair("out/simulator/a.sh", "../a.sh")];
        let named = |text: &str| with_originals(text.to_owned(), &originals);
        for (text, expected) in [
            ("out/case.toml: simulator.command", "bar.toml: simulator.command"),
            (
                "see out/simulator/a.sh and (out/case.toml), or out/case.toml.",
                "see ../a.sh and (bar.toml), or bar.toml.",
            ),
            ("/home/out/case.toml: x", "/home/out/case.toml: x"),
            ("out/case.toml.old, out/case.tomls", "out/case.toml.old, out/case.tomls"),
        ] {
            assert_eq!(named(text), expected);
        }
    }
}
