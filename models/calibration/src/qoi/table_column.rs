//! Quantity that is a column of tables, without a curve.

use std::borrow::Cow;

use super::curve::PeakedCurve;
use super::definition::Qoi;
use super::error::QoiError;
use super::unit::Unit;

/// Quantity that a simulation or a laboratory reports in a column of a table. The quantity is not computed from a
/// curve, and may have any unit and any sign. Its name in a case is, for example, `column:deflection_mm`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TableColumn {
    column: String,
}

impl TableColumn {
    /// Prefix of the column's name in the name of the quantity in a case.
    pub const PREFIX: &'static str = "column:";

    /// Creates the quantity of a column. `None` unless the name of the column has letters, digits and `_`, `-`, `.` or
    /// `/` only.
    pub fn new(column: &str) -> Option<Self> {
        let is_allowed = |c: char| c.is_alphanumeric() || "_-./".contains(c);
        let is_name = !column.is_empty() && column.chars().all(is_allowed);
        is_name.then(|| Self { column: column.to_owned() })
    }

    /// Parses the name in a case, as in `column:deflection_mm`.
    pub(super) fn of_name(name: &str) -> Option<Self> {
        Self::new(name.strip_prefix(Self::PREFIX)?)
    }
}

impl Qoi for TableColumn {
    fn name(&self) -> Cow<'static, str> {
        format!("{}{}", Self::PREFIX, self.column).into()
    }

    fn column(&self) -> Cow<'static, str> {
        self.column.clone().into()
    }

    fn description(&self) -> Cow<'static, str> {
        self.column.clone().into()
    }

    /// The unit is part of the name of the column.
    fn unit(&self) -> Unit {
        Unit::ONE
    }

    fn is_positive(&self) -> bool {
        false
    }

    fn is_of_curve(&self) -> bool {
        false
    }

    fn value(&self, _: &PeakedCurve<'_>) -> Result<f64, QoiError> {
        Err(QoiError::Undefined {
            quantity: self.name().into_owned(),
            reason: "is a column of a table and is not computed from a curve".to_owned(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::Quantity;

    #[test]
    fn any_column_is_a_quantity_by_its_prefixed_name() {
        for column in ["deflection_mm", "f1_Hz", "Kt", "a-b.c/d"] {
            let name = format!("column:{column}");
            let quantity: Quantity = toml::Value::from(name.as_str()).try_into().unwrap();
            assert_eq!((quantity.to_string(), &*quantity.column()), (name, column));
            assert!(!quantity.is_of_curve() && !quantity.is_positive());
            assert_eq!(quantity.label(), column);
        }
        for name in ["column:", "column:a,b", "column:a b", "deflection_mm"] {
            let parsed: Result<Quantity, _> = toml::Value::from(name).try_into();
            let error = parsed.unwrap_err().to_string();
            assert!(error.contains("`column:deflection_mm`"), "{error}");
        }
        let quantity: Quantity = toml::Value::from("peak_force").try_into().unwrap();
        assert!(quantity.is_of_curve());
    }
}
