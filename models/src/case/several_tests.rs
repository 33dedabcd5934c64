//! `[[tests]]`: several tests of one material. Each test is a complete case: the common case, with the keys of the
//! test.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::overlay::{merge, nested, remove};
use super::schema::changed_case;
use super::{ByParameter, CandidateCase, Case, CaseFile, PriorCase, ValidationCase};
use crate::error::InputError;

/// Tables that a test cannot change, because these tables define the joint calibration.
const JOINT: [&str; 6] = ["prior", "extend", "parameters", "tests", "validation", "further_tests"];

/// Keys of `[calibration]` that a test cannot change, because the joint calibration has one sampler and one model.
const JOINT_CALIBRATION: [&str; 11] = [
    "sampling",
    "chains",
    "warmup",
    "burn_in",
    "draws",
    "thin",
    "target_accept",
    "seed",
    "evidence",
    "between_tests",
    "joint",
];

/// Tables that define the simulations of a test. Tests with equal tables share their runs.
const SIMULATIONS: [&str; 12] = [
    "specimen",
    "material",
    "interface",
    "simulator",
    "parameters",
    "phase_field",
    "test",
    "conditions",
    "solver",
    "prior",
    "design",
    "fidelity",
];

/// Names of tables of a case or of its parameters. Regions and tests cannot have these names.
const RESERVED: [&str; 5] = ["tests", "test", "machine", "interface", "phase_field"];

/// `[[tests]]`: one of several tests of the same material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TestEntry {
    /// Name of the test. The folder of the test has the same name, and so have the entries of its specimens in
    /// the column `test` of the specimen table.
    pub name: String,
    /// Keys of the case whose values differ in this test, with the values for this test.
    #[serde(default, skip_serializing_if = "Table::is_empty")]
    #[schemars(schema_with = "test_keys")]
    pub set: Table,
    /// Keys of the case that are removed for this test.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
    /// Priors of parameters whose value in this test is independent of the other tests.
    #[serde(default, skip_serializing_if = "is_empty")]
    pub prior: PriorCase,
}

fn test_keys(_: &mut SchemaGenerator) -> Schema {
    let calibration = json_schema!({
        "description": "Likelihood of the test; all tests have one sampler.",
        "propertyNames": { "not": { "enum": JOINT_CALIBRATION } },
    });
    json_schema!({
        "allOf": [changed_case(), { "properties": { "calibration": calibration } }],
        "propertyNames": { "not": { "enum": JOINT } },
    })
}

fn is_empty(prior: &PriorCase) -> bool {
    prior.parameters().len() == 0
}

/// One test of `[[tests]]` as a complete case.
#[derive(Clone, Debug, PartialEq)]
pub struct SingleTest {
    /// Name of the test.
    pub name: String,
    /// Case of the test.
    pub file: CaseFile,
    /// Paths of the parameters that have a prior in this test only.
    pub own: Vec<String>,
}

/// A mistake in the case of one test.
#[derive(Clone, Debug)]
pub(super) struct TestMistake {
    pub(super) test: String,
    pub(super) error: InputError,
}

/// All tests of a case: the tests without mistakes, and the mistakes of all other tests.
#[derive(Clone, Debug, Default)]
pub(super) struct ReadTests {
    pub(super) tests: Vec<SingleTest>,
    pub(super) mistakes: Vec<TestMistake>,
}

/// Checks the name of a test, which is also the name of a folder and of a table of parameters. Returns the reason and the remedy
/// if the name is not allowed.
pub(super) fn check_name(name: &str, earlier: &[&str]) -> Result<(), (&'static str, &'static str)> {
    check_folder_name(name)?;
    if RESERVED.contains(&name) {
        return Err(("is the name of a table of parameters", "Give the test another name."));
    }
    if earlier.contains(&name) {
        return Err(("is the name of two tests", "Give each test a name of its own."));
    }
    Ok(())
}

/// Checks the name of a folder. Returns the reason and the remedy if the name is not allowed.
pub(super) fn check_folder_name(name: &str) -> Result<(), (&'static str, &'static str)> {
    let is_plain = |c: char| c.is_alphanumeric() || "-_.".contains(c);
    if !name.chars().all(is_plain) || name.trim_matches('.').is_empty() {
        return Err(("is not the name of a folder", "Use letters, digits and - _ only."));
    }
    Ok(())
}

/// Whether the name of a region is also the name of a table of parameters.
pub(super) fn is_reserved(region: &str) -> bool {
    RESERVED.contains(&region)
}

/// Reads the tests of a case. The seeds of the case are increased from test to test: the seed of virtual specimens
/// for each test, and the seed of the design for each test whose simulations differ from the simulations of the
/// earlier tests. Specimens and surrogates of different tests are then independent.
pub(super) fn read_tests(file: &CaseFile) -> ReadTests {
    let mut read = ReadTests::default();
    let mut simulations: Vec<String> = Vec::new();
    for (place, entry) in file.case.tests.iter().enumerate() {
        let (table, mut mistakes) = overlaid(file, entry);
        let Some(mut table) = table else {
            read.add_mistakes(entry, mistakes);
            continue;
        };
        let tables = SIMULATIONS.map(|key| table.get(key).map(Value::to_string));
        let simulation = tables.map(Option::unwrap_or_default).join("\n");
        let first = simulations.iter().position(|other| *other == simulation);
        let different = first.unwrap_or_else(|| {
            simulations.push(simulation);
            simulations.len() - 1
        });
        for (key, by) in [("experiments.virtual.seed", place), ("design.seed", different)] {
            if let (Some(Value::Integer(seed)), None) = (at(&table, key), at(&entry.set, key)) {
                let seed = seed.wrapping_add(by as i64) & i64::MAX;
                merge(&mut table, &nested(key, seed.into()));
            }
        }
        let test = "experiments.test";
        let is_common = |key: &str| at(&table, key).is_some() && at(&entry.set, key).is_none();
        if ["experiments.table", "experiments.values"].into_iter().any(is_common)
            && at(&entry.set, test).is_none()
        {
            if let Some(Value::String(written)) = at(&table, test) {
                let problem =
                    "is not used: each test has the specimens with its own name in the column test";
                let help = "Remove it. A test whose specimens have another name sets set.experiments.test.";
                mistakes.push(InputError::new(&file.path, test, written, problem, help));
            }
            merge(&mut table, &nested(test, entry.name.clone().into()));
        }
        let (single, of_case) = CaseFile::parse_all(&table.to_string(), &file.path);
        // line numbers of the merged text are not line numbers of the user's file
        mistakes.extend(of_case.into_iter().map(|error| InputError { excerpt: None, ..error }));
        match single.filter(|_| mistakes.is_empty()) {
            Some(single) => read.tests.push(SingleTest {
                name: entry.name.clone(),
                file: single,
                own: entry.prior.names().collect(),
            }),
            None => read.add_mistakes(entry, mistakes),
        }
    }
    read
}

impl ReadTests {
    fn add_mistakes(&mut self, entry: &TestEntry, mistakes: Vec<InputError>) {
        let test = || entry.name.clone();
        self.mistakes.extend(mistakes.into_iter().map(|error| TestMistake { test: test(), error }));
    }
}

/// Returns the case with the keys of a test, as a table, and the mistakes in these keys.
fn overlaid(file: &CaseFile, entry: &TestEntry) -> (Option<Table>, Vec<InputError>) {
    let mut mistakes = Vec::new();
    let mut refuse = |place: &str, key: &str, problem: &str, help: String| {
        mistakes.push(InputError::new(&file.path, place, key, problem, help));
    };
    let mut case = Case { tests: Vec::new(), ..file.case.clone() };
    case.calibration.between_tests = Default::default();
    case.validation = validations_of(file, entry);
    let of_test =
        |candidate: &mut CandidateCase| candidate.test.take().as_ref() == Some(&entry.name);
    case.further_tests.candidate.retain_mut(of_test);
    let mut prior = case.prior.take().unwrap_or_default();
    entry.prior.iter().for_each(|(parameter, own)| prior.insert(parameter.clone(), *own));
    case.prior = Some(prior);
    // keep only the widths of parameters of this test: the case may request a width for a parameter of another test
    let mut widths = ByParameter::default();
    let whole = case.whole_prior().unwrap_or_default();
    for (parameter, width) in case.further_tests.width90.iter() {
        if whole.get(parameter).is_some() {
            widths.insert(parameter.clone(), *width);
        }
    }
    case.further_tests.width90 = widths;
    for (parameter, _) in entry.prior.iter() {
        if case.parameters.contains_key(&parameter.to_string()) {
            let help = "Write one prior in [parameters] for all tests.".to_owned();
            let problem = "is a free parameter, which all tests share";
            refuse("prior", &parameter.to_string(), problem, help);
        }
    }
    let Ok(mut table) = Table::try_from(&case) else {
        refuse("", "", "cannot be written as TOML", "Leave the test out.".to_owned());
        return (None, mistakes);
    };
    let of_all = |key: &str| {
        let mut names = key.split('.');
        let (first, second) = (names.next().unwrap_or_default(), names.next());
        let is_joint = match first {
            // without the table `calibration`, a test would also lack the keys that all tests share
            "calibration" => second.is_none_or(|key| JOINT_CALIBRATION.contains(&key)),
            _ => JOINT.contains(&first),
        };
        is_joint.then(|| match first {
            "prior" => {
                "Write prior.… beside set: it is then a prior of this test alone.".to_owned()
            }
            "calibration" => "Write it in [calibration], once for all tests. A test can change calibration.likelihood \
                              and calibration.discrepancy."
                .to_owned(),
            _ => format!("Write [{first}] once for all tests."),
        })
    };
    for key in &entry.without {
        if let Some(help) = of_all(key) {
            refuse("without", key, "belongs to all tests", help);
        } else if !remove(&mut table, key) {
            let help = "Name keys of this case by their paths.".to_owned();
            refuse("without", key, "is not in the case", help);
        }
    }
    for (key, value) in &entry.set {
        let keys: Vec<String> = match (key.as_str(), value) {
            ("calibration", Value::Table(inner)) => {
                inner.keys().map(|own| format!("calibration.{own}")).collect()
            }
            ("calibration", _) => Vec::new(),
            _ => vec![key.clone()],
        };
        for key in keys {
            if let Some(help) = of_all(&key) {
                refuse("set", &key, "belongs to all tests", help);
            }
        }
    }
    merge(&mut table, &entry.set);
    (Some(table).filter(|_| mistakes.is_empty()), mistakes)
}

/// Returns the validations of a test. The seeds of their virtual specimens and designs differ from the seeds of all tests.
fn validations_of(file: &CaseFile, entry: &TestEntry) -> Vec<ValidationCase> {
    let case = &file.case;
    let own = case.validation.iter().enumerate();
    let own = own.filter(|(_, validation)| validation.test.as_ref() == Some(&entry.name));
    let seeded = |(place, validation): (usize, &ValidationCase)| {
        let mut validation = ValidationCase { test: None, ..validation.clone() };
        // the seeds of the tests are increased by less than `tests.len()`, so that all seeds differ
        let later = (case.tests.len() + place) as u64;
        let seed = |seed: u64| Value::Integer((seed.wrapping_add(later) as i64) & i64::MAX);
        let specimens = case.experiments.as_ref().and_then(|own| own.virtual_specimens.as_ref());
        let names = |set: &Table| {
            ["experiments.table", "experiments.values"].iter().any(|key| at(set, key).is_some())
        };
        let removes = |without: &[String]| without.iter().any(|key| key == "experiments.virtual");
        let names_specimens = names(&validation.set)
            || names(&entry.set)
            || removes(&validation.without)
            || removes(&entry.without);
        let seeds = [
            ("design.seed", Some(case.design.seed)),
            (
                "experiments.virtual.seed",
                specimens.map(|own| own.seed).filter(|_| !names_specimens),
            ),
        ];
        for (key, base) in seeds {
            if let (Some(base), None) = (base, at(&validation.set, key)) {
                merge(&mut validation.set, &nested(key, seed(base)));
            }
        }
        validation
    };
    own.map(seeded).collect()
}

/// Value at a dotted path.
fn at<'a>(table: &'a Table, path: &str) -> Option<&'a Value> {
    let mut keys = path.split('.');
    let first = keys.next().and_then(|key| table.get(key));
    keys.fold(first, |value, key| value?.get(key))
}

/// Returns the tests of a case with several tests, each as a complete case.
///
/// # Errors
/// The first mistake in a test.
pub(crate) fn single_tests(file: &CaseFile) -> Result<Vec<SingleTest>, InputError> {
    let ReadTests { tests, mistakes } = read_tests(file);
    let first = mistakes.into_iter().next().map(|TestMistake { test, error }| {
        let place = format!("tests ({test}).{}", error.place);
        InputError { place, ..error }
    });
    first.map_or(Ok(tests), Err)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::case::Likelihood;

    const SHIPPED: &str = include_str!("../../cases/fast-and-slow.toml");
    const SPECIMENS_OF_SLOW: &str =
        "set.experiments.virtual = { specimens = 6, noise.displacement_mm = 0.00005 }";

    const CASE_WITH_ONE_TEST: &str = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 0.7\n\
        [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\ndisplacement_mm = 0.2\n\
        [prior]\nmatrix.young_mpa = [250.0, 300.0]\n";

    fn read(text: &str) -> (Option<CaseFile>, Vec<String>) {
        let (file, mistakes) = CaseFile::parse_all(text, Path::new("case.toml"));
        (file, mistakes.iter().map(ToString::to_string).collect())
    }

    fn with(changes: &[(&str, &str)]) -> String {
        let mut text = SHIPPED.to_owned();
        for (from, to) in changes {
            assert!(text.contains(from), "the case has no {from:?}");
            text = text.replacen(from, to, 1);
        }
        text
    }

    #[test]
    fn each_test_is_the_case_with_its_keys_and_seeds_of_its_own() {
        let (file, mistakes) = read(SHIPPED);
        assert_eq!(mistakes, [""; 0]);
        let tests = single_tests(&file.unwrap()).unwrap();
        let names: Vec<&str> = tests.iter().map(|test| test.name.as_str()).collect();
        assert_eq!(names, ["fast", "slow"]);
        let of = |test: &SingleTest| {
            let case = &test.file.case;
            let specimens = case.experiments.clone().unwrap().virtual_specimens.unwrap();
            (
                case.test.duration_s,
                case.test.steps,
                specimens.specimens,
                specimens.seed,
                case.design.seed,
            )
        };
        assert_eq!(of(&tests[0]), (Some(1.0), Some(44), 8, 2026, 1));
        assert_eq!(of(&tests[1]), (Some(16.0), Some(44), 6, 2027, 2));
        assert!(tests.iter().all(|test| test.file.case.tests.is_empty() && test.own.is_empty()));
    }

    /// Tests that differ only in their specimens have the same simulations, and share the runs of
    /// these simulations.
    #[test]
    fn equal_simulations_have_one_design() {
        let text = with(&[(
            "displacement_mm = 0.06, duration_s = 16.0",
            "displacement_mm = 0.22, duration_s = 1.0",
        )]);
        let tests = single_tests(&read(&text).0.unwrap()).unwrap();
        let seeds: Vec<u64> = tests.iter().map(|test| test.file.case.design.seed).collect();
        assert_eq!(seeds, [1, 1]);
    }

    #[test]
    fn a_prior_of_one_test_is_in_this_test_alone() {
        let own = "prior.test.friction = { distribution = \"beta\", a = 2.0, b = 18.0 }\n\
                   set.experiments.virtual.truth.test.friction = 0.1";
        let text = with(&[
            (SPECIMENS_OF_SLOW, own),
            ("duration_s = 16.0 }", "duration_s = 16.0, platens = \"unilateral\" }"),
        ]);
        let (file, mistakes) = read(&text);
        assert_eq!(mistakes, [""; 0]);
        let file = file.unwrap();
        let tests = single_tests(&file).unwrap();
        let has = |test: &SingleTest| {
            test.file.case.prior.as_ref().unwrap().names().any(|name| name == "test.friction")
        };
        assert_eq!((has(&tests[0]), has(&tests[1])), (false, true));
        assert_eq!(tests[1].own, ["test.friction"]);
        // the case that is written with all defaults equals the original case
        let (again, mistakes) = read(&file.case.to_toml());
        assert_eq!(mistakes, [""; 0]);
        assert_eq!(again.unwrap().case, file.case);
    }

    #[test]
    fn a_table_of_specimens_is_divided_by_test() {
        let start = SHIPPED.find("[experiments.virtual]").unwrap();
        let end = SHIPPED.find("[calibration]").unwrap();
        let measured = "[experiments]\ntable = \"specimens.csv\"\n";
        let text = format!("{}{measured}{}", &SHIPPED[..start], &SHIPPED[end..])
            .replace(SPECIMENS_OF_SLOW, "");
        let (file, mistakes) = read(&text);
        assert_eq!(mistakes, [""; 0]);
        let tests = single_tests(&file.unwrap()).unwrap();
        let of = |test: &SingleTest| test.file.case.experiments.clone().unwrap().test;
        assert_eq!(
            (of(&tests[0]).as_deref(), of(&tests[1]).as_deref()),
            (Some("fast"), Some("slow"))
        );
        // a test may state another name of its specimens; a name that is stated for all tests would have no effect
        let named = text.replacen(
            "name = \"slow\"",
            "name = \"slow\"\nset.experiments.test = \"creep\"",
            1,
        );
        let (file, mistakes) = read(&named);
        assert_eq!(mistakes, [""; 0]);
        let tests = single_tests(&file.unwrap()).unwrap();
        assert_eq!(of(&tests[1]).as_deref(), Some("creep"));
        let unused = text.replacen(measured, &format!("{measured}test = \"fast\"\n"), 1);
        let (_, mistakes) = read(&unused);
        assert_eq!(mistakes.len(), 1, "{mistakes:?}");
        assert!(mistakes[0].contains("experiments.test = fast: is not used"), "{mistakes:?}");
    }

    /// One table of measured quantities has the specimens of all tests, by its column `test`.
    #[test]
    fn a_table_of_quantities_is_divided_by_test() {
        let dir = tempfile::tempdir().unwrap();
        for file in ["runs.csv", "measured.csv"] {
            std::fs::write(dir.path().join(file), "").unwrap();
        }
        let text = "[parameters]\nk = { unit = \"MPa\", prior = [1.0, 2.0] }\n\
                    [design]\nimport = \"runs.csv\"\n[qoi]\nquantities = [\"peak-force\"]\n\
                    [experiments]\nvalues = \"measured.csv\"\n\
                    [[tests]]\nname = \"fast\"\n[[tests]]\nname = \"slow\"\n";
        let (file, mistakes) = CaseFile::parse_all(text, &dir.path().join("case.toml"));
        assert!(mistakes.is_empty(), "{mistakes:?}");
        let tests = single_tests(&file.unwrap()).unwrap();
        let names = tests.iter().map(|test| test.file.case.experiments.clone().unwrap().test);
        assert_eq!(names.collect::<Vec<_>>(), [Some("fast".to_owned()), Some("slow".to_owned())]);
    }

    /// A test can change the likelihood and the discrepancy, which belong to its own quantities.
    #[test]
    fn a_test_has_its_own_likelihood_and_discrepancy() {
        let own =
            "set.calibration = { likelihood = \"curve\", discrepancy.percent.peak-force = 3.0 }";
        let text = with(&[(SPECIMENS_OF_SLOW, own)]);
        let (file, mistakes) = read(&text);
        assert_eq!(mistakes, [""; 0]);
        let tests = single_tests(&file.unwrap()).unwrap();
        let of = |test: &SingleTest| test.file.case.calibration.clone();
        assert_eq!(of(&tests[0]).likelihood, Likelihood::Quantities);
        assert_eq!(of(&tests[1]).likelihood, Likelihood::Curve);
        assert_eq!(of(&tests[1]).discrepancy.percent.len(), 1);
        assert_eq!(of(&tests[0]).seed, of(&tests[1]).seed);
    }

    #[test]
    fn a_relation_between_tests_needs_several_tests() {
        let text = format!(
            "{}\n[calibration]\nbetween_tests.matrix.young_mpa = \"own\"\n",
            CASE_WITH_ONE_TEST
        );
        let (_, mistakes) = read(&text);
        assert_eq!(mistakes.len(), 1, "{mistakes:?}");
        for part in ["calibration.between_tests = matrix.young_mpa", "[[tests]]"] {
            assert!(mistakes[0].contains(part), "{mistakes:?}");
        }
    }

    #[test]
    fn mistakes_have_the_name_of_their_test_and_the_remedy() {
        let between = |relation: &str| format!("[calibration]\nbetween_tests.{relation}\n");
        // replacements in the text of the case, and texts that the error message must contain
        type Mistake<'a> = (&'a [(&'a str, &'a str)], &'a [&'a str]);
        let cases: [Mistake<'_>; 21] = [
            (&[("name = \"slow\"", "name = \"fast\"")], &["tests[1].name", "two tests"]),
            (&[("name = \"slow\"", "name = \"../slow\"")], &["tests[1].name", "letters, digits"]),
            (
                &[("name = \"slow\"", "name = \"machine\"")],
                &["tests[1].name", "table of parameters"],
            ),
            (&[("name = \"slow\"", "nam = \"slow\"")], &["unknown key \"nam\"", "mean \"name\"?"]),
            (
                &[("set.test = { displacement_mm = 0.06", "set.prior = { displacement_mm = 0.06")],
                &["tests (slow).set = prior", "beside set"],
            ),
            (
                &[(SPECIMENS_OF_SLOW, "set.further_tests.specimens = [1]")],
                &["tests (slow).set = further_tests", "once for all tests"],
            ),
            (
                &[(SPECIMENS_OF_SLOW, "without = [\"test.stepz\"]")],
                &["tests (slow).without = test.stepz", "not in the case"],
            ),
            (
                &[(SPECIMENS_OF_SLOW, "set.calibration.between_tests.matrix.young_mpa = \"own\"")],
                &["tests (slow).set = calibration.between_tests", "in [calibration], once"],
            ),
            (
                &[(SPECIMENS_OF_SLOW, "set.calibration = { seed = 3, likelihood = \"curve\" }")],
                &["tests (slow).set = calibration.seed", "calibration.likelihood and"],
            ),
            (
                &[(SPECIMENS_OF_SLOW, "without = [\"calibration.chains\"]")],
                &["tests (slow).without = calibration.chains", "belongs to all tests"],
            ),
            (&[(SPECIMENS_OF_SLOW, "set.calibration.chians = 3")], &["chians", "mean \"chains\"?"]),
            (&[("duration_s = 16.0", "duration_s = -16.0")], &["tests (slow).test.duration_s"]),
            (
                &[("duration_s = 16.0", "duratoin_s = 16.0")],
                &["duratoin_s", "mean \"duration_s\"?"],
            ),
            (&[("radius_mm = 2.5", "radius_mm = -2.5")], &["specimen.radius_mm = -2.5"]),
            (
                &[("[calibration]\n", &between("matrix.young_mpa = \"onw\""))],
                &["onw", "mean \"own\"?"],
            ),
            (
                &[("[calibration]\n", &between("grain.young_mpa = \"own\""))],
                &["calibration.between_tests.grain.young_mpa", "not a parameter of [prior]"],
            ),
            (
                &[("[calibration]\n", &between("matrix.young_mpa = { varies-percent = 500.0 }"))],
                &["calibration.between_tests.matrix.young_mpa = 500"],
            ),
            (
                &[("[calibration]\n", &between("matrix.young_mpa = { trend = \"temperature\" }"))],
                &[
                    "calibration.between_tests.matrix.young_mpa",
                    "follows the temperature, but fast has none",
                    "set.test.temperature_celsius",
                ],
            ),
            (
                &[
                    ("[calibration]\n", &between("matrix.young_mpa = { trend = \"rate\" }")),
                    (
                        "displacement_mm = 0.06, duration_s = 16.0",
                        "displacement_mm = 0.44, duration_s = 2.0",
                    ),
                ],
                &["follows the rate, but all tests have"],
            ),
            (
                &[("[calibration]\n", &between("matrix.young_mpa = { trend = \"tempo\" }"))],
                &["tempo", "temperature"],
            ),
            (
                &[(
                    "[material.grain]",
                    "[material.machine]\nyoung_mpa = 1.0\npoisson = 0.2\n[material.grain]",
                )],
                &["material.machine", "not the name of a region"],
            ),
        ];
        for (changes, fragments) in cases {
            let (_, mistakes) = read(&with(changes));
            let all = mistakes.join("\n");
            for fragment in fragments {
                assert!(all.contains(fragment), "{fragment:?} is not in {all:?}");
            }
        }
        // a mistake of the case itself is reported once, without the name of a test
        let (_, mistakes) = read(&with(&[("radius_mm = 2.5", "radius_mm = -2.5")]));
        assert_eq!(mistakes.len(), 1, "{mistakes:?}");
        assert!(!mistakes[0].contains("tests ("), "{mistakes:?}");
    }
}
