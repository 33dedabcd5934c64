//! Runs of a computer model: bounded inputs, outputs, where they came from.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::error::SurrogateError;

/// A named input with the interval in which it is studied.
///
/// Units are the user's: put them in the name (`young_mpa`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Input {
    /// Name, with its unit.
    pub name: String,
    /// Lower bound.
    pub lower: f64,
    /// Upper bound.
    pub upper: f64,
}

impl Input {
    /// Names an interval.
    ///
    /// # Errors
    /// A name that cannot head a column; bounds that are not finite and increasing.
    ///
    /// ```
    /// let young = surrogate::Input::new("young_mpa", 250.0, 300.0)?;
    /// assert!(surrogate::Input::new("young_mpa", 300.0, 250.0).is_err());
    /// # Ok::<(), surrogate::SurrogateError>(())
    /// ```
    pub fn new(name: impl Into<String>, lower: f64, upper: f64) -> Result<Self, SurrogateError> {
        let input = Self { name: name.into(), lower, upper };
        input.check()?;
        Ok(input)
    }

    /// The test of [`Input::new`], for inputs that were built field by field.
    pub(crate) fn check(&self) -> Result<(), SurrogateError> {
        check_name(&self.name)?;
        let width = self.upper - self.lower;
        if width.is_finite() && width > 0.0 {
            Ok(())
        } else {
            Err(SurrogateError::Bounds {
                input: self.name.clone(),
                lower: self.lower,
                upper: self.upper,
            })
        }
    }

    /// Whether `x` lies in the closed interval; NaN does not.
    #[inline]
    pub fn contains(&self, x: f64) -> bool {
        self.lower <= x && x <= self.upper
    }
}

/// Runs of a computer model: `n` rows of named bounded inputs and named outputs.
///
/// Every row is finite and inside the bounds, since nothing else can be added. Beside its numbers a row
/// may have notes, such as the number of the run: columns of text that mean nothing to a fit.
/// [`Dataset::write_csv`] keeps all of it as one file that other tools read.
///
/// ```
/// use surrogate::{Dataset, Input};
/// let inputs = vec![Input::new("young_mpa", 250.0, 300.0)?];
/// let mut runs = Dataset::new(inputs, vec!["force_n".into()], "by hand")?;
/// runs.push(&[275.0], &[147.1])?;
/// assert!(runs.push(&[310.0], &[150.0]).is_err());
/// assert_eq!(runs.len(), 1);
/// # Ok::<(), surrogate::SurrogateError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Dataset {
    inputs: Vec<Input>,
    outputs: Vec<String>,
    provenance: String,
    notes: Vec<String>,
    x: Vec<f64>,
    y: Vec<f64>,
    /// One text a row and note.
    noted: Vec<String>,
}

impl Dataset {
    /// An empty dataset with its columns declared; `provenance` is free text, possibly of several lines.
    ///
    /// # Errors
    /// No input, no output, a bad or repeated name, bad bounds.
    pub fn new(
        inputs: Vec<Input>,
        outputs: Vec<String>,
        provenance: impl Into<String>,
    ) -> Result<Self, SurrogateError> {
        for (what, found) in
            [("inputs, at least", inputs.len()), ("outputs, at least", outputs.len())]
        {
            if found == 0 {
                return Err(SurrogateError::Count { what, expected: 1, found });
            }
        }
        for input in &inputs {
            input.check()?;
        }
        for output in &outputs {
            check_name(output)?;
        }
        check_distinct(inputs.iter().map(|i| &i.name).chain(&outputs))?;
        // one kind of line break, so that the text survives the file
        let provenance: String = provenance.into().replace("\r\n", "\n").replace('\r', "\n");
        let (notes, noted) = (Vec::new(), Vec::new());
        Ok(Self { inputs, outputs, provenance, notes, x: Vec::new(), y: Vec::new(), noted })
    }

    /// The dataset with further columns of text; rows that are there already have them empty.
    ///
    /// # Errors
    /// A bad or repeated name.
    ///
    /// ```
    /// # use surrogate::{Dataset, Input};
    /// let inputs = vec![Input::new("young_mpa", 250.0, 300.0)?];
    /// let mut runs = Dataset::new(inputs, vec!["force_n".into()], "")?.with_notes(&["run"])?;
    /// runs.push_noted(&[275.0], &[147.1], &["17"])?;
    /// assert_eq!(runs.note(0, "run"), Some("17"));
    /// # Ok::<(), surrogate::SurrogateError>(())
    /// ```
    pub fn with_notes(mut self, names: &[&str]) -> Result<Self, SurrogateError> {
        self.notes = names.iter().map(|name| (*name).to_owned()).collect();
        for name in &self.notes {
            check_name(name)?;
        }
        check_distinct(self.columns())?;
        self.noted = vec![String::new(); self.len() * names.len()];
        Ok(self)
    }

    /// Adds a row: `x` in the order of the inputs, `y` in that of the outputs.
    ///
    /// # Errors
    /// A wrong number of values, a value that is not finite, an input outside its bounds.
    pub fn push(&mut self, x: &[f64], y: &[f64]) -> Result<(), SurrogateError> {
        self.push_noted(x, y, &vec![""; self.notes.len()])
    }

    /// Adds a row with its notes, in their order.
    ///
    /// # Errors
    /// As [`Self::push`].
    pub fn push_noted(
        &mut self,
        x: &[f64],
        y: &[f64],
        notes: &[&str],
    ) -> Result<(), SurrogateError> {
        check_count("notes", self.notes.len(), notes.len())?;
        check_count("input values", self.inputs.len(), x.len())?;
        check_count("output values", self.outputs.len(), y.len())?;
        let names = self.inputs.iter().map(|i| &i.name).chain(&self.outputs);
        for (column, &value) in names.zip(x.iter().chain(y)) {
            if !value.is_finite() {
                return Err(SurrogateError::NotFinite { column: column.clone(), value });
            }
        }
        for (input, &value) in self.inputs.iter().zip(x) {
            if !input.contains(value) {
                return Err(SurrogateError::OutsideBounds {
                    column: input.name.clone(),
                    value,
                    lower: input.lower,
                    upper: input.upper,
                });
            }
        }
        self.x.extend_from_slice(x);
        self.y.extend_from_slice(y);
        self.noted.extend(notes.iter().map(|note| (*note).to_owned()));
        Ok(())
    }

    /// The inputs.
    pub fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    /// The outputs' names.
    pub fn outputs(&self) -> &[String] {
        &self.outputs
    }

    /// The names of the notes.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// What row `i`, counted from 0, has under the note `name`.
    pub fn note(&self, i: usize, name: &str) -> Option<&str> {
        let place = self.notes.iter().position(|note| note == name)?;
        self.noted.get(i * self.notes.len() + place).map(String::as_str)
    }

    /// The names of all columns: inputs, outputs, notes.
    pub(crate) fn columns(&self) -> impl Iterator<Item = &String> {
        self.inputs.iter().map(|i| &i.name).chain(&self.outputs).chain(&self.notes)
    }

    /// Where the rows came from.
    pub fn provenance(&self) -> &str {
        &self.provenance
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.x.len() / self.inputs.len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// The inputs and the outputs of row `i`, counted from 0.
    ///
    /// # Panics
    /// If there is no such row, as for a slice.
    pub fn row(&self, i: usize) -> (&[f64], &[f64]) {
        let (d, m) = (self.inputs.len(), self.outputs.len());
        (&self.x[i * d..(i + 1) * d], &self.y[i * m..(i + 1) * m])
    }

    /// All rows in the order in which they were added.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = (&[f64], &[f64])> {
        (0..self.len()).map(|i| self.row(i))
    }
}

pub(crate) fn check_count(
    what: &'static str,
    expected: usize,
    found: usize,
) -> Result<(), SurrogateError> {
    if expected == found { Ok(()) } else { Err(SurrogateError::Count { what, expected, found }) }
}

/// Names head CSV columns: `#` would turn the header into a comment, and cells are trimmed.
pub(crate) fn check_name(name: &str) -> Result<(), SurrogateError> {
    let bad = name.is_empty()
        || name.trim() != name
        || name.starts_with('#')
        || name.chars().any(char::is_control);
    if bad { Err(SurrogateError::Name { name: name.to_owned() }) } else { Ok(()) }
}

pub(crate) fn check_distinct<'a>(
    names: impl Iterator<Item = &'a String>,
) -> Result<(), SurrogateError> {
    let mut seen = BTreeSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(SurrogateError::DuplicateName { name: name.clone() });
        }
    }
    Ok(())
}
