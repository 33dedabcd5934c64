//! `[experiments.read]`: how records of a testing machine are read.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::aliases::aliases;
use super::number::Decimal;

/// Options `[experiments.read]` for reading records. Options that are absent are detected from the file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ReadOptions {
    /// Separator of the columns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub separator: Option<Separator>,
    /// Decimal sign.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub decimal: Option<Decimal>,
    /// Number of lines before the names of the columns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub skip: Option<usize>,
    /// Text at which the readings end: the readings end before the first row whose first filled cell starts with this
    /// text.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_at: Option<String>,
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
    /// Name of the column of the time. An empty name means that no time is read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<String>,
    /// Unit of the displacement. It replaces the unit that the file states.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement_unit: Option<String>,
    /// Unit of the force. It replaces the unit that the file states.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force_unit: Option<String>,
    /// Unit of the time. It replaces the unit that the file states.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_unit: Option<String>,
    /// Displacement in mm that corresponds to the number 1 in the file. It replaces a unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub displacement_factor: Option<f64>,
    /// Force in N that corresponds to the number 1 in the file. It replaces a unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub force_factor: Option<f64>,
    /// Sign of a compressive force in the file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub compression: Option<Compression>,
    /// Whether the force of the first readings is subtracted.
    pub zero_force: bool,
    /// Whether the displacement of the first reading is subtracted.
    pub zero_displacement: bool,
}

/// Separator of the columns of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = aliases(&["comma", "semicolon", "\t", " "]))]
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

/// Encoding of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Encoding {
    /// UTF-8, with or without a byte order mark.
    #[serde(rename = "utf-8")]
    Utf8,
    /// UTF-16, with or without a byte order mark.
    #[serde(rename = "utf-16")]
    Utf16,
    /// ISO 8859-1.
    #[serde(rename = "latin-1")]
    Latin1,
}

/// Sign of a compressive force.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Compression {
    /// Compression is positive.
    Positive,
    /// Compression is negative.
    Negative,
}
