//! The file of a study: a base case, and the keys that each laboratory and each case changes.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use toml::Table;

use super::base::{Base, parsed};
use super::reference::Reference;
use super::written_study::{LABORATORIES, WrittenPart, WrittenStudy, WrittenVariant};
use crate::case::CaseFile;
use crate::error::InputError;

/// A study: several related calibrations.
#[derive(Clone, Debug)]
pub struct StudyFile {
    /// Path of the file.
    pub path: PathBuf,
    /// Text of the file.
    pub text: String,
    /// The study as written, followed by each of its variants.
    pub settings: Vec<StudySetting>,
}

/// All calibrations of a study under one setting.
#[derive(Clone, Debug)]
pub struct StudySetting {
    /// Folder of the results within the folder of the study: empty for the study itself, otherwise the name of the
    /// variant.
    pub folder: String,
    /// Title of the setting.
    pub title: String,
    /// Laboratories, which test virtual specimens. Each is run once for all cases that name it.
    pub laboratories: Vec<StudyLaboratory>,
    /// The calibrations, in order.
    pub cases: Vec<StudyCase>,
}

/// Virtual specimens that several cases calibrate against.
#[derive(Clone, Debug)]
pub struct StudyLaboratory {
    /// Name of the laboratory and of its folder.
    pub name: String,
    /// Case file of the laboratory. Only its stages up to `experiments` are run.
    pub file: CaseFile,
}

/// One calibration of a study.
#[derive(Clone, Debug)]
pub struct StudyCase {
    /// Name of the case and of its folder.
    pub name: String,
    /// The case file of the calibration.
    pub file: CaseFile,
    /// Name of the laboratory that provides the specimens; `None` if the case is calibrated against its own
    /// experiments.
    pub laboratory: Option<String>,
    /// Published results for comparison.
    pub reference: Reference,
}

/// Result of reading a study: its valid parts and its mistakes.
#[derive(Debug, Default)]
pub(super) struct ReadStudy {
    /// The study; `None` if the study or its base case cannot be read. Parts that are not valid cases are omitted.
    pub(super) file: Option<StudyFile>,
    pub(super) mistakes: Vec<StudyMistake>,
}

/// A mistake in a study.
#[derive(Debug)]
pub(super) struct StudyMistake {
    /// Folder of the laboratory or case; empty for the study itself and its base case.
    pub(super) part: String,
    pub(super) error: InputError,
}

impl StudyMistake {
    /// Converts the mistake to an error; its location includes the name of the part.
    fn into_error(self) -> InputError {
        let Self { part, error } = self;
        let location = match (part.is_empty(), error.place.is_empty()) {
            (true, _) => error.place,
            (false, true) => part,
            (false, false) => format!("{part}: {}", error.place),
        };
        InputError { place: location, ..error }
    }
}

impl StudyFile {
    /// Reads a study and the cases of its parts.
    ///
    /// `set` lists changes of keys that apply to all parts, each as `key.by.path=value` with a TOML value.
    ///
    /// # Errors
    /// The first mistake in the study, its base case or a case, with file, key, value and help.
    pub fn read(path: &Path, set: &[String]) -> Result<Self, InputError> {
        let ReadStudy { file, mistakes } = Self::read_all(path, set);
        match (file, mistakes.into_iter().next()) {
            (Some(file), None) => Ok(file),
            (_, Some(mistake)) => Err(mistake.into_error()),
            // a text that is not a study has at least one mistake
            (None, None) => {
                Err(InputError::new(path, "", "", "is not a study", "See docs/how-to/studies.md."))
            }
        }
    }

    /// Reads a study like [`StudyFile::read`], but returns all mistakes.
    pub(super) fn read_all(path: &Path, set: &[String]) -> ReadStudy {
        let mut read = ReadStudy::default();
        let (text, written) = match WrittenStudy::read(path) {
            Ok(read) => read,
            Err(error) => {
                read.fail("", error);
                return read;
            }
        };
        written.name_mistakes(path).into_iter().for_each(|error| read.fail("", error));
        let (base, mistakes) = Base::read(path, &written.base);
        mistakes.into_iter().for_each(|error| read.fail("", error));
        let mut common = Vec::new();
        for entry in set {
            match parsed(entry, path) {
                Ok(table) => common.push(table),
                Err(error) => read.fail("", error),
            }
        }
        let Some(base) = base else { return read };
        let variants = [None].into_iter().chain(written.variant.iter().map(Some));
        let settings = variants
            .map(|variant| {
                Parts { path, base: &base, common: &common, variant }.read(&written, &mut read)
            })
            .collect();
        read.file = Some(Self { path: path.to_owned(), text, settings });
        read
    }
}

impl ReadStudy {
    fn fail(&mut self, part: &str, error: InputError) {
        self.mistakes.push(StudyMistake { part: part.to_owned(), error });
    }
}

/// Sources of the parts of one setting.
struct Parts<'a> {
    path: &'a Path,
    base: &'a Base,
    /// Keys that are changed in all parts.
    common: &'a [Table],
    variant: Option<&'a WrittenVariant>,
}

impl Parts<'_> {
    /// Reads the setting; parts that are not valid cases are omitted.
    fn read(&self, written: &WrittenStudy, read: &mut ReadStudy) -> StudySetting {
        let mut setting = StudySetting {
            folder: self.variant.map(|variant| variant.name.clone()).unwrap_or_default(),
            title: self.variant.map_or(&written.title, |variant| &variant.title).clone(),
            laboratories: Vec::new(),
            cases: Vec::new(),
        };
        for part in &written.laboratory {
            let folder = setting.within(&format!("{LABORATORIES}/{}", part.name));
            let variant_sets = self.variant.iter().map(|variant| &variant.laboratory.set);
            let Some(file) = self.case(part, variant_sets, &folder, read) else { continue };
            let experiments = file.case.experiments.as_ref();
            if experiments.is_none_or(|e| e.virtual_specimens.is_none()) {
                let help = "Add the virtual specimens of the laboratory: set.experiments.virtual.";
                let problem = "has no virtual specimens";
                read.fail(&folder, InputError::new(self.path, "", "", problem, help));
            }
            setting.laboratories.push(StudyLaboratory { name: part.name.clone(), file });
        }
        for part in &written.case {
            let folder = setting.within(&part.name);
            let names = || written.laboratory.iter().map(|laboratory| laboratory.name.as_str());
            if let Some(named) =
                part.laboratory.as_ref().filter(|laboratory| names().all(|l| l != *laboratory))
            {
                let problem = format!("there is no laboratory {named:?}");
                let help = format!("Name one of: {}.", names().collect::<Vec<_>>().join(", "));
                read.fail(&folder, InputError::new(self.path, "", "", problem, help));
            }
            let variant_sets = self.variant.iter().flat_map(|variant| {
                let variant_cases = variant.case.iter().filter(|case| case.name == part.name);
                [&variant.set].into_iter().chain(variant_cases.map(|case| &case.set))
            });
            let Some(file) = self.case(part, variant_sets, &folder, read) else { continue };
            let WrittenPart { name, laboratory, reference, .. } = part.clone();
            setting.cases.push(StudyCase { name, file, laboratory, reference });
        }
        setting
    }

    /// Returns the case of a part: the base case without the keys `without`, then with the keys of the part, of the
    /// variant, and of all parts.
    fn case<'t>(
        &self,
        part: &'t WrittenPart,
        variant_sets: impl Iterator<Item = &'t Table>,
        folder: &str,
        read: &mut ReadStudy,
    ) -> Option<CaseFile>
    where
        Self: 't,
    {
        let sets = [&part.set].into_iter().chain(variant_sets).chain(self.common);
        let (file, mistakes) = self.base.with(self.path, &part.without, sets);
        mistakes.into_iter().for_each(|error| read.fail(folder, error));
        file
    }
}

impl StudySetting {
    /// Returns the laboratory of a case, if the case names one.
    pub fn laboratory(&self, case: &StudyCase) -> Option<&StudyLaboratory> {
        let name = case.laboratory.as_ref()?;
        self.laboratories.iter().find(|laboratory| laboratory.name == *name)
    }

    /// Folder of a laboratory within the folder of the study.
    pub(super) fn laboratory_folder(&self, laboratory: &StudyLaboratory) -> String {
        self.within(&format!("{LABORATORIES}/{}", laboratory.name))
    }

    /// Folders of all laboratories within the folder of the study.
    pub(super) fn laboratory_folders(&self) -> impl Iterator<Item = String> {
        self.laboratories.iter().map(|laboratory| self.laboratory_folder(laboratory))
    }

    /// Folders of all cases within the folder of the study.
    pub(super) fn case_folders(&self) -> impl Iterator<Item = String> {
        self.cases.iter().map(|case| self.within(&case.name))
    }

    /// Path of a file or folder of the setting within the folder of the study.
    pub(super) fn within(&self, name: &str) -> String {
        if self.folder.is_empty() { name.to_owned() } else { format!("{}/{name}", self.folder) }
    }
}

/// Returns the true parameter values of the virtual specimens, by the paths of the parameters.
pub(super) fn truths(
    laboratory: Option<&StudyLaboratory>,
    case: &CaseFile,
) -> BTreeMap<String, f64> {
    let file = laboratory.map_or(case, |laboratory| &laboratory.file);
    let specimens = file.case.experiments.as_ref().and_then(|e| e.virtual_specimens.as_ref());
    specimens
        .into_iter()
        .flat_map(|specimens| specimens.truth.iter())
        .map(|(parameter, truth)| (parameter.to_string(), *truth))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn study(text: &str) -> Result<StudyFile, InputError> {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("base.toml"), crate::case::Case::TEMPLATE).unwrap();
        let path = dir.path().join("study.toml");
        std::fs::write(&path, text).unwrap();
        StudyFile::read(&path, &["design.runs=12".to_owned()])
    }

    const TWO: &str = "title = \"two\"\nbase = \"base.toml\"\n[[laboratory]]\nname = \"50C\"\n\
        [laboratory.set]\nexperiments.virtual.seed = 5\n\
        [[case]]\nname = \"b\"\nlaboratory = \"50C\"\nset.specimen.grains.fraction = 0.25\n\
        without = [\"fidelity\"]\nreference.map.matrix.young_mpa = 295.0\n\
        [[case]]\nname = \"a\"\nset.design.seed = 3\n";

    #[test]
    fn cases_are_the_base_with_what_they_have_otherwise_in_the_order_written() {
        let study = study(TWO).unwrap();
        let study = &study.settings[0];
        assert_eq!(study.cases.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["b", "a"]);
        let grains = study.cases[0].file.case.specimen.grains.clone().unwrap();
        assert_eq!((grains.fraction, grains.seed), (0.25, 1), "what is not set is the base's");
        assert!(study.cases[0].file.case.fidelity.levels.is_empty());
        assert_eq!(study.cases[1].file.case.fidelity.levels.len(), 1);
        assert!(
            study.cases.iter().all(|case| case.file.case.design.runs == 12),
            "--set is for all"
        );
        assert_eq!(study.cases[1].file.case.design.seed, 3);
        let laboratory = study.laboratory(&study.cases[0]).unwrap();
        let truths = truths(Some(laboratory), &study.cases[0].file);
        assert_eq!(truths["matrix.young_mpa"], 280.0);
        assert!(study.laboratory(&study.cases[1]).is_none());
        let young = "matrix.young_mpa".parse().unwrap();
        assert_eq!(study.cases[0].reference.map.get(&young), Some(&295.0));
    }

    #[test]
    fn a_variant_is_the_study_with_other_keys_in_all_cases_or_laboratories() {
        let variant = "[[variant]]\nname = \"v\"\ntitle = \"other\"\nset.design.microstructure = \"one\"\n\
            laboratory.set.experiments.virtual.scans = false\n\
            [[variant.case]]\nname = \"a\"\nset.design.seed = 4\n";
        let study = self::study(&format!("{TWO}{variant}")).unwrap();
        let [base, other] = &study.settings[..] else { panic!("{}", study.settings.len()) };
        assert_eq!(
            [&base.title, &other.title, &base.folder, &other.folder],
            ["two", "other", "", "v"]
        );
        for (base, other) in base.cases.iter().zip(&other.cases) {
            let one = crate::case::Microstructure::One;
            assert_eq!((&base.name, other.file.case.design.microstructure), (&other.name, one));
            let seed = if base.name == "a" { 4 } else { base.file.case.design.seed };
            assert_eq!(other.file.case.design.seed, seed, "what one case has otherwise");
            let changed = crate::case::Case {
                design: base.file.case.design.clone(),
                ..other.file.case.clone()
            };
            assert_eq!(changed.to_toml(), base.file.case.to_toml(), "all else is as before");
        }
        let unknown = format!("{TWO}{}", variant.replace("name = \"a\"", "name = \"c\""));
        let error = self::study(&unknown).unwrap_err().to_string();
        assert!(error.contains("v.case.name") && error.contains("Name one of: b, a."), "{error}");
        let scans = |setting: &StudySetting| {
            let experiments = setting.laboratories[0].file.case.experiments.clone().unwrap();
            experiments.virtual_specimens.unwrap().scans
        };
        assert_eq!((scans(base), scans(other)), (true, false));
    }

    #[test]
    fn mistakes_are_told_with_their_case_and_key() {
        for (from, to, fragments) in [
            ("fraction = 0.25", "fracton = 0.25", &["b: ", "fracton", "study.toml"][..]),
            ("laboratory = \"50C\"", "laboratory = \"60C\"", &["no laboratory \"60C\"", "50C"]),
            ("[\"fidelity\"]", "[\"fidelty\"]", &["b: without = fidelty", "not in the base case"]),
            ("name = \"a\"", "name = \"b\"", &["\"b\"", "is already used"]),
            ("name = \"a\"", "name = \"runs\"", &["\"runs\"", "is already used"]),
            ("name = \"a\"", "name = \"../a\"", &["../a", "name of a folder"]),
            ("base.toml", "bse.toml", &["bse.toml", "cannot be read"]),
            ("title = \"two\"", "titel = \"two\"", &["line 1", "titel"]),
        ] {
            assert!(TWO.contains(from), "{from}");
            let error = study(&TWO.replacen(from, to, 1)).unwrap_err().to_string();
            for fragment in fragments {
                assert!(error.contains(fragment), "{fragment:?} is not in {error:?}");
            }
        }
    }
}
