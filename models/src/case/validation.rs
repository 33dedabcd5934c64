//! `[[validation]]`: comparisons of the posterior with specimens that the calibration does not use.

use std::collections::BTreeMap;

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

use super::overlay::{merge, nested, remove};
use super::schema::{changed_tables, percent_of_quantities};
use super::{CalibrationCase, Case, CaseFile, Likelihood};
use crate::error::InputError;
use crate::qoi::Quantity;

/// Tables that a validation may change. All other tables are fixed, because they define the calibration.
const TABLES: [&str; 12] = [
    "specimen",
    "material",
    "interface",
    "phase_field",
    "test",
    "machine",
    "conditions",
    "solver",
    "simulator",
    "qoi",
    "experiments",
    "design",
];

/// Keys of `[experiments]` that name the specimens, each with the keys that are not allowed together with this key.
const SPECIMENS: [(&str, &[&str]); 3] = [
    ("table", &["values", "virtual", "group", "test"]),
    ("values", &["table", "virtual", "read", "group", "test"]),
    ("virtual", &["table", "values", "read", "group", "test"]),
];

/// `[[validation]]`: a test whose specimens are predicted from the posterior and compared with their measured curves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ValidationCase {
    /// Name of the validation, and of its folder.
    pub name: String,
    /// With `[[tests]]`: name of the test that the validation is compared with or changes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub test: Option<String>,
    /// Number of posterior draws at which the test is simulated. Not used if the surrogate predicts the test.
    #[serde(default = "twenty_four")]
    #[schemars(range(min = 4, max = 10_000))]
    pub draws: usize,
    /// Keys of the case whose values differ in this test, with the values for this test.
    #[serde(default, skip_serializing_if = "Table::is_empty")]
    #[schemars(schema_with = "validation_keys")]
    pub set: Table,
    /// Keys of the case that are removed for this test.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub without: Vec<String>,
    /// Standard deviation in % of quantities between specimens. Default: as calibrated, for the calibrated quantities.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    #[schemars(transform = percent_of_quantities(1e-3, 200.0))]
    pub scatter_percent: BTreeMap<Quantity, f64>,
}

fn validation_keys(_: &mut SchemaGenerator) -> Schema {
    changed_tables(&TABLES)
}

/// Returns the case for the simulations and the held-out specimens of a validation, with paths relative to the folder
/// of this case. `place` is the place of the validation in the case, from 0.
///
/// The specimens of the validation replace the specimens of the case. If the validation does not set a seed, the seed
/// differs from the seed of the case, so that virtual specimens and packings differ, too.
///
/// # Errors
/// All mistakes of the case of the validation, each with the name of the validation.
pub(crate) fn validation_case(
    file: &CaseFile,
    entry: &ValidationCase,
    place: usize,
) -> Result<CaseFile, Vec<InputError>> {
    let named = |error: InputError| {
        // line numbers of the merged text are not line numbers of the user's file
        let place = format!("validation ({}).{}", entry.name, error.place);
        InputError { place, excerpt: None, ..error }
    };
    let table = overlaid(file, entry, place).map_err(|error| vec![named(error)])?;
    let (own, mistakes) = CaseFile::parse_all(&table.to_string(), &file.path);
    match own.filter(|_| mistakes.is_empty()) {
        Some(own) => Ok(own),
        None => Err(mistakes.into_iter().map(named).collect()),
    }
}

/// Whether the surrogate of this case predicts the specimens of a validation: the validation has the same specimen,
/// material, test and machine, and compares calibrated quantities.
pub(crate) fn has_surrogate_for(file: &CaseFile, entry: &ValidationCase) -> bool {
    // both cases are read from a table, so that defaults and the notation of numbers do not cause differences
    let read = |table: Table| {
        let mut case: Case = table.try_into().ok()?;
        case.complete();
        Some(case)
    };
    let of_case = Table::try_from(&file.case).ok().and_then(read);
    let own = overlaid(file, entry, 0).ok().and_then(read);
    let (Some(a), Some(b)) = (of_case, own) else { return false };
    let calibrated = a.compared_quantities();
    a.specimen == b.specimen
        && a.material == b.material
        && a.interface == b.interface
        && a.phase_field == b.phase_field
        && a.test == b.test
        && a.machine == b.machine
        && a.conditions == b.conditions
        && a.solver == b.solver
        && a.simulator == b.simulator
        && a.qoi.slope_fraction == b.qoi.slope_fraction
        && b.compared_quantities().iter().all(|quantity| calibrated.contains(quantity))
}

/// The case with the keys of a validation, as a table.
fn overlaid(file: &CaseFile, entry: &ValidationCase, place: usize) -> Result<Table, InputError> {
    let refuse = |rest: &str, key: &str, problem: &str, help: String| {
        Err(InputError::new(&file.path, rest, key, problem, help))
    };
    let first = |key: &str| key.split('.').next().unwrap_or_default().to_owned();
    let all = entry.set.keys().map(|key| ("set", key));
    for (list, key) in all.chain(entry.without.iter().map(|key| ("without", key))) {
        if !TABLES.contains(&first(key).as_str()) {
            let help = format!("Name keys of: {}.", TABLES.join(", "));
            return refuse(list, key, "belongs to the calibration", help);
        }
    }
    let mut case = file.case.clone();
    case.prior = case.whole_prior();
    let Case { extend, validation, sequential, design, fidelity, calibration, confirm, .. } =
        &mut case;
    extend.clear();
    validation.clear();
    *sequential = None;
    // runs at posterior draws need no derivatives
    design.derivatives = false;
    (*fidelity, *confirm) = Default::default();
    // quantities that the validation names replace the comparison of the curves
    let names_quantities = at(&entry.set, "qoi.quantities").is_some();
    let likelihood = if names_quantities { Likelihood::Quantities } else { calibration.likelihood };
    *calibration = CalibrationCase { likelihood, ..CalibrationCase::default() };
    case.further_tests = Default::default();
    let mut table = match Table::try_from(&case) {
        Ok(table) => table,
        Err(e) => return refuse("set", "", &e.to_string(), "Leave it out.".to_owned()),
    };
    replace_specimens(&mut table, &entry.set);
    for key in &entry.without {
        if !remove(&mut table, key) {
            let help = "Name keys of this case by their paths.".to_owned();
            return refuse("without", key, "is not in the case", help);
        }
    }
    for key in ["experiments.virtual.seed", "design.seed"] {
        if let Some(Value::Integer(seed)) = at(&table, key) {
            let seed = seed.wrapping_add(place as i64 + 1) & i64::MAX;
            merge(&mut table, &nested(key, seed.into()));
        }
    }
    merge(&mut table, &entry.set);
    Ok(table)
}

/// Removes the keys of `[experiments]` that do not apply to the specimens that `set` names.
fn replace_specimens(table: &mut Table, set: &Table) {
    let Some(Value::Table(own)) = set.get("experiments") else { return };
    let Some(Value::Table(experiments)) = table.get_mut("experiments") else { return };
    for (key, others) in SPECIMENS {
        if own.contains_key(key) {
            others.iter().for_each(|other| drop(experiments.remove(*other)));
        }
    }
}

/// Value at a dotted path.
fn at<'a>(table: &'a Table, path: &str) -> Option<&'a Value> {
    let mut keys = path.split('.');
    let first = keys.next().and_then(|key| table.get(key));
    keys.fold(first, |value, key| value?.get(key))
}

fn twenty_four() -> usize {
    24
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// The default case with one validation.
    fn parsed(validation: &str) -> Result<CaseFile, String> {
        let text = format!("{}\n[[validation]]\nname = \"other\"\n{validation}", Case::TEMPLATE);
        CaseFile::parse(&text, Path::new("case.toml")).map_err(|e| e.to_string())
    }

    fn validation(validation: &str) -> (CaseFile, CaseFile) {
        let file = parsed(validation).unwrap();
        let own = validation_case(&file, &file.case.validation[0], 0).unwrap();
        (file, own)
    }

    const MORE: &str = "set.experiments.virtual.specimens = 3\n";

    #[test]
    fn a_validation_is_the_case_with_other_keys_specimens_and_seeds() {
        let text = format!("{MORE}set.test = {{ displacement_mm = 0.11, duration_s = 30.0 }}");
        let (file, own) = validation(&text);
        assert_eq!(own.case.test.displacement_mm, Some(0.11));
        let seed = |case: &Case| {
            let experiments = case.experiments.as_ref().unwrap();
            let own = experiments.virtual_specimens.as_ref().unwrap();
            (own.specimens, own.seed)
        };
        let ((count, seed_of_own), (_, seed_of_case)) = (seed(&own.case), seed(&file.case));
        assert_eq!((count, seed_of_own), (3, seed_of_case + 1));
        assert!(own.case.validation.is_empty() && own.case.further_tests.candidate.is_empty());
        // a table replaces virtual specimens
        let text = "set.experiments.table = \"held-out.csv\"\nset.experiments.group = \"B\"";
        let experiments = validation(text).1.case.experiments.unwrap();
        assert!(
            experiments.virtual_specimens.is_none() && experiments.group.as_deref() == Some("B")
        );
        // with the seed of the case, the validation would have the specimens of the case
        let same = format!("set.experiments.virtual.seed = {seed_of_case}");
        let error = parsed(&same).unwrap_err();
        assert!(error.contains("experiments.virtual.seed"), "{error}");
    }

    #[test]
    fn the_surrogate_predicts_other_specimens_of_the_same_test_only() {
        let is_emulated = |text: &str| {
            let file = parsed(&format!("{MORE}{text}")).unwrap();
            has_surrogate_for(&file, &file.case.validation[0])
        };
        assert!(is_emulated(""));
        assert!(is_emulated("set.qoi.quantities = [\"peak-force\"]"));
        // equal values with another notation are no change
        assert!(is_emulated("set.specimen.radius_mm = 2.5"));
        for other in [
            "set.qoi.quantities = [\"peak-force\", \"energy-to-peak\"]\nscatter_percent = { energy-to-peak = 5.0 }",
            "set.qoi.slope_fraction = 0.4",
            "set.test.steps = 40",
            "set.specimen.height_mm = 3.0",
            "set.machine.compliance_mm_per_n = 0.00001",
            "set.material.grain.young_mpa = 20000",
        ] {
            assert!(!is_emulated(other), "{other}");
        }
    }

    #[test]
    fn keys_of_the_calibration_and_wrong_values_are_refused() {
        for (text, fragments) in [
            (
                "set.calibration.draws = 10",
                vec!["calibration", "belongs to the calibration", "specimen, material"],
            ),
            ("without = [\"prior.matrix\"]", vec!["without", "belongs to the calibration"]),
            ("without = [\"test.nothing\"]", vec!["test.nothing", "is not in the case"]),
            ("set.test.friction = -1.0", vec!["validation (other)", "friction", "-1"]),
            ("draws = 3", vec!["validation (other).draws", "3"]),
            ("typo = 1", vec!["typo"]),
        ] {
            let error = parsed(&format!("{MORE}{text}")).unwrap_err();
            for fragment in fragments {
                assert!(error.contains(fragment), "{text}: {fragment}: {error}");
            }
        }
    }

    #[test]
    fn a_validation_without_specimens_is_refused() {
        let error = parsed("without = [\"experiments\"]").unwrap_err();
        for part in ["validation (other).without", "experiments", "set.experiments.table"] {
            assert!(error.contains(part), "{part}: {error}");
        }
        // other specimens replace the specimens of the case
        let other = "without = [\"experiments\"]\nset.experiments.table = \"held-out.csv\"";
        parsed(other).unwrap();
    }

    #[test]
    fn a_validation_has_the_name_of_a_folder_of_its_own() {
        let named = |names: &[&str]| {
            let entry = |name: &&str| format!("[[validation]]\nname = \"{name}\"\n{MORE}");
            let all: Vec<String> = names.iter().map(entry).collect();
            let text = format!("{}\n{}", Case::TEMPLATE, all.concat());
            CaseFile::parse(&text, Path::new("case.toml")).map(drop).map_err(|e| e.to_string())
        };
        // a validation may have the name of a table of parameters, which a test may not have
        named(&["test", "machine"]).unwrap();
        for (names, problem) in [
            (["a", "a"], "two validations"),
            (["a", "../a"], "not the name of a folder"),
            (["a", ".."], "not the name of a folder"),
        ] {
            let error = named(&names).unwrap_err();
            assert!(error.contains(problem), "{names:?}: {error}");
        }
    }
}
