//! Plasticity of a region: `[material.<region>] plastic.…`.

use std::path::{Path, PathBuf};

use fem::{Hardening, HardeningPoint, PlasticRate, Plasticity, YieldCriterion};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::InputError;
use crate::table::CsvTable;

/// Key of the table of yield stresses of a region.
pub(super) fn hardening_key(region: &str) -> String {
    format!("material.{region}.plastic.hardening.table")
}

/// `plastic.…` of a region.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlasticCase {
    /// Yield criterion: `"j2"`, or `{ drucker-prager = { friction_deg, dilatancy_deg } }`.
    #[serde(default)]
    pub criterion: YieldCriterion,
    /// Initial yield stress in MPa; with the criterion of Drucker and Prager, the initial cohesion.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1e6))]
    pub yield_mpa: f64,
    /// Hardening.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hardening: Option<HardeningCase>,
    /// Dependence of the yield stress on the rate.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<PlasticRate>,
}

/// Hardening as written in a case: a formula, or the name of a table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum HardeningCase {
    /// h α.
    #[serde(rename_all = "snake_case")]
    Linear {
        /// h in MPa.
        #[schemars(range(min = 0))]
        modulus_mpa: f64,
    },
    /// A (1 − e^(−b α)).
    #[serde(rename_all = "snake_case")]
    Voce {
        /// A in MPa.
        #[schemars(range(min = 0))]
        saturation_mpa: f64,
        /// b, dimensionless.
        #[schemars(extend("exclusiveMinimum" = 0))]
        rate: f64,
    },
    /// k ((e₀ + α)ⁿ − e₀ⁿ).
    #[serde(rename_all = "snake_case")]
    Swift {
        /// k in MPa.
        #[schemars(range(min = 0))]
        factor_mpa: f64,
        /// e₀, a positive strain.
        #[schemars(extend("exclusiveMinimum" = 0))]
        offset: f64,
        /// n, in (0, 1].
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
        exponent: f64,
    },
    /// A table of yield stresses.
    Table(HardeningTable),
}

/// A table of yield stresses: the name of a CSV file with the columns `plastic_strain,yield_mpa`. When the case is read,
/// the rows of the file replace the name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum HardeningTable {
    /// Path, relative to the folder of the case.
    File(PathBuf),
    /// The rows of the file.
    Rows(Vec<YieldRow>),
}

/// Row of a table of yield stresses.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct YieldRow {
    /// Equivalent plastic strain.
    pub plastic_strain: f64,
    /// Yield stress in MPa.
    pub yield_mpa: f64,
}

impl PlasticCase {
    /// Converts to the plasticity of `fem`. The yield stress of the first row of a table is subtracted from all rows, so
    /// that `yield_mpa` remains the initial yield stress.
    pub(crate) fn in_fem(&self) -> Plasticity {
        let hardening = match &self.hardening {
            None => Hardening::None,
            Some(HardeningCase::Linear { modulus_mpa }) => {
                Hardening::Linear { modulus_mpa: *modulus_mpa }
            }
            Some(HardeningCase::Voce { saturation_mpa, rate }) => {
                Hardening::Voce { saturation_mpa: *saturation_mpa, rate: *rate }
            }
            Some(HardeningCase::Swift { factor_mpa, offset, exponent }) => {
                let (factor_mpa, offset, exponent) = (*factor_mpa, *offset, *exponent);
                Hardening::Swift { factor_mpa, offset, exponent }
            }
            // a file that could not be read is reported when the case is read
            Some(HardeningCase::Table(HardeningTable::File(_))) => Hardening::None,
            Some(HardeningCase::Table(HardeningTable::Rows(rows))) => {
                let first = rows.first().map_or(0.0, |row| row.yield_mpa);
                let point = |row: &YieldRow| HardeningPoint {
                    plastic_strain: row.plastic_strain,
                    hardening_mpa: row.yield_mpa - first,
                };
                Hardening::Table(rows.iter().map(point).collect())
            }
        };
        let Self { criterion, yield_mpa, rate, .. } = *self;
        Plasticity { criterion, yield_mpa, hardening, rate }
    }

    /// Returns the name of the table of yield stresses that is not read yet.
    pub(super) fn table(&self) -> Option<&Path> {
        match &self.hardening {
            Some(HardeningCase::Table(HardeningTable::File(path))) => Some(path),
            _ => None,
        }
    }

    /// Replaces the name of the table by its rows. `path` is the path of the file.
    ///
    /// # Errors
    /// The reason and the remedy, if the file cannot be read or its first yield stress is not `yield_mpa`.
    pub(super) fn read_table(&mut self, path: &Path) -> Result<(), [String; 2]> {
        let rows = read_rows(path)?;
        let first = rows.first().copied();
        let first =
            first.filter(|row| row.plastic_strain == 0.0 && row.yield_mpa == self.yield_mpa);
        if first.is_none() {
            return Err([
                "does not begin with the plastic strain 0 and the yield stress yield_mpa".into(),
                format!("Begin it with the row 0,{}.", self.yield_mpa),
            ]);
        }
        self.hardening = Some(HardeningCase::Table(HardeningTable::Rows(rows)));
        Ok(())
    }
}

/// Reads the rows of a table of yield stresses.
///
/// # Errors
/// The reason, with line, column and value, and the remedy.
fn read_rows(path: &Path) -> Result<Vec<YieldRow>, [String; 2]> {
    let refused = |error: InputError| {
        let InputError { place, value, problem, help, .. } = error;
        let located = match (place.is_empty(), value.is_empty()) {
            (true, _) => String::new(),
            (false, true) => format!("{place}: "),
            (false, false) => format!("{place} = {value}: "),
        };
        [format!("{located}{problem}"), help.into()]
    };
    let [strain, stress] = ["plastic_strain", "yield_mpa"];
    let table = CsvTable::read(path, &[strain, stress]).map_err(refused)?;
    let mut rows: Vec<YieldRow> = Vec::new();
    for row in table.rows() {
        let number = |column| row.number(column).map_err(refused);
        let (plastic_strain, yield_mpa) = (number(strain)?, number(stress)?);
        if rows.last().is_some_and(|last| plastic_strain <= last.plastic_strain) {
            let help = "List the plastic strains in increasing order, each once.";
            let problem = "must be larger than the plastic strain of the row before it";
            return Err(refused(row.error(strain, problem, help)));
        }
        rows.push(YieldRow { plastic_strain, yield_mpa });
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plastic(text: &str) -> PlasticCase {
        toml::from_str(text).expect("valid")
    }

    #[test]
    fn a_table_of_yield_stresses_is_read_beside_the_case() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("hardening.csv");
        std::fs::write(&path, "plastic_strain, yield_mpa\n0, 200\n0.1, 250\n0.5, 300\n").unwrap();
        let mut case = plastic("yield_mpa = 200.0\nhardening = { table = \"hardening.csv\" }");
        assert_eq!(case.table(), Some(Path::new("hardening.csv")));
        case.read_table(&path).unwrap();
        let Hardening::Table(points) = case.in_fem().hardening else { panic!("no table") };
        let stresses: Vec<f64> = points.iter().map(|p| p.hardening_mpa).collect();
        assert_eq!(stresses, [0.0, 50.0, 100.0]);
        // the written case contains the rows of the table instead of the file name
        let again: PlasticCase = toml::from_str(&toml::to_string(&case).unwrap()).unwrap();
        assert_eq!(again, case);
    }

    #[test]
    fn a_table_that_does_not_begin_at_the_yield_stress_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("hardening.csv");
        let mut case = plastic("yield_mpa = 200.0\nhardening = { table = \"hardening.csv\" }");
        assert!(case.read_table(&path).unwrap_err()[0].contains("cannot be read"));
        for (text, part) in [
            ("plastic_strain,yield_mpa\n0,210\n", "does not begin"),
            ("plastic_strain,yield_mpa\n", "does not begin"),
            ("a,b\n1,2\n", "plastic_strain"),
            (
                "plastic_strain,yield_mpa\n0,200\n0.1,soft\n",
                "line 3, column yield_mpa = soft: is not",
            ),
            ("plastic_strain,yield_mpa\n0,200\n0.1\n", "line 3"),
            (
                "plastic_strain,yield_mpa\n0,200\n0.1,250\n0.05,260\n",
                "line 4, column plastic_strain = 0.05: must be larger",
            ),
        ] {
            std::fs::write(&path, text).unwrap();
            let [problem, help] = case.read_table(&path).unwrap_err();
            assert!(problem.contains(part) && !help.is_empty(), "{text}: {problem}");
        }
    }
}
