//! Numbers in exports: decimal signs, separators of thousands, and clock times.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::aliases::aliases;

/// Signs that only separate thousands: apostrophes, no-break space, narrow no-break space, thin space, and blank.
const GROUPING: [char; 6] = ['\'', '\u{2019}', '\u{a0}', '\u{202f}', '\u{2009}', ' '];

/// Decimal sign.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = aliases(&["point", "comma"]))]
pub enum Decimal {
    /// `1.5`
    #[serde(rename = ".", alias = "point")]
    Point,
    /// `1,5`
    #[serde(rename = ",", alias = "comma")]
    Comma,
}

impl Decimal {
    /// Parses a cell as a finite number; `None` if it is not a finite number with this decimal sign.
    ///
    /// Thousands may be separated if the separator cannot be a decimal sign: `1'234`, `1,234.5` (decimal point) or
    /// `1,234,567` (decimal point). `1,234` is not a number with a decimal point, because the comma may be a decimal sign.
    pub(super) fn number(self, cell: &str) -> Option<f64> {
        let cell = cell.trim().replace('\u{2212}', "-");
        let sign = self.sign();
        let text = match cell.replace(sign, ".").parse::<f64>() {
            Ok(_) if sign == '.' || !cell.contains('.') => cell.replace(sign, "."),
            _ => self.without_groups(&cell)?,
        };
        text.parse().ok().filter(|number: &f64| number.is_finite())
    }

    /// The number without separators of thousands and with a decimal point; `None` if the groups are not groups of three
    /// digits or the separator may be a decimal sign.
    fn without_groups(self, cell: &str) -> Option<String> {
        let (whole, fraction) = match cell.split_once(self.sign()) {
            Some((whole, fraction)) => (whole, Some(fraction)),
            None => (cell, None),
        };
        let is_other = |c: char| c == self.other().sign();
        let separator = whole.chars().find(|&c| is_other(c) || GROUPING.contains(&c))?;
        let is_certain = fraction.is_some()
            || match separator {
                // in a file with blanks between columns, a blank separates two numbers
                ' ' => false,
                c => !is_other(c) || whole.chars().filter(|&c| is_other(c)).count() > 1,
            };
        let fraction = fraction.unwrap_or_default();
        let is_of_digits = fraction.chars().all(|c| c.is_ascii_digit());
        (is_certain && is_of_digits && has_groups(whole, separator))
            .then(|| format!("{}.{fraction}", whole.replace(separator, "")))
    }

    fn sign(self) -> char {
        match self {
            Self::Point => '.',
            Self::Comma => ',',
        }
    }

    /// The sign that is not the decimal sign.
    pub(super) fn other(self) -> Self {
        match self {
            Self::Point => Self::Comma,
            Self::Comma => Self::Point,
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Point => "decimal point",
            Self::Comma => "decimal comma",
        }
    }
}

/// Whether a number consists of one to three digits, of which the first is not zero, and groups of three digits.
fn has_groups(whole: &str, separator: char) -> bool {
    let bare = whole.strip_prefix(['-', '+']).unwrap_or(whole);
    let mut groups = bare.split(separator);
    let first = groups.next().unwrap_or_default();
    let is_of_digits = |group: &str| group.bytes().all(|byte| byte.is_ascii_digit());
    (1..=3).contains(&first.len())
        && is_of_digits(first)
        && !first.starts_with('0')
        && groups.all(|group| group.len() == 3 && is_of_digits(group))
}

/// Parses a whole number with a single separator of thousands, such as `1,234`; `sign` is the separator. `None` for other
/// cells.
pub(super) fn single_group(cell: &str, sign: Decimal) -> Option<f64> {
    let separator = sign.sign();
    let is_single = cell.chars().filter(|&c| c == separator).count() == 1;
    let bare = cell.trim().replace('\u{2212}', "-");
    (is_single && has_groups(&bare, separator))
        .then(|| bare.replace(separator, "").parse().ok())
        .flatten()
}

/// Whether a cell proves that `decimal` is the decimal sign: a number with this sign that is not a whole number with
/// separated thousands.
pub(super) fn is_decimal_sign_certain<'a>(
    mut cells: impl Iterator<Item = &'a String>,
    decimal: Decimal,
) -> bool {
    cells.any(|cell| {
        cell.contains(decimal.sign())
            && decimal.number(cell).is_some()
            && single_group(cell, decimal).is_none()
    })
}

/// Parses a clock time as seconds: `hh:mm:ss` or `mm:ss`, with decimals of the seconds. If `are_hours` is true, two parts
/// are `hh:mm`. `None` for other cells.
pub(super) fn clock_seconds(cell: &str, are_hours: bool) -> Option<f64> {
    let fields: Vec<&str> = cell.trim().split(':').collect();
    let whole = |text: &str| {
        let is_of_digits = !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        is_of_digits.then(|| text.parse::<f64>().ok()).flatten()
    };
    let seconds = |text: &str| {
        let is_first_digit = text.starts_with(|c: char| c.is_ascii_digit());
        let seconds: f64 = text.replace(',', ".").parse().ok().filter(|_| is_first_digit)?;
        (seconds < 60.0).then_some(seconds)
    };
    let minutes = |text: &str| whole(text).filter(|&minutes| minutes < 60.0);
    match fields[..] {
        [h, m] if are_hours => Some(3600.0 * whole(h)? + 60.0 * minutes(m)?),
        [m, s] => Some(60.0 * whole(m)? + seconds(s)?),
        [h, m, s] => Some(3600.0 * whole(h)? + 60.0 * minutes(m)? + seconds(s)?),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thousands_are_separated_where_no_other_reading_is_possible() {
        let (point, comma) = (Decimal::Point, Decimal::Comma);
        for (decimal, cell, number) in [
            (point, "1,234.5", Some(1234.5)),
            (point, "-1,234,567", Some(-1_234_567.0)),
            (point, "1'234", Some(1234.0)),
            (point, "12\u{202f}345.25", Some(12345.25)),
            (point, "1,234", None),
            (point, "0,123.5", None),
            (point, "1,23.5", None),
            (point, "1,234.5e3", None),
            (comma, "1.234,5", Some(1234.5)),
            (comma, "1 234,5", Some(1234.5)),
            (comma, "1 234", None),
            (comma, "1.234", None),
            (comma, "1.2", None),
            (comma, "1,234", Some(1.234)),
            (comma, "1,5e-3", Some(0.0015)),
            (point, "\u{2212}2.5e3", Some(-2500.0)),
            (point, "nan", None),
            (point, "", None),
        ] {
            assert_eq!(decimal.number(cell), number, "{decimal:?} {cell:?}");
        }
        assert_eq!(single_group("1,020", Decimal::Comma), Some(1020.0));
        assert_eq!(single_group("0,020", Decimal::Comma), None);
    }

    #[test]
    fn clock_times_are_seconds() {
        for (cell, are_hours, seconds) in [
            ("00:01", false, Some(1.0)),
            ("90:30.5", false, Some(5430.5)),
            ("01:02:03,25", false, Some(3723.25)),
            ("10:05", true, Some(36300.0)),
            ("00:61", false, None),
            ("1:2:3:4", false, None),
            ("12.5", false, None),
            ("a:b", false, None),
        ] {
            assert_eq!(clock_seconds(cell, are_hours), seconds, "{cell}");
        }
    }
}
