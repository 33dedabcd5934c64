//! Specimens that two cases use: held-out specimens that were calibrated, and specimens of two tests that count twice.

use std::path::PathBuf;

use super::measured_values::read_measured;
use crate::case::{CaseFile, SingleTest};
use crate::error::InputError;
use crate::experiment::Specimen;
use crate::same_test::SameTest;
use crate::specimen_files::SpecimenFiles;

/// Advice if a specimen belongs to two tests.
const ONE_TEST: &str = "The specimen would count twice, and the intervals would be too narrow. Give each specimen to one test \
                        (column test of the table, experiments.group), or remove its line from one of the tables.";

/// A specimen whose data two cases use.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct CommonSpecimen {
    /// Table of the second case.
    pub(crate) table: PathBuf,
    /// Name of the specimen in the second case.
    pub(crate) id: String,
    /// Name of the specimen in the first case.
    pub(crate) other: String,
}

/// Returns the first specimen of `second` that `first` uses, too: a specimen with the readings of the same test, or with the
/// same name and the same measured quantities.
pub(crate) fn common_specimen(first: &CaseFile, second: &CaseFile) -> Option<CommonSpecimen> {
    common_curve(first, second).or_else(|| common_row(first, second))
}

/// Refuses specimens that belong to two tests of a joint calibration.
///
/// # Errors
/// Names the table of the second test and the specimen.
pub(crate) fn refuse_counted_twice(tests: &[SingleTest]) -> Result<(), InputError> {
    for (k, second) in tests.iter().enumerate() {
        for first in &tests[..k] {
            let Some(common) = common_specimen(&first.file, &second.file) else { continue };
            let CommonSpecimen { table, id, other } = common;
            let problem = format!(
                "is a specimen of the test {}, and has the data of {other} of the test {}",
                second.name, first.name
            );
            return Err(InputError::new(&table, "specimen", id, problem, ONE_TEST));
        }
    }
    Ok(())
}

fn common_curve(first: &CaseFile, second: &CaseFile) -> Option<CommonSpecimen> {
    let ((_, earlier), (table, specimens)) = (measured(first)?, measured(second)?);
    specimens.iter().find_map(|specimen| {
        let is_same = |other: &&Specimen| SameTest::of(&other.curve, &specimen.curve).is_some();
        let other = earlier.iter().find(is_same)?;
        Some(CommonSpecimen {
            table: table.clone(),
            id: specimen.id.clone(),
            other: other.id.clone(),
        })
    })
}

fn common_row(first: &CaseFile, second: &CaseFile) -> Option<CommonSpecimen> {
    let quantities = second.case.compared_quantities();
    let values = |file: &CaseFile| {
        let path = file.beside(file.case.experiments.as_ref()?.values.as_ref()?);
        // tables of other quantities cannot be compared
        let experiments = file.case.experiments.as_ref()?;
        let rows = read_measured(&path, &quantities, experiments.test.as_deref()).ok()?;
        let group = experiments.group.clone();
        let is_chosen = move |specimen_group: &str| {
            group.as_deref().is_none_or(|group| group == specimen_group)
        };
        let rows = rows.into_iter().filter(move |row| is_chosen(&row.group));
        Some((path, rows.collect::<Vec<_>>()))
    };
    let ((_, earlier), (table, rows)) = (values(first)?, values(second)?);
    let row = rows.iter().find(|row| {
        // two missing values (NaN) are the same
        let is_equal = |(a, b): (&f64, &f64)| a == b || (a.is_nan() && b.is_nan());
        let has_values = |values: &[f64]| values.iter().zip(&row.values).all(is_equal);
        earlier.iter().any(|other| other.id == row.id && has_values(&other.values))
    })?;
    Some(CommonSpecimen { table, id: row.id.clone(), other: row.id.clone() })
}

/// The table of measured specimens of a case, and the specimens that the case chooses. `None` if the case has no such table,
/// or if the table has mistakes, which the checks of the case report.
fn measured(file: &CaseFile) -> Option<(PathBuf, Vec<Specimen>)> {
    let experiments = file.case.experiments.as_ref()?;
    let path = file.beside(experiments.table.as_ref()?);
    if !path.is_file() {
        return None;
    }
    let options = experiments.read.clone().unwrap_or_default();
    let read = SpecimenFiles::read(&path, &options).of_test(experiments.test.as_deref(), &path);
    let table = match &experiments.group {
        Some(group) => read.table.in_group(group, &file.path).ok()?,
        None => read.table,
    };
    Some((path, table.specimens))
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::case::single_tests;

    /// A curve of 40 readings with all digits; `scale` distinguishes specimens.
    fn curve(scale: f64) -> String {
        let reading = |i: u32| {
            let u = 0.005 * f64::from(i);
            format!("{u},{}\n", scale * 900.0 * u * (1.0 - u / 0.3))
        };
        "displacement_mm,force_N\n".to_owned() + &(1..=40).map(reading).collect::<String>()
    }

    /// Writes tables of two specimens each; the tables have the given scales of the curves.
    fn folder(scales: [[f64; 2]; 2]) -> tempfile::TempDir {
        let dir = tempfile::tempdir().unwrap();
        for (k, scales) in scales.into_iter().enumerate() {
            let test = dir.path().join(k.to_string());
            std::fs::create_dir_all(test.join("curves")).unwrap();
            let mut table = "id,height_mm,radius_mm,group\n".to_owned();
            for (i, scale) in scales.into_iter().enumerate() {
                table += &format!("S-{k}{i},4.4,2.5,\n");
                std::fs::write(test.join(format!("curves/S-{k}{i}.csv")), curve(scale)).unwrap();
            }
            std::fs::write(test.join("specimens.csv"), table).unwrap();
        }
        dir
    }

    /// A material that is simulated.
    const SIMULATED: &str = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 1.4\n\
        [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\ndisplacement_mm = 0.2\n\
        [prior]\nmatrix.young_mpa = [250.0, 300.0]\n";
    /// A program of the user, whose quantities are measured too.
    const OUTSIDE: &str = "[simulator]\ncommand = [\"sh\", \"solver.sh\", \"{k1}\"]\n\
        [parameters]\nk1 = { unit = \"MPa\", prior = [1.0, 2.0] }\n\
        [qoi]\nquantities = [\"slope\", \"peak-force\", \"displacement-at-peak\"]\n[experiments]\n";

    fn refused(dir: &Path, source: &str, keys: [&str; 2]) -> Option<String> {
        let [fast, slow] = keys;
        let text = format!(
            "{source}[[tests]]\nname = \"fast\"\nset.experiments = {{ {fast} }}\n\
             [[tests]]\nname = \"slow\"\nset.experiments = {{ {slow} }}\nset.design.seed = 2\n"
        );
        let path = dir.join("case.toml");
        let (file, mistakes) = CaseFile::parse_all(&text, &path);
        assert_eq!(mistakes.iter().map(ToString::to_string).collect::<Vec<_>>(), [""; 0]);
        refuse_counted_twice(&single_tests(&file.unwrap()).unwrap())
            .err()
            .map(|mistake| mistake.to_string())
    }

    /// The second table has a specimen of the first table under another name.
    #[test]
    fn a_specimen_of_two_tests_is_refused() {
        let tables = ["table = \"0/specimens.csv\"", "table = \"1/specimens.csv\""];
        let dir = folder([[1.0, 1.1], [0.7, 0.8]]);
        assert_eq!(refused(dir.path(), SIMULATED, tables), None);
        let refused_table = refused(dir.path(), SIMULATED, [tables[0]; 2]).unwrap();
        assert!(refused_table.contains("of the test slow"), "{refused_table}");
        let dir = folder([[1.0, 1.1], [0.7, 1.1]]);
        let mistake = refused(dir.path(), SIMULATED, tables).unwrap();
        for part in ["1/specimens.csv", "S-11", "S-01 of the test fast", "count twice"] {
            assert!(mistake.contains(part), "{part}: {mistake}");
        }
    }

    /// Rows of measured quantities are the same specimen if name and values are equal.
    #[test]
    fn a_row_of_values_in_two_tests_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let write = |name: &str, rows: &str| {
            let header = "id,slope_N_per_mm,peak_force_N,displacement_at_peak_mm\n";
            std::fs::write(dir.path().join(name), format!("{header}{rows}")).unwrap();
        };
        write("a.csv", "A,2600.5,120.25,0.101\nB,2500.5,121.25,0.102\n");
        write("b.csv", "B,2700.5,130.25,0.103\nC,2500.5,121.25,0.102\n");
        write("c.csv", "B,2500.5,121.25,0.102\nD,2700.5,130.25,0.103\n");
        let values = |name: &str| format!("values = \"{name}\"");
        let of = |second: &str| refused(dir.path(), OUTSIDE, [&values("a.csv"), &values(second)]);
        assert_eq!(of("b.csv"), None);
        let mistake = of("c.csv").unwrap();
        assert!(mistake.contains("c.csv") && mistake.contains("B of the test fast"), "{mistake}");
    }
}
