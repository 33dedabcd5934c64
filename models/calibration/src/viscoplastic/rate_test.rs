//! Yield stresses at several strain rates.

use std::path::Path;

use crate::error::InputError;
use crate::table::{CsvTable, TableRow};
use crate::tension::MPA_PER_KSI;

/// Yield stress of one specimen at one strain rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateTest {
    /// Engineering strain rate in 1/s.
    pub rate_per_s: f64,
    /// Yield stress at 0.2 % of plastic strain in MPa.
    pub yield_mpa: f64,
}

/// Reads a table with the columns `engineering_strain_rate_per_s,yield_ksi`, one line per specimen. Stresses are
/// converted to MPa.
///
/// # Errors
/// If a value is missing or not positive, or the table has no line. The error names line, column and value.
pub fn read_rate_tests(file: &Path) -> Result<Vec<RateTest>, InputError> {
    let (rate, stress) = ("engineering_strain_rate_per_s", "yield_ksi");
    let table = CsvTable::read(file, &[rate, stress])?;
    let test = |row: TableRow<'_>| -> Result<RateTest, InputError> {
        let rate_per_s = row.positive(rate)?;
        Ok(RateTest { rate_per_s, yield_mpa: MPA_PER_KSI * row.positive(stress)? })
    };
    let tests = table.rows().map(test).collect::<Result<Vec<_>, InputError>>()?;
    match tests.len() {
        0 => Err(InputError::new(file, "", "", "has no tests", "Write one line for each test.")),
        _ => Ok(tests),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with the means at the five rates, 36.3, 40.3, 52.4, 58.1 and 60.5 ksi, which were computed independently.
    #[test]
    fn the_64_tests_have_their_means() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../../models/data/matcal_304L_rate_yield.csv");
        let tests = read_rate_tests(&file).unwrap();
        assert_eq!(tests.len(), 64);
        for (rate_per_s, ksi) in
            [(1e-4, 36.3), (1e-2, 40.3), (500.0, 52.4), (1800.0, 58.1), (3600.0, 60.5)]
        {
            let at_rate: Vec<f64> = tests
                .iter()
                .filter(|test| test.rate_per_s == rate_per_s)
                .map(|test| test.yield_mpa / 6.894_757)
                .collect();
            let mean = at_rate.iter().sum::<f64>() / at_rate.len() as f64;
            assert!((mean - ksi).abs() < 0.05, "{rate_per_s} 1/s: {mean} ksi");
        }
    }

    #[test]
    fn mistakes_in_a_file_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("rates.csv");
        let message = |text: &str| {
            std::fs::write(&file, text).unwrap();
            read_rate_tests(&file).unwrap_err().to_string()
        };
        let header = "engineering_strain_rate_per_s,yield_ksi\n";
        for (text, expected) in [
            ("rate,yield_ksi\n1,2\n".to_owned(), "engineering_strain_rate_per_s is missing"),
            (format!("{header}0,40\n"), "line 2, column engineering_strain_rate_per_s = 0"),
            (format!("{header}1,-40\n"), "line 2, column yield_ksi = -40"),
            (header.to_owned(), "has no tests"),
        ] {
            let error = message(&text);
            assert!(error.contains(expected), "{error}");
        }
    }
}
