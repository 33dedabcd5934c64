//! Reader and writer of case files; errors contain key, value and help.

use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::Case;
use super::excerpt::{excerpt, with_excerpt};
use super::image::IMAGE_KEYS;
use super::mistakes::ReadCase;
use super::plastic::hardening_key;
use crate::error::{InputError, absence, closest};

/// A case with the path of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseFile {
    /// Path of the case file; relative paths in the case refer to the folder of this file.
    pub path: PathBuf,
    /// Contents of the case file.
    pub case: Case,
    /// Keys and paths of the tables of yield stresses and the time tables, whose rows replace their names in `case`.
    pub table_files: Vec<(String, PathBuf)>,
}

/// Key of the displacement of the platens.
const DISPLACEMENT: &str = "test.displacement_mm";

impl CaseFile {
    /// Reads and validates a case.
    ///
    /// # Errors
    /// If the file cannot be read, a key is unknown or missing, a value has the wrong type or is out of range, or a
    /// mesh file does not exist. The error contains file, key, value and help.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        Self::parse(&Self::text(path)?, path)
    }

    /// Parses and validates the text of a case, like [`CaseFile::read`].
    ///
    /// # Errors
    /// The errors of [`CaseFile::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, InputError> {
        let (file, mistakes) = Self::parse_all(text, path);
        Self::without_mistakes(file, mistakes, path)
    }

    /// Reads a case like [`CaseFile::read`] for the segmentation of its image. The segmentation does not need the
    /// displacement of the platens, so that a case without this key is accepted.
    ///
    /// # Errors
    /// The other errors of [`CaseFile::read`].
    pub(crate) fn read_for_segmentation(path: &Path) -> Result<Self, InputError> {
        let (file, mut mistakes) = Self::parse_all(&Self::text(path)?, path);
        mistakes.retain(|mistake| mistake.place != DISPLACEMENT || !mistake.value.is_empty());
        Self::without_mistakes(file, mistakes, path)
    }

    /// Returns the case, or the first mistake.
    fn without_mistakes(
        file: Option<Self>,
        mistakes: Vec<InputError>,
        path: &Path,
    ) -> Result<Self, InputError> {
        match (file, mistakes.into_iter().next()) {
            (Some(file), None) => Ok(file),
            (_, Some(mistake)) => Err(mistake),
            // unreachable: `parse_all` reports at least one mistake if it returns no case
            (None, None) => {
                Err(InputError::new(path, "", "", "is not a case", "See breccia init."))
            }
        }
    }

    /// Parses a case like [`CaseFile::parse`] and returns all mistakes. The case contains everything that could be
    /// read; it is `None` if a required part is missing.
    pub(crate) fn parse_all(text: &str, path: &Path) -> (Option<Self>, Vec<InputError>) {
        if Self::is_study(text) {
            let help = format!("Run it with: breccia study {}", path.display());
            return (None, vec![InputError::new(path, "", "", "is a study, not a case", help)]);
        }
        let mut read = ReadCase::of(text);
        let mut mistakes: Vec<InputError> =
            read.lists.iter().map(|list| list.error(text, path)).collect();
        mistakes.extend(read.errors.iter().map(|error| explain(error, text, path)));
        let Some(mut case) = read.case.take() else { return (None, mistakes) };
        case.complete();
        let mut file = Self { path: path.to_owned(), case, table_files: Vec::new() };
        mistakes.extend(file.read_hardening().into_iter().map(|m| with_excerpt(m, text, path)));
        let folder = file.path.with_file_name("");
        let conditions = file.case.conditions.as_mut();
        for (key, table, read) in conditions.into_iter().flat_map(|all| all.read_tables(&folder)) {
            file.table_files.push((key, table));
            mistakes.extend(read.err());
        }
        let unexplained = file.validate().into_iter().filter(|mistake| !read.explains(mistake));
        mistakes.extend(unexplained.map(|mistake| with_excerpt(mistake, text, path)));
        // in unit tests, the schema must accept every case that the reader accepts; the reader does not read the candidates
        // of a case without a prior
        #[cfg(test)]
        if mistakes.is_empty()
            && file.case.whole_prior().is_some()
            && let Err(error) = super::schema::tests::check_case(text)
        {
            panic!("the schema refuses a case: {error}\n{text}");
        }
        (Some(file), mistakes)
    }

    /// Replaces the names of tables of yield stresses by their rows; returns the mistakes.
    fn read_hardening(&mut self) -> Vec<InputError> {
        let folder = self.path.with_file_name("");
        let mut mistakes = Vec::new();
        for (region, material) in &mut self.case.material {
            let Some(plastic) = material.plastic.as_mut() else { continue };
            let Some(table) = plastic.table().map(|table| folder.join(table)) else { continue };
            let key = hardening_key(region);
            self.table_files.push((key.clone(), table.clone()));
            if let Err([problem, help]) = plastic.read_table(&table) {
                let value = table.display().to_string();
                mistakes.push(InputError::new(&self.path, &key, value, problem, help));
            }
        }
        mistakes
    }

    /// Reads the text of a case file.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn text(path: &Path) -> Result<String, InputError> {
        fem::read_regular_text(path).map_err(|e| {
            let help = match e.kind() {
                ErrorKind::InvalidData => "Save it as plain text, UTF-8.",
                _ => "Check its name, or write a first case with: breccia init",
            };
            InputError::unreadable(path, &e, help)
        })
    }

    /// Whether the text is a study: a study has the key `base` and neither a table `specimen` nor `simulator`.
    pub(crate) fn is_study(text: &str) -> bool {
        let table: Option<toml::Table> = text.parse().ok();
        let of_cases = ["specimen", "simulator"];
        table.is_some_and(|table| {
            table.contains_key("base") && !of_cases.iter().any(|key| table.contains_key(*key))
        })
    }

    /// Returns the built-in default case.
    pub fn default_case() -> Self {
        Self::parse(Case::TEMPLATE, Path::new("default.toml"))
            .expect("the shipped case is valid: a test reads it")
    }

    /// Resolves a path that is given in the case relative to the folder of the case file.
    pub fn beside(&self, path: &Path) -> PathBuf {
        self.path.with_file_name("").join(path)
    }

    /// Returns the path of the specimen table, if the case names one.
    ///
    /// # Errors
    /// If the file does not exist. [`CaseFile::read`] does not check this, because a single simulation does not need
    /// the table.
    pub fn table(&self) -> Result<Option<PathBuf>, InputError> {
        let Some(table) = self.case.experiments.as_ref().and_then(|e| e.table.as_ref()) else {
            return Ok(None);
        };
        let file = self.beside(table);
        if file.is_file() {
            return Ok(Some(file));
        }
        Err(self.error(
            "experiments.table",
            table.display().to_string(),
            absence(&file),
            format!("The program looks for it at {}.", file.display()),
        ))
    }

    /// Adds the line of the case file to an error about a key of this case.
    pub(crate) fn with_line(&self, error: InputError) -> InputError {
        match Self::text(&self.path) {
            Ok(text) => with_excerpt(error, &text, &self.path),
            Err(_) => error,
        }
    }

    /// Creates an error about a key of this case.
    pub(crate) fn error(
        &self,
        key: &str,
        value: impl Into<String>,
        problem: impl Into<String>,
        help: impl Into<String>,
    ) -> InputError {
        InputError::new(&self.path, key, value, problem, help)
    }
}

impl Case {
    /// Returns the case as TOML, including all default values.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("a case can be written as TOML")
    }
}

/// Converts an error of the TOML parser into an error with key, value and help.
fn explain(error: &toml::de::Error, text: &str, path: &Path) -> InputError {
    let span = error.span();
    let (location, value) = span.clone().map_or_else(Default::default, |span| locate(text, span));
    let is_key = span.as_ref().is_some_and(|span| {
        text.get(span.end..).is_some_and(|rest| rest.trim_start().starts_with(['=', '.']))
    });
    let excerpt = span.map(|span| Box::new(excerpt(text, span)));
    let mut error = explain_at(error, location, value, path);
    // the keys of some tables are read as names
    if let Some(name) = error.problem.strip_prefix("unknown name ").filter(|_| is_key) {
        error.problem = format!("unknown key {name}");
    }
    InputError { excerpt, ..error }
}

/// Converts an error of the TOML parser about the key `location` and its `value` into an error with help.
fn explain_at(error: &toml::de::Error, location: String, value: String, path: &Path) -> InputError {
    let message = error.message();
    if message.contains("such as matrix.young_mpa") {
        let problem = "a parameter is named with its region";
        let help = "Write matrix.young_mpa = … in place of young_mpa = …, grain.toughness_n_per_mm = … and so on.";
        return InputError::new(path, location, value, problem, help);
    }
    if message.contains("expected newtype variant")
        || message.contains("invalid type: unit variant")
    {
        let problem = "this name needs a value of its own";
        let help = format!("Write {} in place of it.", with_value(&location, &value));
        return InputError::new(path, location, value, problem, help);
    }
    if let Some((problem, help)) = message.split_once("; help: ") {
        return InputError::new(path, location, value, problem, help);
    }
    let names: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let (problem, help) = match names.split_first() {
        Some((key, allowed)) if message.starts_with("unknown field") => {
            let mut allowed = allowed.to_vec();
            if allowed.contains(&"min_grain_voxels") {
                // the message of the parser lists only the keys of the segmentation
                allowed.extend(IMAGE_KEYS);
            }
            let help = format!("{}Keys here: {}.", did_you_mean(key, &allowed), allowed.join(", "));
            (format!("unknown key {key:?}"), help)
        }
        Some((word, allowed)) if message.starts_with("unknown variant") => (
            format!("unknown name {word:?}"),
            format!("{}Choose one of: {}.", did_you_mean(word, allowed), allowed.join(", ")),
        ),
        Some((key, _)) if message.starts_with("missing field") => (
            format!("the key {key} is missing"),
            "Add it; breccia init writes a case that explains every key.".to_owned(),
        ),
        _ => {
            let message = message.trim_end_matches('.');
            let help = "breccia init writes a case that explains every key.";
            (in_plain_words(message), format!("{}{help}", how_to_write(message)))
        }
    };
    InputError::new(path, location, value, problem, help)
}

/// Shows the syntax of a name that needs a value: `rule = { fixed = 3 }` for `"fixed"`.
fn with_value(location: &str, value: &str) -> String {
    let key = location.rsplit('.').next().unwrap_or(location);
    let name = value.trim_matches(['"', '\'']);
    let value = if name == "fixed" { "3" } else { "{ … }" };
    format!("{key} = {{ {name} = {value} }}")
}

/// Returns a sentence on how to write a value of the type that the parser expected; empty for types that need no
/// explanation.
fn how_to_write(message: &str) -> &'static str {
    match message.rsplit_once("expected ") {
        _ if !message.starts_with("invalid type") => "",
        Some((_, "f64")) => "Write a number without quotes and unit. ",
        Some((_, "u8" | "u16" | "u32" | "u64" | "usize" | "i32" | "i64")) => {
            "Write a whole number without quotes, unit and decimal point. "
        }
        Some((_, "a boolean")) => "Write true or false without quotes. ",
        Some((_, "a string" | "path string")) => "Write it in quotes. ",
        _ => "",
    }
}

/// Replaces Rust types in the parser's message by TOML terms, and joins its lines.
fn in_plain_words(message: &str) -> String {
    let Some((given, expected)) = message.rsplit_once("expected ") else {
        return message.replace('\n', "; ");
    };
    let is_out_of_range = given.starts_with("invalid value: integer");
    let expected = match expected {
        "f64" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, not below 0",
        "i64" if is_out_of_range => "a whole number from −2⁶³ to 2⁶³ − 1",
        "i32" | "i64" => "a whole number",
        "a boolean" => "true or false",
        "path string" => "a path",
        "a sequence" => "a list in brackets",
        other => other,
    };
    format!("{given}expected {expected}").replace('\n', "; ")
}

fn did_you_mean(word: &str, allowed: &[&str]) -> String {
    closest(word, allowed.iter().copied())
        .map(|best| format!("Did you mean {best:?}? "))
        .unwrap_or_default()
}

/// Returns the key at a span, with its table, and the text to the right of the equals sign.
fn locate(text: &str, span: Range<usize>) -> (String, String) {
    let start = span.start.min(text.len());
    let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
    let line = text[line_start..].lines().next().unwrap_or("");
    let is_header = |line: &str| line.trim_start().starts_with('[');
    let table = table_of(&text[..line_start + line.len()]);
    match line.split_once('=') {
        Some((key, value)) if !is_header(line) => {
            let dot = if table.is_empty() { "" } else { "." };
            let value = value.split(" #").next().unwrap_or(value);
            (format!("{table}{dot}{}", key.trim()), value.trim().to_owned())
        }
        _ if table.is_empty() => Default::default(),
        _ => (format!("[{table}]"), String::new()),
    }
}

/// Returns the table of the last line of a text: the last header, as in `test`, or `tests[1]` for the second `[[tests]]`.
fn table_of(text: &str) -> String {
    let header = |line: &str| {
        let line = line.trim();
        let name = line.trim_start_matches('[').split(']').next().unwrap_or_default();
        line.starts_with('[').then(|| (line.starts_with("[["), name.trim().to_owned()))
    };
    let Some((is_list, name)) = text.lines().rev().find_map(header) else { return String::new() };
    if !is_list {
        return name;
    }
    let same = text.lines().filter_map(header).filter(|other| *other == (true, name.clone()));
    let index = same.count() - 1;
    format!("{name}[{index}]")
}

#[cfg(test)]
mod tests;
