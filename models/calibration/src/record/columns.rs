//! Which column of a record is displacement, force and time, and in which unit.

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
    /// As the file names it, without its unit.
    name: String,
    pub(super) dimension: Dimension,
    /// What 1 in the file is in mm, N, s, MPa or 1.
    factor: f64,
    /// Name of the unit, or the factor that the options state.
    unit: String,
}

/// The columns that are read.
pub(super) struct Columns {
    pub(super) displacement: Column,
    pub(super) force: Column,
    pub(super) time: Option<Column>,
}

/// What a column is read as.
struct Role<'a> {
    /// Its key under `[experiments.read]`.
    key: &'static str,
    /// Words of testing machines, in English, German and French.
    words: &'static [&'static str],
    /// What it may measure, in the order of preference.
    dimensions: &'static [Dimension],
    /// The column that the options name.
    chosen: Option<&'a str>,
    unit: Option<&'a str>,
    factor: Option<f64>,
}

impl Columns {
    /// The columns of a record.
    ///
    /// # Errors
    /// No column of displacement or force, several of them, a unit that is missing, unknown or of something else.
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
        // a time that cannot be read is not needed unless the options name it
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
            found => {
                let problem = match found {
                    Some(_) => format!("has a unit that is none of a {}", self.key),
                    None => "has an unknown unit".to_owned(),
                };
                let help = format!(
                    "Known units are: {}. For another one, write {1}_factor = … under [experiments.read]: \
                     what 1 in the file is in {2}.",
                    self.units(),
                    self.key,
                    if self.dimensions[0] == Dimension::Force { "N" } else { "mm" },
                );
                Err(layout.error(file, &name, text, problem, help))
            }
        }
    }

    /// The column of a name, which may be written with its unit.
    fn named(&self, file: &Path, layout: &Layout, name: &str) -> Result<usize, InputError> {
        let is_same = |written: &str| written.trim().eq_ignore_ascii_case(name.trim());
        let place = layout.names.iter().position(|n| is_same(&n.written) || is_same(&n.name));
        place.ok_or_else(|| {
            let written = || layout.names.iter().map(|n| n.written.as_str());
            let meant = closest(name, written().filter(|name| !name.is_empty()));
            let meant = meant.map(|m| format!("Is {m:?} meant? ")).unwrap_or_default();
            let help = format!("{meant}The columns are: {}.", layout.listed());
            let key = format!("line {}, column", layout.names_line);
            InputError::new(file, key, name, "is missing", help)
        })
    }

    /// The one column whose name or unit fits.
    fn detected(&self, file: &Path, layout: &Layout) -> Result<usize, InputError> {
        let unit = |index: usize| {
            let written = layout.names[index].unit.as_deref();
            written.map(|text| Unit::named(text).map(|unit| unit.dimension))
        };
        let columns = || 0..layout.names.len();
        for &dimension in self.dimensions {
            // a column without a unit, or of an unknown one, counts by its name
            let fits = |index: &usize| match unit(*index) {
                Some(Some(own)) => own == dimension,
                None | Some(None) => dimension == self.dimensions[0],
            };
            let has_word = |i: &usize| {
                let name = layout.names[*i].name.to_lowercase();
                self.words.iter().any(|word| name.contains(word))
            };
            let found: Vec<usize> = columns().filter(fits).filter(has_word).collect();
            match found[..] {
                [] => {}
                [only] => return Ok(only),
                _ => return Err(self.ambiguous(file, layout, &found)),
            }
            let by_unit = |i: &usize| unit(*i) == Some(Some(dimension));
            let found: Vec<usize> = columns().filter(by_unit).collect();
            match found[..] {
                [] => {}
                [only] => return Ok(only),
                _ => return Err(self.ambiguous(file, layout, &found)),
            }
        }
        let help = format!(
            "Name it: {0} = \"…\" under [experiments.read]. The columns are: {1}.",
            self.key,
            layout.listed()
        );
        let place = format!("line {}", layout.names_line);
        Err(InputError::new(file, place, "", format!("no column is a {}", self.key), help))
    }

    fn ambiguous(&self, file: &Path, layout: &Layout, found: &[usize]) -> InputError {
        let names = found.iter().map(|&i| format!("{:?}", layout.names[i].written));
        let names: Vec<String> = names.collect();
        let help = format!(
            "Choose one: {} = {} under [experiments.read].",
            self.key,
            names.first().map_or("\"…\"", String::as_str)
        );
        let problem =
            format!("{} columns may be the {}: {}", found.len(), self.key, names.join(", "));
        InputError::new(file, format!("line {}", layout.names_line), "", problem, help)
    }

    fn units(&self) -> String {
        self.dimensions.iter().map(|d| d.units()).collect::<Vec<_>>().join(", ")
    }
}

impl Column {
    /// The readings in mm, N, s, MPa or 1.
    ///
    /// # Errors
    /// A cell that is no number.
    pub(super) fn read(
        &self,
        file: &Path,
        layout: &Layout,
        sheet: &Sheet,
    ) -> Result<Vec<f64>, InputError> {
        let numbers = layout.numbers(file, sheet, self.index)?;
        Ok(numbers.into_iter().map(|number| self.factor * number).collect())
    }

    /// `load in kN ("Kraft")`.
    pub(super) fn described(&self, role: &str) -> String {
        format!("{role} in {} ({:?})", self.unit, self.name)
    }
}
