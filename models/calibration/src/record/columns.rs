//! Finds the columns of a record with displacement, force and time, and their units.

use std::path::Path;

use super::header::{Layout, name_and_unit};
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
    /// Whether the cells are clock times.
    is_clock: bool,
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
    /// Name of the column in a plain file. A column with exactly this name is preferred to all other columns.
    plain: &'static str,
    /// Words in column names of testing machines, in English, German and French.
    words: &'static [&'static str],
    /// Physical dimensions that the column may have, in order of preference.
    dimensions: &'static [Dimension],
    /// Name of the column that the options state.
    chosen: Option<&'a str>,
    unit: Option<&'a str>,
    factor: Option<f64>,
}

/// Words in names of columns of times, in English, German and French.
const TIME_WORDS: &[&str] =
    &["time", "zeit", "temps", "second", "sekunde", "seconde", "elapsed", "minutes", "minuten"];

/// Whether a name is an abbreviation of time without a further word.
fn is_time_name(name: &str) -> bool {
    matches!(name, "t" | "sec" | "Sec" | "secs" | "Sek" | "sek")
}

fn is_time_unit(name: &&str) -> bool {
    Unit::named(name).is_some_and(|unit| unit.dimension == Dimension::Time)
}

/// Whether the unit of clock times with two parts is hours and minutes, as in `hh:mm`.
fn are_hours_and_minutes(unit: Option<&str>) -> bool {
    let bare = unit.unwrap_or_default().trim_matches(['(', '[', ')', ']', ' ']).to_lowercase();
    bare.starts_with('h') && bare.matches(':').count() == 1
}

/// Whether the name of a column, with or without a unit, is the name of a column of times.
pub(crate) fn is_time_column(written: &str) -> bool {
    let (name, unit) = name_and_unit(written);
    let has_word = TIME_WORDS.iter().any(|word| name.to_lowercase().contains(word));
    let dimension = unit.as_deref().and_then(Unit::named).map(|unit| unit.dimension);
    match dimension {
        Some(dimension) => dimension == Dimension::Time,
        None => has_word || is_time_name(&name),
    }
}

impl Columns {
    /// Finds the columns of a record.
    ///
    /// # Errors
    /// If there is no column of displacement or force, or more than one column of a kind, or a unit is missing, unknown or
    /// of another dimension.
    pub(super) fn of(
        file: &Path,
        layout: &Layout,
        options: &ReadOptions,
    ) -> Result<Self, InputError> {
        let displacement = Role {
            key: "displacement",
            plain: "displacement_mm",
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
            plain: "force_N",
            words: &["force", "load", "kraft", "last", "stress", "spannung", "contrainte"],
            dimensions: &[Dimension::Force, Dimension::Stress],
            chosen: options.force.as_deref(),
            unit: options.force_unit.as_deref(),
            factor: options.force_factor,
        };
        let time = Role {
            key: "time",
            plain: "time_s",
            words: TIME_WORDS,
            dimensions: &[Dimension::Time],
            chosen: options.time.as_deref(),
            unit: options.time_unit.as_deref(),
            factor: None,
        };
        let displacement = displacement.column(file, layout)?;
        let force = force.column(file, layout)?;
        let time = match time.chosen {
            Some(name) if name.trim().is_empty() => None,
            Some(_) => Some(time.column(file, layout)?),
            None => {
                time.detected(file, layout)?.map(|i| time.in_unit(file, layout, i)).transpose()?
            }
        };
        Ok(Self { displacement, force, time })
    }
}

impl Role<'_> {
    fn column(&self, file: &Path, layout: &Layout) -> Result<Column, InputError> {
        let index = match self.chosen {
            Some(name) => self.named(file, layout, name)?,
            None => self.detected(file, layout)?.ok_or_else(|| self.missing(file, layout))?,
        };
        self.in_unit(file, layout, index)
    }

    /// The column with its unit.
    fn in_unit(&self, file: &Path, layout: &Layout, index: usize) -> Result<Column, InputError> {
        let name = layout.names[index].name.clone();
        let (dimension, written) = (self.dimensions[0], layout.names[index].unit.as_deref());
        if let Some(factor) = self.factor {
            let unit = format!("units of {factor}");
            return Ok(Column { index, name, dimension, factor, unit, is_clock: false });
        }
        if dimension == Dimension::Time && layout.is_clock(index) {
            let unit = match are_hours_and_minutes(self.unit.or(written)) {
                true => "hh:mm",
                false => "mm:ss or hh:mm:ss",
            };
            let unit = unit.to_owned();
            return Ok(Column { index, name, dimension, factor: 1.0, unit, is_clock: true });
        }
        let no_time = match dimension {
            Dimension::Time => " To read no time, write time = \"\".",
            _ => "",
        };
        // a column of times may have the name of its unit, such as Seconds
        let by_name =
            || (dimension == Dimension::Time).then_some(name.as_str()).filter(is_time_unit);
        let Some(text) = self.unit.or(written).or_else(by_name) else {
            let help = format!(
                "Write {0}_unit = \"{1}\" under [experiments.read], or another of: {2}.{no_time}",
                self.key,
                match dimension {
                    Dimension::Force => "kN",
                    Dimension::Time => "s",
                    _ => "mm",
                },
                self.units()
            );
            return Err(layout.error(file, &name, "", "has no unit", help));
        };
        match Unit::named(text) {
            Some(Unit { name: unit, dimension, factor })
                if self.dimensions.contains(&dimension) =>
            {
                Ok(Column { index, name, dimension, factor, unit, is_clock: false })
            }
            other_unit => {
                let problem = match other_unit {
                    Some(_) => format!("has a unit that is not a unit of {}", self.key),
                    None => "has an unknown unit".to_owned(),
                };
                let base = if dimension == Dimension::Force { "N" } else { "mm" };
                let other = match dimension {
                    Dimension::Time => {
                        format!(
                            "Write time_unit = \"s\" under [experiments.read], or another.{no_time}"
                        )
                    }
                    _ => format!(
                        "For another unit, write {}_factor = … under [experiments.read]: the value of one unit of the \
                         file in {base}.",
                        self.key
                    ),
                };
                let help = format!("Known units are: {}. {other}", self.units());
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

    /// Index of the only column whose name or unit matches the role; `None` if no column matches.
    fn detected(&self, file: &Path, layout: &Layout) -> Result<Option<usize>, InputError> {
        if let Some(index) = layout.names.iter().position(|name| name.written == self.plain) {
            return Ok(Some(index));
        }
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
                let name = &layout.names[*i].name;
                let is_time = dimension == Dimension::Time && is_time_name(name);
                is_time || self.words.iter().any(|word| name.to_lowercase().contains(word))
            };
            let matches: Vec<usize> = columns().filter(fits).filter(has_word).collect();
            match matches[..] {
                [] => {}
                [only] => return Ok(Some(only)),
                _ => return Err(self.ambiguous(file, layout, &matches)),
            }
            let by_unit = |i: &usize| unit(*i) == Some(Some(dimension));
            let matches: Vec<usize> = columns().filter(by_unit).collect();
            match matches[..] {
                [] => {}
                [only] => return Ok(Some(only)),
                _ => return Err(self.ambiguous(file, layout, &matches)),
            }
        }
        Ok(None)
    }

    fn missing(&self, file: &Path, layout: &Layout) -> InputError {
        let help = format!(
            "State the column: {0} = \"…\" under [experiments.read]. The columns are: {1}.",
            self.key,
            layout.listed()
        );
        let location = format!("line {}", layout.names_line);
        InputError::new(file, location, "", format!("no column is a {}", self.key), help)
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
        if self.is_clock {
            let are_hours = self.unit == "hh:mm";
            return layout.clock_times(file, sheet, self.index, are_hours);
        }
        let values = layout.column_values(file, sheet, self.index).map_err(|error| match self.dimension {
            Dimension::Time => InputError {
                help: "Times are numbers, mm:ss or hh:mm:ss. Name another column with time = \"…\" and its unit with \
                       time_unit = \"…\", or write time = \"\" to read no time, under [experiments.read]."
                    .into(),
                ..error
            },
            _ => error,
        })?;
        Ok(values.into_iter().map(|value| self.factor * value).collect())
    }

    /// Description of the column, such as `load in kN ("Kraft")`.
    pub(super) fn described(&self, role: &str) -> String {
        format!("{role} in {} ({:?})", self.unit, self.name)
    }
}
