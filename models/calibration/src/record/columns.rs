//! Finds the columns of a record with displacement, force and time, and their units.

use std::path::Path;

use super::header::Layout;
use super::options::ReadOptions;
use super::text::Sheet;
use super::unit::{Dimension, Unit};
use crate::error::{InputError, closest};

/// A column with readings.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    index: usize,
    /// Name in the file, without the unit.
    name: String,
    pub(super) dimension: Dimension,
    /// Factor from the unit of the file to mm, N, s, MPa or 1.
    factor: f64,
    /// Name of the unit, or a description of the factor that the options state.
    unit: String,
}

/// Columns of a record that are read.
pub(super) struct Columns {
    pub(super) displacement: Column,
    pub(super) force: Column,
    pub(super) time: Option<Column>,
}

/// Role of a column (displacement, force or time) and the criteria by which the column is found.
struct Role<'a> {
    /// Key of the role under `[experiments.read]`.
    key: &'static str,
    /// Words in column names of testing machines, in English, German and French.
    words: &'static [&'static str],
    /// Physical dimensions that the column may have, in order of preference.
    dimensions: &'static [Dimension],
    /// Name of the column that the options state.
    chosen: Option<&'a str>,
    unit: Option<&'a str>,
    factor: Option<f64>,
}

impl Columns {
    /// Finds the columns of a record.
    ///
    /// # Errors
    /// If there is no column of displacement or force, or more than one, or a unit is missing, unknown or of another
    /// dimension.
    pub(super) fn of(
        file: &Path,
        layout: &Layout,
        options: &ReadOptions,
    ) -> Result<Self, InputError> {
        let displacement = Role {
            key: "displacement",
            words: &[
                "displacement",
                "déplacement",
                "deplacement",
                "extension",
                "crosshead",
                "stroke",
                "position",
                "weg",
                "verformung",
                "deformation",
                "deflection",
                "travel",
                "strain",
                "stauchung",
                "dehnung",
            ],
            dimensions: &[Dimension::Length, Dimension::Strain],
            chosen: options.displacement.as_deref(),
            unit: options.displacement_unit.as_deref(),
            factor: options.displacement_factor,
        };
        let force = Role {
            key: "force",
            words: &["force", "load", "kraft", "last", "stress", "spannung", "contrainte"],
            dimensions: &[Dimension::Force, Dimension::Stress],
            chosen: options.force.as_deref(),
            unit: options.force_unit.as_deref(),
            factor: options.force_factor,
        };
        let time = Role {
            key: "time",
            words: &["time", "zeit", "temps"],
            dimensions: &[Dimension::Time],
            chosen: options.time.as_deref(),
            unit: options.time_unit.as_deref(),
            factor: None,
        };
        let displacement = displacement.column(file, layout)?;
        let force = force.column(file, layout)?;
        // an unreadable time column is ignored unless the options name it
        let time = match time.chosen {
            Some(_) => Some(time.column(file, layout)?),
            None => time.column(file, layout).ok(),
        };
        let has_numbers = |column: &Column| layout.is_numeric(column.index);
        let time = time.filter(|column| options.time.is_some() || has_numbers(column));
        Ok(Self { displacement, force, time })
    }
}

impl Role<'_> {
    fn column(&self, file: &Path, layout: &Layout) -> Result<Column, InputError> {
        let index = match self.chosen {
            Some(name) => self.named(file, layout, name)?,
            None => self.detected(file, layout)?,
        };
        let name = layout.names[index].name.clone();
        if let Some(factor) = self.factor {
            let unit = format!("units of {factor}");
            return Ok(Column { index, name, dimension: self.dimensions[0], factor, unit });
        }
        let written = layout.names[index].unit.as_deref();
        let Some(text) = self.unit.or(written) else {
            let help = format!(
                "Write {0}_unit = \"{1}\" under [experiments.read], or another of: {2}.",
                self.key,
                if self.dimensions[0] == Dimension::Force { "kN" } else { "mm" },
                self.units()
            );
            return Err(layout.error(file, &name, "", "has no unit", help));
        };
        match Unit::named(text) {
            Some(Unit { name: unit, dimension, factor })
                if self.dimensions.contains(&dimension) =>
            {
                Ok(Column { index, name, dimension, factor, unit })
            }
            other_unit => {
                let problem = match other_unit {
                    Some(_) => format!("has a unit that is not a unit of {}", self.key),
                    None => "has an unknown unit".to_owned(),
                };
                let help = format!(
                    "Known units are: {}. For another unit, write {1}_factor = … under [experiments.read]: \
                     the value of one unit of the file in {2}.",
                    self.units(),
                    self.key,
                    if self.dimensions[0] == Dimension::Force { "N" } else { "mm" },
                );
                Err(layout.error(file, &name, text, problem, help))
            }
        }
    }

    /// Index of the column with this name, which may include the unit.
    fn named(&self, file: &Path, layout: &Layout, name: &str) -> Result<usize, InputError> {
        let is_same = |written: &str| written.trim().eq_ignore_ascii_case(name.trim());
        let index = layout.names.iter().position(|n| is_same(&n.written) || is_same(&n.name));
        index.ok_or_else(|| {
            let written = || layout.names.iter().map(|n| n.written.as_str());
            let meant = closest(name, written().filter(|name| !name.is_empty()));
            let meant = meant.map(|m| format!("Did you mean {m:?}? ")).unwrap_or_default();
            let help = format!("{meant}The columns are: {}.", layout.listed());
            let key = format!("line {}, column", layout.names_line);
            InputError::new(file, key, name, "is missing", help)
        })
    }

    /// Index of the only column whose name or unit matches the role.
    fn detected(&self, file: &Path, layout: &Layout) -> Result<usize, InputError> {
        let unit = |index: usize| {
            let written = layout.names[index].unit.as_deref();
            written.map(|text| Unit::named(text).map(|unit| unit.dimension))
        };
        let columns = || 0..layout.names.len();
        for &dimension in self.dimensions {
            // a column with a missing or unknown unit is matched by name only, as a column of the preferred dimension
            let fits = |index: &usize| match unit(*index) {
                Some(Some(column_dimension)) => column_dimension == dimension,
                None | Some(None) => dimension == self.dimensions[0],
            };
            let has_word = |i: &usize| {
                let name = layout.names[*i].name.to_lowercase();
                self.words.iter().any(|word| name.contains(word))
            };
            let matches: Vec<usize> = columns().filter(fits).filter(has_word).collect();
            match matches[..] {
                [] => {}
                [only] => return Ok(only),
                _ => return Err(self.ambiguous(file, layout, &matches)),
            }
            let by_unit = |i: &usize| unit(*i) == Some(Some(dimension));
            let matches: Vec<usize> = columns().filter(by_unit).collect();
            match matches[..] {
                [] => {}
                [only] => return Ok(only),
                _ => return Err(self.ambiguous(file, layout, &matches)),
            }
        }
        let help = format!(
            "State the column: {0} = \"…\" under [experiments.read]. The columns are: {1}.",
            self.key,
            layout.listed()
        );
        let location = format!("line {}", layout.names_line);
        Err(InputError::new(file, location, "", format!("no column is a {}", self.key), help))
    }

    fn ambiguous(&self, file: &Path, layout: &Layout, matches: &[usize]) -> InputError {
        let names = matches.iter().map(|&i| format!("{:?}", layout.names[i].written));
        let names: Vec<String> = names.collect();
        let help = format!(
            "Choose one: {} = {} under [experiments.read].",
            self.key,
            names.first().map_or("\"…\"", String::as_str)
        );
        let problem =
            format!("{} columns may contain the {}: {}", matches.len(), self.key, names.join(", "));
        InputError::new(file, format!("line {}", layout.names_line), "", problem, help)
    }

    fn units(&self) -> String {
        self.dimensions.iter().map(|d| d.units()).collect::<Vec<_>>().join(", ")
    }
}

impl Column {
    /// Reads the column in mm, N, s, MPa or 1.
    ///
    /// # Errors
    /// If a cell is not a number.
    pub(super) fn read(
        &self,
        file: &Path,
        layout: &Layout,
        sheet: &Sheet,
    ) -> Result<Vec<f64>, InputError> {
        let numbers = layout.numbers(file, sheet, self.index)?;
        Ok(numbers.into_iter().map(|number| self.factor * number).collect())
    }

    /// Description of the column, such as `load in kN ("Kraft")`.
    pub(super) fn described(&self, role: &str) -> String {
        format!("{role} in {} ({:?})", self.unit, self.name)
    }
}
