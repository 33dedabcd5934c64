//! Measured quantities from a table that replaces curves (`experiments.values`).

use std::collections::BTreeSet;
use std::path::Path;

use super::experiment_inputs;
use super::mesh_scale::MeshScale;
use super::specimen_quantities::{cell, check_scatter, missing_quantities, read_cell};
use crate::error::InputError;
use crate::experiment::{Specimen, SpecimenTable, TestCurve};
use crate::fracture::column_means;
use crate::pipeline::task::Task;
use crate::qoi::Quantity;
use crate::results_folder::error::WorkflowError;
use crate::simulation::stiffness::STIFFNESS_RATIO;
use crate::table::CsvTable;

/// Smallest mean of a quantity relative to its largest value. The calibration divides by the means.
const SMALLEST_MEAN: f64 = 1e-6;

/// A specimen with its measured quantities.
pub(crate) struct MeasuredSpecimen {
    pub(crate) id: String,
    pub(crate) group: String,
    /// The quantities, in the order of the case; NaN for an empty cell.
    pub(crate) values: Vec<f64>,
}

/// Reads the measured quantities of the specimens of a test, or of all specimens if `test` is `None`: the columns `id`,
/// optionally `group` and `test`, and a column per quantity.
///
/// # Errors
/// Fails if a column is missing, a cell is neither empty nor a number, all cells of a specimen are empty, two specimens
/// have the same name, or no specimen belongs to the test.
pub(crate) fn read_measured(
    file: &Path,
    quantities: &[Quantity],
    test: Option<&str>,
) -> Result<Vec<MeasuredSpecimen>, InputError> {
    let columns: Vec<String> = quantities.iter().map(|q| q.column().into_owned()).collect();
    let required: Vec<&str> =
        ["id"].into_iter().chain(columns.iter().map(String::as_str)).collect();
    let table = CsvTable::read(file, &required)?;
    let (mut ids, mut tests) = (BTreeSet::new(), BTreeSet::new());
    let mut specimens: Vec<MeasuredSpecimen> = Vec::new();
    for row in table.rows() {
        let id = row.text("id").to_owned();
        if id.is_empty() || !ids.insert(id.clone()) {
            let help = "Give each specimen a name of its own.";
            return Err(row.error("id", "is missing or is the name of another specimen", help));
        }
        let of_row = row.text("test");
        tests.extend((!of_row.is_empty()).then(|| of_row.to_owned()));
        // specimens of other tests may lack all quantities of this test
        if test.is_some_and(|test| test != of_row) {
            continue;
        }
        let value = |(quantity, column): (&Quantity, &String)| {
            read_cell(&row, column, quantity.is_positive())
        };
        let values: Vec<f64> =
            quantities.iter().zip(&columns).map(value).collect::<Result<_, _>>()?;
        if values.iter().all(|value| value.is_nan()) {
            let help = "Write at least one number, or remove the line.";
            return Err(row.error("id", "has no quantity", help));
        }
        specimens.push(MeasuredSpecimen { id, group: row.text("group").to_owned(), values });
    }
    if let Some(test) = test.filter(|test| !ids.is_empty() && !tests.contains(*test)) {
        let help = match tests.is_empty() {
            true => "Add a column test with the name of the test of each specimen.".to_owned(),
            false => {
                let names: Vec<&str> = tests.iter().map(String::as_str).collect();
                format!("The column test has: {}.", names.join(", "))
            }
        };
        let problem = "no specimen belongs to this test";
        return Err(InputError::new(file, "column test", format!("{test:?}"), problem, help));
    }
    Ok(specimens)
}

/// Checks whether a calibration to the given specimens is possible: at least `least` specimens, and for each quantity a
/// specimen that has it, a mean that is not zero, and scatter are necessary. Returns a warning for each quantity that
/// some specimens lack.
///
/// # Errors
/// Names the file and the quantity.
pub(crate) fn check_measured(
    file: &Path,
    quantities: &[Quantity],
    specimens: &[MeasuredSpecimen],
    least: usize,
) -> Result<Vec<String>, InputError> {
    if specimens.len() < least {
        let count = specimens.len();
        let problem = format!("has {count} specimens of the chosen group");
        let help = "Scatter between specimens needs at least two.";
        return Err(InputError::new(file, "", "", problem, help));
    }
    let values: Vec<Vec<f64>> = specimens.iter().map(|specimen| specimen.values.clone()).collect();
    for (m, mean) in column_means(&values).into_iter().enumerate() {
        if mean.is_nan() {
            let place = format!("column {}", quantities[m].column());
            let problem = "has no number for any specimen";
            let help = "Write the measured values, or remove the quantity from qoi.quantities.";
            return Err(InputError::new(file, place, "", problem, help));
        }
        let largest = values.iter().map(|row| row[m].abs()).fold(0.0, f64::max);
        if mean.abs() <= SMALLEST_MEAN * largest {
            let location = format!("column {}", quantities[m].column());
            let problem = "has a mean of zero over the specimens, to which the scatter is relative";
            let help = "Add a constant to the quantity, in the results of the runs too.";
            return Err(InputError::new(file, location, mean.to_string(), problem, help));
        }
    }
    let without_scatter = (least > 1).then(|| check_scatter(file, quantities, &values)).flatten();
    without_scatter.map_or_else(|| Ok(missing_quantities(quantities, &values)), Err)
}

/// Writes `experiments.csv` from the table of measured quantities.
///
/// # Errors
/// Fails if the table cannot be used, or if a file cannot be written.
pub(crate) fn write_measured(task: &Task<'_>, file: &Path) -> Result<String, WorkflowError> {
    let inputs = &task.inputs;
    let qoi = inputs.qoi();
    let test = experiment_inputs::test_of_specimens(inputs);
    let all = read_measured(file, &qoi.quantities, test)?;
    let chosen = experiment_inputs::chosen(inputs, without_curves(&all))?;
    let is_chosen = |measured: &MeasuredSpecimen| {
        chosen.specimens.iter().any(|specimen| specimen.id == measured.id)
    };
    let specimens: Vec<MeasuredSpecimen> = all.into_iter().filter(is_chosen).collect();
    let warnings = check_measured(file, &qoi.quantities, &specimens, inputs.least_specimens())?;
    warnings.iter().for_each(|warning| task.warn(warning));
    let findings: [[String; 4]; 0] = [];
    task.write_csv("curve_checks.csv", ["id", "finding", "value", "help"], findings)?;
    let [displacement, force] = MeshScale::COLUMNS;
    let header = ["id", "group", displacement, force, "slope_fraction"];
    let columns: Vec<_> = qoi.quantities.iter().map(|quantity| quantity.column()).collect();
    let columns = columns.iter().map(AsRef::as_ref);
    let rows = specimens.iter().map(|measured| {
        let scale = [1.0, 1.0, qoi.slope_fraction].map(|x| x.to_string());
        let values = measured.values.iter().copied().map(cell);
        let names = [measured.id.clone(), measured.group.clone()];
        names.into_iter().chain(scale).chain(values).chain([String::new()]).collect::<Vec<_>>()
    });
    let header = header.into_iter().chain(columns).chain([STIFFNESS_RATIO]);
    task.write_csv("experiments.csv", header, rows.collect::<Vec<_>>())?;
    Ok(format!("{} specimens", specimens.len()))
}

/// The specimens as a table, for the choice of a group.
pub(crate) fn without_curves(specimens: &[MeasuredSpecimen]) -> SpecimenTable {
    let specimen = |measured: &MeasuredSpecimen| Specimen {
        id: measured.id.clone(),
        height_mm: f64::NAN,
        radius_mm: f64::NAN,
        group: measured.group.clone(),
        test: None,
        slope_fraction: None,
        image: None,
        rate_mm_per_s: None,
        curve: TestCurve::default(),
    };
    SpecimenTable { specimens: specimens.iter().map(specimen).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<MeasuredSpecimen>, String> {
        read_test(text, None)
    }

    fn read_test(text: &str, test: Option<&str>) -> Result<Vec<MeasuredSpecimen>, String> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("measured.csv");
        std::fs::write(&path, text).unwrap();
        let named = |name: &str| toml::Value::from(name).try_into::<Quantity>().unwrap();
        let quantities = [named("column:u_mm"), named("peak-force")];
        let specimens = read_measured(&path, &quantities, test).map_err(|e| e.to_string())?;
        check_measured(&path, &quantities, &specimens, 2).map_err(|e| e.to_string())?;
        Ok(specimens)
    }

    #[test]
    fn measured_quantities_are_read_by_their_columns() {
        let rows = read("peak_force_N,u_mm,id,group\n10,-2,a,x\n11,3,b,x\n").unwrap();
        let values: Vec<&[f64]> = rows.iter().map(|row| &row.values[..]).collect();
        assert_eq!(values, [[-2.0, 10.0], [3.0, 11.0]]);
        assert_eq!((rows[1].id.as_str(), rows[1].group.as_str()), ("b", "x"));
    }

    /// A table with the specimens of several tests: the specimens of other tests may lack the quantities of this test.
    #[test]
    fn the_column_test_chooses_specimens() {
        let text = "id,test,u_mm,peak_force_N\na,slow,1,10\nb,fast,,\nc,slow,2,11\nd,,3,12\n";
        let ids = |test: &str| -> Result<Vec<String>, String> {
            let rows = read_test(text, Some(test))?;
            Ok(rows.into_iter().map(|row| row.id).collect())
        };
        assert_eq!(ids("slow").unwrap(), ["a", "c"]);
        assert!(ids("fast").unwrap_err().contains("b: has no quantity"), "{:?}", ids("fast"));
        let unknown = ids("creep").unwrap_err();
        for part in ["column test", "\"creep\"", "has: fast, slow"] {
            assert!(unknown.contains(part), "{unknown}");
        }
        let without = read_test("id,u_mm,peak_force_N\na,1,2\nb,2,3\n", Some("slow"));
        assert!(without.err().unwrap().contains("Add a column test"));
        // two tests cannot have specimens of one name, and all rows count without a chosen test
        let twice = read_test("id,test,u_mm,peak_force_N\na,x,1,2\na,y,2,3\n", Some("x"));
        assert!(twice.err().unwrap().contains("name of another specimen"));
        let all = read("id,test,u_mm,peak_force_N\na,x,1,2\nb,y,2,3\n").unwrap();
        assert_eq!(all.len(), 2);
    }

    #[test]
    fn empty_cells_are_missing_quantities() {
        let found = read("id,u_mm,peak_force_N\na,-2,\nb,,11\nc,-1,12\n").unwrap();
        let missing: Vec<Vec<bool>> =
            found.iter().map(|own| own.values.iter().map(|x| x.is_nan()).collect()).collect();
        assert_eq!(missing, [[false, true], [true, false], [false, false]]);
    }

    #[test]
    fn tables_that_cannot_be_used_are_refused() {
        for (text, problem) in [
            ("id,u_mm\na,1\n", "column peak_force_N is missing"),
            ("id,u_mm,peak_force_N\na,1,2\na,1,2\n", "name of another specimen"),
            ("id,u_mm,peak_force_N\na,1,-2\nb,1,2\n", "must be positive"),
            ("id,u_mm,peak_force_N\na,1,2\n", "has 1 specimens"),
            ("id,u_mm,peak_force_N\na,1,2\nb,,\n", "b: has no quantity"),
            ("id,u_mm,peak_force_N\na,1,\nb,2,\n", "has no number for any specimen"),
            ("id,u_mm,peak_force_N\na,1,2\nb,-1,2\n", "column u_mm = 0: has a mean of zero"),
            (
                "id,u_mm,peak_force_N\na,1,2\nb,1.1,2\n",
                "column peak_force_N = 2: is the value of all 2",
            ),
        ] {
            let error = read(text).err().unwrap();
            assert!(error.contains(problem), "{error}");
        }
    }
}
