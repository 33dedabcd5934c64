//! The file of a study: a base case, and what each laboratory and each case has otherwise.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use toml::Table;

use super::base::{Base, parsed};
use crate::case::{ByParameter, CaseFile};
use crate::error::InputError;

/// A study: several calibrations that belong together.
#[derive(Clone, Debug)]
pub struct StudyFile {
    /// The file.
    pub path: PathBuf,
    /// What it says.
    pub text: String,
    /// The study as it is written, and after it each of its variants.
    pub settings: Vec<StudySetting>,
}

/// All calibrations of a study under one setting.
#[derive(Clone, Debug)]
pub struct StudySetting {
    /// The folder of its results within that of the study: none for the study itself, the name of a variant.
    pub folder: String,
    /// Its headline.
    pub title: String,
    /// Where virtual specimens are tested, each once for all cases that name it.
    pub laboratories: Vec<StudyLaboratory>,
    /// The calibrations, in order.
    pub cases: Vec<StudyCase>,
}

/// Virtual specimens that several cases calibrate against.
#[derive(Clone, Debug)]
pub struct StudyLaboratory {
    /// Its name, that of a folder.
    pub name: String,
    /// A case of which only the experiments are made.
    pub file: CaseFile,
}

/// One calibration of a study.
#[derive(Clone, Debug)]
pub struct StudyCase {
    /// Its name, that of a folder.
    pub name: String,
    /// The case.
    pub file: CaseFile,
    /// Name of the laboratory whose specimens it calibrates against, in place of its own experiments.
    pub laboratory: Option<String>,
    /// Published results to be compared with.
    pub reference: Reference,
}

/// Published results of a case.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Reference {
    /// Joint mode.
    pub map: ByParameter<f64>,
    /// Differences of the simulation at the mode to the experimental means in per cent, in the order of
    /// the quantities of interest.
    pub percent_error: Vec<f64>,
}

/// A study as it is written.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    title: String,
    base: PathBuf,
    #[serde(default)]
    laboratory: Vec<WrittenPart>,
    #[serde(default)]
    case: Vec<WrittenPart>,
    #[serde(default)]
    variant: Vec<WrittenVariant>,
}

/// Keys that all cases, or all laboratories, have otherwise in a second run of the study.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenVariant {
    name: String,
    title: String,
    #[serde(default)]
    set: Table,
    #[serde(default)]
    laboratory: WrittenChange,
    /// Keys that some of the cases have otherwise besides.
    #[serde(default)]
    case: Vec<WrittenOwnChange>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenOwnChange {
    name: String,
    set: Table,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenChange {
    #[serde(default)]
    set: Table,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenPart {
    name: String,
    #[serde(default)]
    laboratory: Option<String>,
    /// Keys of the base case that it has otherwise.
    #[serde(default)]
    set: Table,
    /// Keys of the base case that it has not.
    #[serde(default)]
    without: Vec<String>,
    #[serde(default)]
    reference: Reference,
}

impl StudyFile {
    /// Reads a study and the cases that it is made of.
    ///
    /// `set` has keys that all its parts have otherwise than the file says, as `key.by.path=value` with a
    /// value of TOML.
    ///
    /// # Errors
    /// Names file, key, value and help: of the study, of its base, or of a case that is none.
    pub fn read(path: &Path, set: &[String]) -> Result<Self, InputError> {
        let text = fem::read_regular_text(path)
            .map_err(|e| InputError::unreadable(path, &e, "Check its name and place."))?;
        let written: Written = toml::from_str(&text).map_err(|e| {
            if CaseFile::parse(&text, path).is_ok() {
                let help = format!("Run it with: breccia run {}", path.display());
                return InputError::new(path, "", "", "is a case, no study", help);
            }
            let line = e.span().map_or(1, |span| text[..span.start].matches('\n').count() + 1);
            let help = "A study has the keys title, base, tables [[laboratory]] and [[case]] with name, \
                        laboratory, set, without, reference, and [[variant]] with name, title, set, \
                        laboratory.set, and [[variant.case]] with name, set.";
            InputError::new(path, format!("line {line}"), "", e.message().replace('\n', "; "), help)
        })?;
        if written.case.is_empty() {
            let help = "Add a table [[case]] for each calibration.";
            return Err(InputError::new(path, "case", "", "is missing", help));
        }
        check_names(path, &written)?;
        let base = Base::read(path, &written.base)?;
        let common = set.iter().map(|entry| parsed(entry, path)).collect::<Result<Vec<_>, _>>()?;
        let setting = |variant: Option<&WrittenVariant>| {
            let all = |own: Vec<&Table>| -> Vec<Table> {
                own.into_iter().chain(&common).cloned().collect()
            };
            let tested = all(variant.iter().map(|variant| &variant.laboratory.set).collect());
            let laboratories = written
                .laboratory
                .iter()
                .map(|part| laboratory_of(path, &base, part, &tested))
                .collect::<Result<Vec<_>, _>>()?;
            let case = |part: &WrittenPart| {
                let own = variant.iter().flat_map(|variant| {
                    let own = variant.case.iter().filter(|own| own.name == part.name);
                    [&variant.set].into_iter().chain(own.map(|own| &own.set))
                });
                case_of(path, &base, part, &all(own.collect()), &laboratories)
            };
            let cases = written.case.iter().map(case).collect::<Result<Vec<_>, _>>()?;
            let folder = variant.map(|variant| variant.name.clone()).unwrap_or_default();
            let title = variant.map_or(&written.title, |variant| &variant.title).clone();
            Ok::<_, InputError>(StudySetting { folder, title, laboratories, cases })
        };
        let mut settings = vec![setting(None)?];
        for variant in &written.variant {
            settings.push(setting(Some(variant)).map_err(|error| InputError {
                place: format!("{}: {}", variant.name, error.place),
                ..error
            })?);
        }
        Ok(Self { path: path.to_owned(), text, settings })
    }
}

impl StudySetting {
    /// The laboratory of a case.
    pub fn laboratory(&self, case: &StudyCase) -> Option<&StudyLaboratory> {
        let name = case.laboratory.as_ref()?;
        self.laboratories.iter().find(|laboratory| laboratory.name == *name)
    }

    /// The folder of a laboratory within that of the study.
    pub(super) fn laboratory_folder(&self, laboratory: &StudyLaboratory) -> String {
        self.within(&format!("{LABORATORIES}/{}", laboratory.name))
    }

    /// Those of all laboratories.
    pub(super) fn laboratory_folders(&self) -> impl Iterator<Item = String> {
        self.laboratories.iter().map(|laboratory| self.laboratory_folder(laboratory))
    }

    /// Those of all cases.
    pub(super) fn case_folders(&self) -> impl Iterator<Item = String> {
        self.cases.iter().map(|case| self.within(&case.name))
    }

    /// The name of a file or folder of the setting within the folder of the study.
    pub(super) fn within(&self, name: &str) -> String {
        if self.folder.is_empty() { name.to_owned() } else { format!("{}/{name}", self.folder) }
    }
}

/// The folder of the laboratories among those of the cases.
const LABORATORIES: &str = "laboratories";
/// The folder of the runs beside them.
const RUNS: &str = "runs";

fn laboratory_of(
    path: &Path,
    base: &Base,
    part: &WrittenPart,
    common: &[Table],
) -> Result<StudyLaboratory, InputError> {
    let file = base.with(path, &part.name, &part.without, [&part.set].into_iter().chain(common))?;
    let experiments = file.case.experiments.as_ref();
    if experiments.is_none_or(|e| e.virtual_specimens.is_none()) {
        let help = "Add experiments.virtual to its set: what is tested there.";
        return Err(InputError::new(path, &part.name, "", "has no virtual specimens", help));
    }
    Ok(StudyLaboratory { name: part.name.clone(), file })
}

fn case_of(
    path: &Path,
    base: &Base,
    part: &WrittenPart,
    common: &[Table],
    laboratories: &[StudyLaboratory],
) -> Result<StudyCase, InputError> {
    if let Some(named) = &part.laboratory
        && !laboratories.iter().any(|laboratory| laboratory.name == *named)
    {
        let known: Vec<&str> = laboratories.iter().map(|l| l.name.as_str()).collect();
        let problem = format!("there is no laboratory {named:?}");
        let help = format!("Name one of: {}.", known.join(", "));
        return Err(InputError::new(path, &part.name, "", problem, help));
    }
    let file = base.with(path, &part.name, &part.without, [&part.set].into_iter().chain(common))?;
    let WrittenPart { name, laboratory, reference, .. } = part.clone();
    Ok(StudyCase { name, file, laboratory, reference })
}

/// Names are those of folders beside each other.
fn check_names(path: &Path, written: &Written) -> Result<(), InputError> {
    let mut names = vec![LABORATORIES, RUNS];
    let parts = written.laboratory.iter().chain(&written.case).map(|part| &part.name);
    for name in parts.chain(written.variant.iter().map(|variant| &variant.name)) {
        let refuse =
            |problem, help| Err(InputError::new(path, "name", format!("{name:?}"), problem, help));
        let is_plain = |c: char| c.is_alphanumeric() || "-_.".contains(c);
        if !name.chars().all(is_plain) || name.trim_matches('.').is_empty() {
            return refuse("is the name of a folder", "Use letters, digits and - _ only.");
        }
        if names.contains(&name.as_str()) {
            return refuse("is taken", "Name each laboratory, case and variant otherwise.");
        }
        names.push(name);
    }
    for variant in &written.variant {
        let known: Vec<&str> = written.case.iter().map(|case| case.name.as_str()).collect();
        if let Some(own) = variant.case.iter().find(|own| !known.contains(&own.name.as_str())) {
            let place = format!("{}.case.name", variant.name);
            let help = format!("Name one of: {}.", known.join(", "));
            let value = format!("{:?}", own.name);
            return Err(InputError::new(path, place, value, "is no case of the study", help));
        }
    }
    Ok(())
}

/// Truths of the parameters that a laboratory tests, by their paths.
pub(super) fn truths(
    laboratory: Option<&StudyLaboratory>,
    own: &CaseFile,
) -> BTreeMap<String, f64> {
    let file = laboratory.map_or(own, |laboratory| &laboratory.file);
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
        let [own, other] = &study.settings[..] else { panic!("{}", study.settings.len()) };
        assert_eq!(
            [&own.title, &other.title, &own.folder, &other.folder],
            ["two", "other", "", "v"]
        );
        for (own, other) in own.cases.iter().zip(&other.cases) {
            let one = crate::case::Microstructure::One;
            assert_eq!((&own.name, other.file.case.design.microstructure), (&other.name, one));
            let seed = if own.name == "a" { 4 } else { own.file.case.design.seed };
            assert_eq!(other.file.case.design.seed, seed, "what one case has otherwise");
            let changed = crate::case::Case {
                design: own.file.case.design.clone(),
                ..other.file.case.clone()
            };
            assert_eq!(changed.to_toml(), own.file.case.to_toml(), "all else is as before");
        }
        let unknown = format!("{TWO}{}", variant.replace("name = \"a\"", "name = \"c\""));
        let error = self::study(&unknown).unwrap_err().to_string();
        assert!(error.contains("v.case.name") && error.contains("Name one of: b, a."), "{error}");
        let scans = |setting: &StudySetting| {
            let experiments = setting.laboratories[0].file.case.experiments.clone().unwrap();
            experiments.virtual_specimens.unwrap().scans
        };
        assert_eq!((scans(own), scans(other)), (true, false));
    }

    #[test]
    fn mistakes_are_told_with_their_case_and_key() {
        for (from, to, parts) in [
            ("fraction = 0.25", "fracton = 0.25", &["b: ", "fracton", "study.toml"][..]),
            ("laboratory = \"50C\"", "laboratory = \"60C\"", &["no laboratory \"60C\"", "50C"]),
            ("[\"fidelity\"]", "[\"fidelty\"]", &["b.without = fidelty", "not in the base case"]),
            ("name = \"a\"", "name = \"b\"", &["\"b\"", "is taken"]),
            ("name = \"a\"", "name = \"runs\"", &["\"runs\"", "is taken"]),
            ("name = \"a\"", "name = \"../a\"", &["../a", "name of a folder"]),
            ("base.toml", "bse.toml", &["bse.toml", "cannot be read"]),
            ("title = \"two\"", "titel = \"two\"", &["line 1", "titel"]),
        ] {
            assert!(TWO.contains(from), "{from}");
            let error = study(&TWO.replacen(from, to, 1)).unwrap_err().to_string();
            for part in parts {
                assert!(error.contains(part), "{part:?} is not in {error:?}");
            }
        }
    }
}
