//! `[experiments.read]`: how records of a testing machine are read.

use serde::{Deserialize, Serialize};

/// `[experiments.read]`: how records are read; what is absent is detected.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ReadOptions {
    /// What separates columns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separator: Option<Separator>,
    /// Decimal sign.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decimal: Option<Decimal>,
    /// Lines before the names of the columns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skip: Option<usize>,
    /// Encoding of the text.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub encoding: Option<Encoding>,
    /// Sheet of a workbook; absent: the first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sheet: Option<String>,
    /// Name of the column of the displacement (or strain).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement: Option<String>,
    /// Name of the column of the force (or stress).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force: Option<String>,
    /// Name of the column of the time.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<String>,
    /// Unit of the displacement, in place of the file's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement_unit: Option<String>,
    /// Unit of the force, in place of the file's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_unit: Option<String>,
    /// Unit of the time, in place of the file's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_unit: Option<String>,
    /// What a displacement of 1 in the file is in mm, in place of a unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement_factor: Option<f64>,
    /// What a force of 1 in the file is in N, in place of a unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_factor: Option<f64>,
    /// Sign of a compressive force in the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compression: Option<Compression>,
    /// Whether force counts from the first readings.
    pub zero_force: bool,
    /// Whether displacement counts from the first reading.
    pub zero_displacement: bool,
}

/// What separates the columns of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Separator {
    /// `,`
    #[serde(rename = ",", alias = "comma")]
    Comma,
    /// `;`
    #[serde(rename = ";", alias = "semicolon")]
    Semicolon,
    /// A tabulator.
    #[serde(rename = "tab", alias = "\t")]
    Tab,
    /// One or more blanks.
    #[serde(rename = "space", alias = " ")]
    Space,
}

/// Decimal sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Decimal {
    /// `1.5`
    #[serde(rename = ".", alias = "point")]
    Point,
    /// `1,5`
    #[serde(rename = ",", alias = "comma")]
    Comma,
}

/// Encoding of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Encoding {
    /// UTF-8, with or without a byte order mark.
    #[serde(rename = "utf-8")]
    Utf8,
    /// UTF-16 with a byte order mark.
    #[serde(rename = "utf-16")]
    Utf16,
    /// ISO 8859-1.
    #[serde(rename = "latin-1")]
    Latin1,
}

/// Sign of a compressive force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Compression {
    /// Compression is positive.
    Positive,
    /// Compression is negative.
    Negative,
}

impl Decimal {
    /// The finite number of a cell.
    pub(super) fn number(self, cell: &str) -> Option<f64> {
        let cell = cell.trim().replace('\u{2212}', "-");
        let text = match self {
            Self::Point => cell,
            Self::Comma if cell.contains('.') => return None,
            Self::Comma => cell.replace(',', "."),
        };
        text.parse().ok().filter(|number: &f64| number.is_finite())
    }
}
