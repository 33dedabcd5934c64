//! Keys of a case that differ from their defaults.

use toml::{Table, Value};

use super::Case;

/// Returns every key whose value differs from its default, with both values. The second value is missing for a
/// key without a default.
///
/// The default of a key is its value in the case without the key, so that defaults that depend on other keys are
/// right too.
pub(crate) fn changed_keys(case: &Case) -> Vec<(String, Value, Option<Value>)> {
    let Ok(whole) = Table::try_from(case) else { return Vec::new() };
    let mut changed = Vec::new();
    for key in leaves(&whole) {
        let (Some(value), Some(rest)) = (at(&whole, &key), without(&whole, &key)) else {
            continue;
        };
        let default = completed(rest).and_then(|case| at(&case, &key).cloned());
        if default.as_ref() != Some(value) {
            changed.push((key.join("."), value.clone(), default));
        }
    }
    changed
}

/// Returns the table of a case completed by all defaults; `None` if the table lacks a required key.
fn completed(table: Table) -> Option<Table> {
    let mut case: Case = table.try_into().ok()?;
    case.complete();
    Table::try_from(&case).ok()
}

/// Returns the paths of all values that are not tables, in the order of the table.
fn leaves(table: &Table) -> Vec<Vec<String>> {
    let mut paths = Vec::new();
    for (name, value) in table {
        match value {
            Value::Table(inner) => {
                let path = |rest: Vec<String>| [vec![name.clone()], rest].concat();
                paths.extend(leaves(inner).into_iter().map(path));
            }
            _ => paths.push(vec![name.clone()]),
        }
    }
    paths
}

fn at<'a>(table: &'a Table, path: &[String]) -> Option<&'a Value> {
    let (first, rest) = path.split_first()?;
    let value = table.get(first)?;
    if rest.is_empty() { Some(value) } else { at(value.as_table()?, rest) }
}

/// Returns the table without the value at a path. Tables that become empty remain.
fn without(table: &Table, path: &[String]) -> Option<Table> {
    let mut table = table.clone();
    let (last, parents) = path.split_last()?;
    let mut inner = &mut table;
    for name in parents {
        inner = inner.get_mut(name)?.as_table_mut()?;
    }
    inner.remove(last)?;
    Some(table)
}

#[cfg(test)]
mod tests {
    use fem::SolverOptions;

    use super::changed_keys;
    use crate::case::{
        CalibrationCase, Case, CaseFile, DesignCase, SurrogateCase, validation_case,
    };

    /// With `likelihood = "curve"`, the compared quantities are not the quantities in `qoi.quantities`. The key
    /// `qoi.quantities` nevertheless keeps its value in the case and in the written case, and a validation that sets the
    /// key compares these quantities.
    #[test]
    fn the_likelihood_of_curves_changes_no_other_key() {
        let template = Case::TEMPLATE
            .replacen("likelihood = \"quantities\"", "likelihood = \"curve\"", 1)
            .replacen("percent = { slope = 1.5, ", "percent = { ", 1);
        let read = |set: &str| {
            let specimens = "set.experiments.virtual.specimens = 3";
            let validation = format!("[[validation]]\nname = \"other\"\n{specimens}\n{set}");
            let text = format!("{template}\n{validation}");
            CaseFile::parse(&text, "case.toml".as_ref()).unwrap()
        };
        let file = read("");
        let named = CaseFile::default_case().case.qoi.quantities;
        assert_eq!(file.case.qoi.quantities, named);
        assert_ne!(file.case.compared_quantities(), named);
        let changed = changed_keys(&file.case);
        assert!(changed.iter().any(|(key, ..)| key == "calibration.likelihood"), "{changed:?}");
        assert!(!changed.iter().any(|(key, ..)| key == "qoi.quantities"), "{changed:?}");
        let again = CaseFile::parse(&file.case.to_toml(), &file.path).unwrap();
        assert_eq!(again, file);

        let held_out =
            |file: &CaseFile| validation_case(file, &file.case.validation[0], 0).unwrap();
        let own = held_out(&file).case;
        assert_eq!(own.compared_quantities(), file.case.compared_quantities());
        let own = held_out(&read("set.qoi.quantities = [\"slope\"]")).case;
        assert_eq!(own.compared_quantities(), own.qoi.quantities);
        assert_eq!(own.qoi.quantities.len(), 1);
    }

    #[test]
    fn changed_keys_have_their_defaults_and_unchanged_keys_are_not_among_them() {
        let mut case = CaseFile::default_case().case;
        case.design = DesignCase { runs: 12, ..DesignCase::default() };
        case.calibration = CalibrationCase { draws: 150, ..CalibrationCase::default() };
        (case.surrogate, case.solver) = (SurrogateCase::default(), SolverOptions::default());
        let changed = changed_keys(&case);
        let change_of = |key: &str| changed.iter().find(|(name, ..)| name == key);
        let integers = |key: &str| {
            let (_, value, default) = change_of(key)?;
            Some((value.as_integer()?, default.as_ref()?.as_integer()?))
        };
        let runs = DesignCase::default().runs as i64;
        assert_eq!(integers("design.runs"), Some((12, runs)));
        let draws = CalibrationCase::default().draws as i64;
        assert_eq!(integers("calibration.draws"), Some((150, draws)));
        // a required key has no default
        assert!(
            change_of("material.matrix.young_mpa").is_some_and(|(.., default)| default.is_none())
        );
        for key in ["design.seed", "calibration.chains", "surrogate.max_order", "solver.tolerance"]
        {
            assert!(change_of(key).is_none(), "{key}: {changed:?}");
        }
    }
}
