//! Runs of a computer model: bounded inputs, outputs and provenance.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};

use crate::error::SurrogateError;

/// A named input with its lower and upper bound.
///
/// Values are used without conversion of units; put the unit in the name (`young_mpa`).
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
    /// Creates a named interval.
    ///
    /// # Errors
    /// If the name cannot be the header of a CSV column, or the bounds are not finite and increasing.
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

    /// Performs the checks of [`Input::new`], for inputs that were built field by field.
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

    /// Whether `x` lies in the closed interval; false for NaN.
    #[inline]
    pub fn contains(&self, x: f64) -> bool {
        self.lower <= x && x <= self.upper
    }
}

/// Runs of a computer model: `n` rows of named bounded inputs and named outputs.
///
/// Every row is finite and inside the bounds; other rows are rejected. A row may also have notes, such as the number
/// of the run: columns of text, which a fit ignores. [`Dataset::write_csv`] writes all columns and declarations to
/// one file that other tools can read.
///
/// A row may also have the derivatives of every output with respect to all inputs, or with respect to the first few
/// inputs. A fit then uses the derivatives: see [`Dataset::with_derivatives`].
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
    /// Number k such that the rows have derivatives with respect to the first k inputs.
    differentiated: usize,
    /// Derivatives, with the dimensions rows × outputs × inputs with derivatives; empty if the rows
    /// have no derivatives.
    slopes: Vec<f64>,
    /// The notes of all rows, row by row; each row has one text per name of a note.
    noted: Vec<String>,
}

impl Dataset {
    /// Creates an empty dataset with the given columns; `provenance` is free text of one or more lines.
    ///
    /// # Errors
    /// If there is no input or no output, if a name is invalid or repeated, or if bounds are invalid.
    pub fn new(
        inputs: Vec<Input>,
        outputs: Vec<String>,
        provenance: impl Into<String>,
    ) -> Result<Self, SurrogateError> {
        for (what, count) in [("or more inputs", inputs.len()), ("or more outputs", outputs.len())]
        {
            if count == 0 {
                return Err(SurrogateError::Count { what, expected: 1, found: count });
            }
        }
        for input in &inputs {
            input.check()?;
        }
        for output in &outputs {
            check_name(output)?;
        }
        check_distinct(inputs.iter().map(|i| &i.name).chain(&outputs))?;
        // normalise line breaks, so that the text survives writing and reading the file
        let provenance: String = provenance.into().replace("\r\n", "\n").replace('\r', "\n");
        Ok(Self {
            inputs,
            outputs,
            provenance,
            notes: Vec::new(),
            x: Vec::new(),
            y: Vec::new(),
            differentiated: 0,
            slopes: Vec::new(),
            noted: Vec::new(),
        })
    }

    /// Adds columns for the derivatives of every output with respect to every input, named `d_<output>_d_<input>`.
    /// The dataset must not have rows yet.
    ///
    /// # Errors
    /// If the dataset already has rows, or one of these columns repeats a name.
    ///
    /// ```
    /// # use surrogate::{Dataset, Input};
    /// let inputs = vec![Input::new("a", 0.0, 1.0)?, Input::new("b", 0.0, 1.0)?];
    /// let mut runs = Dataset::new(inputs, vec!["f".into()], "f = a b²")?.with_derivatives()?;
    /// runs.push_differentiated(&[0.5, 0.2], &[0.02], &[[0.04, 0.2]], &[])?;
    /// assert_eq!(runs.derivatives(0), Some(&[0.04, 0.2][..]));
    /// # Ok::<(), surrogate::SurrogateError>(())
    /// ```
    pub fn with_derivatives(self) -> Result<Self, SurrogateError> {
        let all = self.inputs.len();
        self.with_derivatives_in(all)
    }

    /// Version of [`Self::with_derivatives`] that adds columns only for the derivatives with respect to the first
    /// `inputs` inputs.
    ///
    /// # Errors
    /// The errors of [`Self::with_derivatives`], and an error if `inputs` exceeds the number of inputs.
    pub fn with_derivatives_in(mut self, inputs: usize) -> Result<Self, SurrogateError> {
        check_count("rows before derivatives are declared", 0, self.len())?;
        if inputs > self.inputs.len() {
            check_count("inputs with derivatives", self.inputs.len(), inputs)?;
        }
        self.differentiated = inputs;
        check_distinct(self.columns().iter())?;
        Ok(self)
    }

    /// Declares columns of text (notes), which replace all previously declared notes. Existing rows get empty cells.
    ///
    /// # Errors
    /// If a name is invalid or repeated.
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
        check_distinct(self.columns().iter())?;
        self.noted = vec![String::new(); self.len() * names.len()];
        Ok(self)
    }

    /// Adds a row: `x` in the order of the inputs, `y` in the order of the outputs.
    ///
    /// # Errors
    /// If the number of values is wrong, a value is not finite, or an input is outside its bounds.
    pub fn push(&mut self, x: &[f64], y: &[f64]) -> Result<(), SurrogateError> {
        self.push_noted(x, y, &vec![""; self.notes.len()])
    }

    /// Adds a row with its notes, in the order of [`Self::notes`].
    ///
    /// # Errors
    /// The errors of [`Self::push`], and an error if the number of notes is wrong.
    pub fn push_noted(
        &mut self,
        x: &[f64],
        y: &[f64],
        notes: &[&str],
    ) -> Result<(), SurrogateError> {
        self.add(x, y, &[], notes)
    }

    /// Adds a row with its derivatives and its notes: `jacobian[m][d]` = ∂y_m/∂x_d in units of output m per
    /// unit of input d.
    ///
    /// # Errors
    /// The errors of [`Self::push`], and an error if the dataset has no [columns for
    /// derivatives](Self::with_derivatives) or a derivative is not finite.
    pub fn push_differentiated(
        &mut self,
        x: &[f64],
        y: &[f64],
        jacobian: &[impl AsRef<[f64]>],
        notes: &[&str],
    ) -> Result<(), SurrogateError> {
        check_count("outputs with derivatives", self.outputs.len(), jacobian.len())?;
        for row in jacobian {
            check_count("derivatives of an output", self.differentiated, row.as_ref().len())?;
        }
        let slopes: Vec<f64> = jacobian.iter().flat_map(|row| row.as_ref()).copied().collect();
        self.add(x, y, &slopes, notes)
    }

    /// Adds a row. `slopes` contains the derivatives of the first output with respect to each input, then the
    /// derivatives of the second output, and so on.
    pub(crate) fn add(
        &mut self,
        x: &[f64],
        y: &[f64],
        slopes: &[f64],
        notes: &[&str],
    ) -> Result<(), SurrogateError> {
        check_count("notes", self.notes.len(), notes.len())?;
        check_count("input values", self.inputs.len(), x.len())?;
        check_count("output values", self.outputs.len(), y.len())?;
        check_count("derivatives", self.slopes_per_row(), slopes.len())?;
        for (index, &value) in x.iter().chain(y).chain(slopes).enumerate() {
            if !value.is_finite() {
                let column = self.columns().swap_remove(index);
                return Err(SurrogateError::NotFinite { column, value });
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
        self.slopes.extend_from_slice(slopes);
        self.noted.extend(notes.iter().map(|note| (*note).to_owned()));
        Ok(())
    }

    /// The inputs.
    pub fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    /// The names of the outputs.
    pub fn outputs(&self) -> &[String] {
        &self.outputs
    }

    /// The names of the notes.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The text of the note `name` in row `i`, counted from 0.
    pub fn note(&self, i: usize, name: &str) -> Option<&str> {
        let position = self.notes.iter().position(|note| note == name)?;
        self.noted.get(i * self.notes.len() + position).map(String::as_str)
    }

    /// Returns the number k such that the rows have derivatives with respect to the first k inputs.
    pub fn inputs_with_derivatives(&self) -> usize {
        self.differentiated
    }

    /// The derivatives of row `i`, counted from 0: outputs × inputs with derivatives, row-major. None if the
    /// dataset has no derivatives or no row `i`.
    pub fn derivatives(&self, i: usize) -> Option<&[f64]> {
        let size = self.slopes_per_row();
        if size == 0 { None } else { self.slopes.get(i * size..(i + 1) * size) }
    }

    /// The names of the columns of derivatives, in their order.
    pub(crate) fn derivative_columns(&self) -> Vec<String> {
        let columns_of = |output: &String| {
            let column = move |input: &Input| format!("d_{output}_d_{}", input.name);
            self.inputs[..self.differentiated].iter().map(column).collect::<Vec<_>>()
        };
        self.outputs.iter().flat_map(columns_of).collect()
    }

    fn slopes_per_row(&self) -> usize {
        self.differentiated * self.outputs.len()
    }

    /// The names of all columns: inputs, outputs, derivatives, notes.
    pub(crate) fn columns(&self) -> Vec<String> {
        let mut columns: Vec<String> = self.inputs.iter().map(|i| i.name.clone()).collect();
        columns.extend_from_slice(&self.outputs);
        columns.extend(self.derivative_columns());
        columns.extend_from_slice(&self.notes);
        columns
    }

    /// The provenance of the rows, as free text.
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
    /// If there is no row `i`.
    pub fn row(&self, i: usize) -> (&[f64], &[f64]) {
        let (d, m) = (self.inputs.len(), self.outputs.len());
        (&self.x[i * d..(i + 1) * d], &self.y[i * m..(i + 1) * m])
    }

    /// All rows, in the order in which they were added.
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

/// Rejects names that cannot be the header of a CSV column: a leading `#` would make the header line a comment, and
/// the reader removes white space at both ends of a cell.
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
