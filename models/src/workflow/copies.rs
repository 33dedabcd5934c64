//! The folder of the results as a case of its own: what is copied there, whose case it is, and how
//! messages name a person's files and not our copies of them.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::WorkflowError;
use super::files::{SPECIMENS, same_file};
use super::freshness::STAGES_FILE;
use super::in_place::is_case_of_folder;
use super::product_folder::{Owner, ProductFolder};
use crate::case::{Case, CaseFile};
use crate::error::InputError;
use crate::progress::say;
use crate::specimen_files::{SpecimenFiles, recorded_file};

/// Which case a folder belongs to.
const ORIGIN: &str = "origin.toml";

/// The mistake of a folder with results whose case is to be taken from it and is not there.
pub fn missing_case(dir: &Path) -> Option<InputError> {
    let case = dir.join("case.toml");
    if case.is_file() || !dir.join(STAGES_FILE).is_file() {
        return None;
    }
    let text = fem::read_regular_text(&dir.join(ORIGIN)).ok();
    let origin: Option<Origin> = text.and_then(|text| toml::from_str(&text).ok());
    let help = match origin {
        Some(Origin { case }) => format!(
            "Name the case, which these results were made from: {}. It is then written there again.",
            case.display()
        ),
        None => "Name the case that these results were made from. It is then written there again."
            .to_owned(),
    };
    Some(InputError::new(&case, "", "", "is missing, and the folder has results", help))
}

/// `origin.toml`.
#[derive(Serialize, Deserialize)]
struct Origin {
    /// The case's file.
    case: PathBuf,
}

/// The command whose name stands in messages about copies, which every command writes.
const COMMAND: &str = "run";

/// A copy of a file that a case names.
#[derive(Clone, Debug)]
struct CopiedFile {
    /// Its name in the folder of the results.
    name: String,
    content: Vec<u8>,
    /// The user's own file.
    original: PathBuf,
}

/// A case whose files lie beside it in the folder of the results.
#[derive(Clone, Debug)]
pub(super) struct Copies {
    /// The case; what it names is in the folder.
    pub(super) case: Case,
    files: Vec<CopiedFile>,
    /// Our copies and the person's own files or folders.
    originals: Vec<(PathBuf, PathBuf)>,
    /// The table of specimens and how it was read, unless that is commas and decimal points.
    table_understood: Option<(PathBuf, String)>,
    /// Specimens whose curves are exports of a testing machine, and how these were read.
    understood: Vec<(String, String)>,
}

impl Copies {
    /// What of a case goes to `dir`; nothing is written yet.
    ///
    /// # Errors
    /// A file that the case names is wrong.
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
        if let Some(mesh) = &mut copies.case.specimen.mesh {
            let (from, to) = (source.beside(mesh), dir.join("specimen.msh"));
            if !same_file(&from, &to) {
                copies.files.push(copy_of("specimen.msh", &from)?);
                copies.originals.push((to, from));
            }
            *mesh = "specimen.msh".into();
        }
        for (place, candidate) in (1..).zip(&mut copies.case.further_tests.candidate) {
            let Some(mesh) = candidate.mesh() else { continue };
            let name = format!("candidates/{place}.msh");
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
            let own = image.stack.iter_mut().chain(&mut image.labels);
            own.chain(image.further_stacks.iter_mut().flatten()).chain(mask)
        });
        for stack in stacks {
            // too large to be copied
            let from = source.beside(stack);
            *stack = std::path::absolute(&from).map_err(|e| WorkflowError::io(&from, e))?;
        }
        if let Some(import) = &mut copies.case.specimen.stl {
            let from = source.beside(&import.surfaces);
            import.surfaces =
                std::path::absolute(&from).map_err(|e| WorkflowError::io(&from, e))?;
        }
        let experiments = copies.case.experiments.as_mut();
        let measured = experiments.and_then(|e| Some((e.table.as_mut()?, &mut e.read)));
        if let Some((table, read)) = measured {
            let (from, to) = (source.beside(table), dir.join(SPECIMENS));
            if from.is_file() {
                // the copies are displacement_mm,force_N
                let options = read.take().unwrap_or_default();
                let SpecimenFiles { table: mut specimens, table_understood, understood, mistakes } =
                    SpecimenFiles::read(&from, &options);
                if let Some(mistake) = mistakes.into_iter().next() {
                    return Err(mistake.into());
                }
                if !same_file(&from, &to) {
                    // scans are too large to be copied
                    for image in specimens.specimens.iter_mut().filter_map(|s| s.image.as_mut()) {
                        let place = from.with_file_name(&*image);
                        *image = std::path::absolute(&place)
                            .map_err(|e| WorkflowError::io(&place, e))?;
                    }
                    let files = specimens.to_files().map_err(|e| WorkflowError::io(&to, e))?;
                    // the table comes first, then a curve for each specimen
                    let curves = specimens.specimens.iter().zip(&understood);
                    let curves = curves.map(|(specimen, how)| (Some(specimen), how.as_ref()));
                    for ((place, mut content), (specimen, how)) in files
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
                            let copy = dir.join("experiments").join(&place);
                            copies.originals.push((copy, original.clone()));
                        }
                        let name = format!("experiments/{}", place.display());
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
                // a mesh can be made before the specimens are tested; the experiments stage asks again
                *table = std::path::absolute(&from).map_err(|e| WorkflowError::io(&from, e))?;
            }
        }
        Ok(copies)
    }

    /// Refuses a folder with results of another case.
    ///
    /// A case is known by its file, or else by what it tests and calibrates: specimen, prior and
    /// experiments, curves and mesh included. Other values in one file are the same case going on.
    ///
    /// # Errors
    /// [`WorkflowError::OtherFolder`].
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

    /// Whether the case in the folder tests and calibrates the same.
    fn is_alike(&self, dir: &Path) -> bool {
        let there: Option<toml::Table> =
            fem::read_regular_text(&dir.join("case.toml")).ok().and_then(|text| text.parse().ok());
        let (Some(there), Ok(here)) = (there, toml::Table::try_from(&self.case)) else {
            return false;
        };
        let part = |key: &str| there.get(key) == here.get(key);
        ["specimen", "prior", "experiments"].into_iter().all(part)
            && self.files.iter().all(|CopiedFile { name, content, .. }| {
                fem::read_regular(&dir.join(name)).is_ok_and(|now| now == *content)
            })
    }

    /// Writes the case and what it names, and whose they are. A copy that the user has edited is used as it is.
    ///
    /// # Errors
    /// A file of the user's in the place of one of these; the folder cannot be written.
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
        // a case that the user has written there is read as it is
        if !is_case_of_folder(source, dir) || folder.owner("case.toml")? == Owner::Program {
            contents.push(("case.toml", self.case.to_toml().into_bytes()));
        }
        // all or none
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

    /// Prints how exports were read, once for all that were read alike.
    fn say_what_was_understood(&self) {
        if let Some((table, how)) = &self.table_understood {
            say("note", &format!("{} read as: {how}", table.display()));
        }
        let mut told: Vec<&str> = Vec::new();
        for (id, how) in &self.understood {
            if told.contains(&how.as_str()) {
                continue;
            }
            told.push(how);
            let alike = self.understood.iter().filter(|(_, other)| other == how).count() - 1;
            let others = if alike == 0 { String::new() } else { format!(" and {alike} others") };
            say("note", &format!("curve of {id}{others} read as: {how}"));
            if told.len() == 5 {
                say(
                    "note",
                    "further curves are read in other ways: the first line of experiments/curves/*.csv",
                );
                break;
            }
        }
    }

    /// The error with the names of a person's own files in place of those of our copies.
    pub(super) fn named_by_owner(&self, error: WorkflowError) -> WorkflowError {
        use WorkflowError as E;
        let own = |path: PathBuf| self.original(&path).unwrap_or(path);
        match error {
            E::Input(e) => {
                let file = own(PathBuf::from(&e.file)).display().to_string();
                E::Input(InputError { file, ..e })
            }
            E::UnsoundMesh { path, source } => E::UnsoundMesh { path: own(path), source },
            E::Meshing { file, source } => E::Meshing { file: own(file), source },
            E::Segmentation { file, source } => E::Segmentation { file: own(file), source },
            E::Surfaces { file, source } => E::Surfaces { file: own(file), source },
            E::Separation { file, source } => E::Separation { file: own(file), source },
            E::Scan { file, source } => E::Scan { file: own(file), source },
            E::Packing { file, source } => E::Packing { file: own(file), source },
            E::Test { file, source } => E::Test { file: own(file), source },
            other => other,
        }
    }

    /// The person's own file behind a copy.
    fn original(&self, path: &Path) -> Option<PathBuf> {
        self.originals.iter().find_map(|(copy, own)| {
            let rest = path.strip_prefix(copy).ok()?;
            Some(if rest.as_os_str().is_empty() { own.clone() } else { own.join(rest) })
        })
    }
}

fn copy_of(name: &str, original: &Path) -> Result<CopiedFile, WorkflowError> {
    let content = fem::read_regular(original).map_err(|e| WorkflowError::io(original, e))?;
    Ok(CopiedFile { name: name.to_owned(), content, original: original.to_owned() })
}

/// What a case is known by: the place of its file, if it has one.
fn name_of(source: &CaseFile) -> PathBuf {
    source.path.canonicalize().unwrap_or_else(|_| source.path.clone())
}
