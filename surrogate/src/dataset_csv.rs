//! A dataset as one CSV file: declarations in leading `#` lines, then the header and the rows.

use std::path::Path;

use crate::dataset::{Dataset, Input};
use crate::error::SurrogateError;

impl Dataset {
    /// Writes the dataset as CSV.
    ///
    /// Names, bounds and provenance are in `#` lines above the header:
    /// ```text
    /// # provenance: breccia ensemble, mesh 3k
    /// # input,young_mpa,250.0,300.0
    /// # output,force_n
    /// young_mpa,force_n
    /// 275.0,147.1
    /// ```
    /// The columns of derivatives follow the outputs, with names such as `d_force_n_d_young_mpa`. Other tools
    /// read the file with their comment option (`comment="#"` in pandas). Each number is the shortest decimal
    /// text that parses to the same 64 bits.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> Result<(), SurrogateError> {
        let path = path.as_ref();
        self.to_csv()
            .and_then(|text| std::fs::write(path, text))
            .map_err(|source| SurrogateError::Io { path: path.to_owned(), source })
    }

    /// Returns the bytes that [`Dataset::write_csv`] writes.
    ///
    /// # Errors
    /// Does not occur in practice, because writing to memory does not fail.
    pub fn to_csv(&self) -> std::io::Result<Vec<u8>> {
        let lines = self.provenance().split('\n').map(|line| format!("# provenance: {line}\n"));
        let mut writer = csv::WriterBuilder::new()
            .flexible(true)
            .from_writer(lines.collect::<String>().into_bytes());
        for Input { name, lower, upper } in self.inputs() {
            writer.write_record(["# input", name, &format!("{lower:?}"), &format!("{upper:?}")])?;
        }
        for output in self.outputs() {
            writer.write_record(["# output", output])?;
        }
        writer.write_record(self.columns())?;
        for (i, (x, y)) in self.rows().enumerate() {
            for value in x.iter().chain(y).chain(self.derivatives(i).unwrap_or_default()) {
                writer.write_field(format!("{value:?}"))?;
            }
            let notes = self.notes().iter().filter_map(|name| self.note(i, name));
            writer.write_record(notes)?;
        }
        writer.into_inner().map_err(csv::IntoInnerError::into_error)
    }

    /// Reads a file that [`Dataset::write_csv`] wrote.
    ///
    /// Columns are identified by name and may be in any order. The columns of derivatives must be complete or
    /// absent. Other columns that no `#` line declares are notes.
    ///
    /// # Errors
    /// If the file cannot be read; a declaration is malformed or missing; a declared column is missing or
    /// occurs twice; only some of the derivatives have a column; a cell is not a finite number or lies
    /// outside its bounds. Each error names the file, the line, the column and the value.
    pub fn read_csv(path: impl AsRef<Path>) -> Result<Self, SurrogateError> {
        let path = path.as_ref();
        let text = std::fs::read_to_string(path)
            .map_err(|source| SurrogateError::Io { path: path.to_owned(), source })?;
        parse(&text).map_err(|(line, source)| SurrogateError::InFile {
            path: path.to_owned(),
            line,
            source: Box::new(source),
        })
    }
}

/// A result whose error has the number of the line in which the error occurred.
type Located<T> = Result<T, (u64, SurrogateError)>;

fn parse(text: &str) -> Located<Dataset> {
    let dataset = declarations(text)?;
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let header = reader.headers().map_err(|e| syntax(text, &e))?.clone();
    let header_line = line_at(text, header.position());
    let dataset = with_derivatives(dataset, &header).map_err(|e| (header_line, e))?;
    let mut columns = Vec::new();
    for name in dataset.columns() {
        let mut positions = header.iter().enumerate().filter(|(_, h)| *h == name).map(|(i, _)| i);
        let position = positions.next().ok_or_else(|| {
            let names = header.iter().collect::<Vec<_>>().join(", ");
            (header_line, SurrogateError::MissingColumn { column: name.clone(), found: names })
        })?;
        if positions.next().is_some() {
            return Err((header_line, SurrogateError::DuplicateName { name }));
        }
        columns.push((name, position));
    }
    let notes: Vec<usize> =
        (0..header.len()).filter(|i| columns.iter().all(|(_, position)| position != i)).collect();
    let names: Vec<&str> = notes.iter().map(|&i| &header[i]).collect();
    let mut dataset = dataset.with_notes(&names).map_err(|e| (header_line, e))?;
    let inputs = dataset.inputs().len();
    let value_columns = inputs + dataset.outputs().len();
    for record in reader.records() {
        let record = record.map_err(|e| syntax(text, &e))?;
        let here = |e| (line_at(text, record.position()), e);
        let cells: Vec<f64> = columns
            .iter()
            .map(|(name, position)| number(name, &record[*position]))
            .collect::<Result<_, _>>()
            .map_err(here)?;
        let notes: Vec<&str> = notes.iter().map(|&i| &record[i]).collect();
        let (x, y, slopes) =
            (&cells[..inputs], &cells[inputs..value_columns], &cells[value_columns..]);
        dataset.add(x, y, slopes, &notes).map_err(here)?;
    }
    Ok(dataset)
}

/// Declares the derivatives that have a column in the header. If input k is the last input with such a column, the
/// derivatives with respect to the first k inputs are declared, and all outputs must have columns for these k inputs.
fn with_derivatives(
    dataset: Dataset,
    header: &csv::StringRecord,
) -> Result<Dataset, SurrogateError> {
    let all = dataset.inputs().len();
    let dataset = dataset.with_derivatives_in(all)?;
    let is_there = |name: &String| header.iter().any(|column| column == name);
    // `derivative_columns` lists one column per input for each output, so `position % all` is the input
    let columns = dataset.derivative_columns().into_iter().enumerate();
    let (there, missing): (Vec<_>, Vec<_>) = columns.partition(|(_, name)| is_there(name));
    let inputs = there.iter().map(|(position, _)| position % all + 1).max().unwrap_or(0);
    match (there.first(), missing.iter().find(|(position, _)| position % all < inputs)) {
        (Some((_, there)), Some((_, missing))) => {
            Err(SurrogateError::SomeDerivatives { there: there.clone(), missing: missing.clone() })
        }
        _ => dataset.with_derivatives_in(inputs),
    }
}

/// Parses the leading `#` lines, which declare inputs and outputs, and returns a dataset with these
/// columns and without rows.
fn declarations(text: &str) -> Located<Dataset> {
    let (mut inputs, mut outputs, mut provenance) = (Vec::new(), Vec::new(), Vec::new());
    let mut line = 0;
    for content in text.lines().map_while(|l| l.strip_prefix('#')) {
        line += 1;
        let content = content.strip_prefix(' ').unwrap_or(content);
        if let Some(text) = content.strip_prefix("provenance:") {
            provenance.push(text.strip_prefix(' ').unwrap_or(text));
            continue;
        }
        let fields = fields(content).map_err(|(_, e)| (line, e))?;
        match fields.iter().map(String::as_str).collect::<Vec<_>>()[..] {
            ["input", name, lower, upper] => {
                let input = number(name, lower)
                    .and_then(|l| Input::new(name, l, number(name, upper)?))
                    .map_err(|e| (line, e))?;
                inputs.push(input);
            }
            ["output", name] => outputs.push(name.to_owned()),
            ["input" | "output", ..] => {
                let problem = format!("`# {content}` is not a declaration");
                let help = "write `# input,NAME,LOWER,UPPER` or `# output,NAME`";
                return Err((line, SurrogateError::Syntax { problem, help }));
            }
            _ => {}
        }
    }
    if inputs.is_empty() || outputs.is_empty() {
        let problem = "the inputs or the outputs are not declared".to_owned();
        let help = "begin the file with a line `# input,NAME,LOWER,UPPER` for each input and `# output,NAME` for each output";
        return Err((1, SurrogateError::Syntax { problem, help }));
    }
    Dataset::new(inputs, outputs, provenance.join("\n")).map_err(|e| (line, e))
}

/// Parses one line as a CSV record.
fn fields(line: &str) -> Located<Vec<String>> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .trim(csv::Trim::All)
        .from_reader(line.as_bytes());
    match reader.records().next() {
        Some(record) => {
            Ok(record.map_err(|e| syntax(line, &e))?.iter().map(str::to_owned).collect())
        }
        None => Ok(Vec::new()),
    }
}

fn number(column: &str, text: &str) -> Result<f64, SurrogateError> {
    text.parse().map_err(|_| SurrogateError::NotANumber {
        column: column.to_owned(),
        text: text.to_owned(),
    })
}

/// Line number of a record. The `csv` crate reports the position before the comments and empty lines above
/// the record.
fn line_at(text: &str, position: Option<&csv::Position>) -> u64 {
    let Some(position) = position else { return 1 };
    let rest = usize::try_from(position.byte()).ok().and_then(|byte| text.get(byte..));
    let skipped = rest.unwrap_or("").lines().take_while(|l| l.is_empty() || l.starts_with('#'));
    position.line() + skipped.count() as u64
}

fn syntax(text: &str, error: &csv::Error) -> (u64, SurrogateError) {
    let problem = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("the row has {len} cells but the header has {expected_len}")
        }
        _ => error.to_string(),
    };
    let help = "write one cell for each column, separated by commas";
    (line_at(text, error.position()), SurrogateError::Syntax { problem, help })
}
