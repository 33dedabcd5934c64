//! Quantities of measured specimens at the size of the mesh, and file names for messages about specimens.

use std::path::{Path, PathBuf};

use super::mesh_scale::{MeshScale, MeshSize};
use crate::case::QoiComparison;
use crate::error::InputError;
use crate::experiment::{Specimen, TestCurve};
use crate::qoi::{QoiError, Qois, Quantity};
use crate::table::TableRow;

/// Largest ratio of the range of a quantity over the specimens to its largest value that counts as no scatter. Load cells
/// resolve about 1e-4 of their range.
const NO_SCATTER: f64 = 1e-6;

/// File names for messages about specimens.
pub(crate) struct SpecimenNames<'a> {
    pub(crate) table: &'a Path,
    /// Curve file of a specimen.
    pub(crate) curve: &'a dyn Fn(&str) -> PathBuf,
}

/// Quantities of a measured specimen.
pub(crate) struct MeasuredQuantities {
    /// Values in the order of the quantities; NaN for a quantity that the curve cannot give.
    pub(crate) values: Vec<f64>,
    /// Quantities that the curve cannot give, with the reasons.
    pub(crate) missing: Vec<(Quantity, QoiError)>,
}

impl MeasuredQuantities {
    /// Computes the quantities of a curve.
    pub(crate) fn of(curve: &TestCurve, slope_fraction: f64, quantities: &[Quantity]) -> Self {
        let mut measured = Self { values: Vec::new(), missing: Vec::new() };
        let found = Qois::each_of(curve, slope_fraction, quantities);
        for (quantity, value) in quantities.iter().zip(found) {
            let value = value.and_then(|value| match value.is_finite() {
                true => Ok(value),
                false => Err(QoiError::Undefined {
                    quantity: quantity.to_string(),
                    reason: format!("{value} is not a finite number"),
                }),
            });
            measured.values.push(*value.as_ref().unwrap_or(&f64::NAN));
            measured.missing.extend(value.err().map(|reason| (quantity.clone(), reason)));
        }
        measured
    }

    /// The reason why the curve gives no quantity at all; `None` if it gives at least one.
    pub(crate) fn unusable(&self) -> Option<&QoiError> {
        let is_unusable = self.missing.len() == self.values.len();
        self.missing.first().filter(|_| is_unusable).map(|(_, reason)| reason)
    }
}

/// Computes the quantities of a specimen's curve, scaled to the size of the mesh, if there is one.
pub(crate) fn compared(
    specimen: &Specimen,
    mesh: Option<MeshSize>,
    qoi: &QoiComparison,
    quantities: &[Quantity],
) -> MeasuredQuantities {
    let fraction = specimen.slope_fraction.unwrap_or(qoi.slope_fraction);
    let curve = MeshScale::of(specimen, mesh).apply(&specimen.curve);
    MeasuredQuantities::of(&curve, fraction, quantities)
}

/// Text of a quantity in a table: an empty cell if the quantity is missing (NaN).
pub(crate) fn cell(value: f64) -> String {
    if value.is_nan() { String::new() } else { value.to_string() }
}

/// Reads a quantity from a table whose header has the column; NaN for an empty cell.
///
/// # Errors
/// If the cell has no finite number, or the quantity must be positive and is not.
pub(crate) fn read_cell(
    row: &TableRow<'_>,
    column: &str,
    is_positive: bool,
) -> Result<f64, InputError> {
    match row.text(column) {
        "" => Ok(f64::NAN),
        _ if is_positive => row.positive(column),
        _ => row.number(column),
    }
}

/// Returns a warning for each quantity that some of the specimens lack. `rows` are the quantities of the specimens.
pub(crate) fn missing_quantities(quantities: &[Quantity], rows: &[Vec<f64>]) -> Vec<String> {
    let all = rows.len();
    let warning = |(m, quantity): (usize, &Quantity)| {
        let with = rows.iter().filter(|row| !row[m].is_nan()).count();
        let lack = match all - with {
            0 => return None,
            1 => "1 specimen lacks it".to_owned(),
            several => format!("{several} specimens lack it"),
        };
        let few = match with {
            1 => ". Its scatter between specimens is that of the prior",
            _ => "",
        };
        Some(format!("{quantity} is compared for {with} of {all} specimens, because {lack}{few}."))
    };
    quantities.iter().enumerate().filter_map(warning).collect()
}

/// Returns an error if a quantity has the same value for all specimens, up to rounding. The covariance of the specimens is
/// then singular, and the intervals would be too narrow. `values` has a row of quantities for each specimen.
pub(crate) fn check_scatter(
    table: &Path,
    quantities: &[Quantity],
    values: &[Vec<f64>],
) -> Option<InputError> {
    // a specimen can lack a quantity, whose value is then NaN
    let recorded = |m: usize| values.iter().map(move |row| row[m]).filter(|value| !value.is_nan());
    let has_no_scatter = |m: &usize| {
        let column = || recorded(*m);
        let low = column().fold(f64::INFINITY, f64::min);
        let high = column().fold(f64::NEG_INFINITY, f64::max);
        column().count() > 1 && high - low <= NO_SCATTER * low.abs().max(high.abs())
    };
    let m = (0..quantities.len()).find(has_no_scatter)?;
    let count = recorded(m).count();
    let value = recorded(m).next()?;
    let problem = format!(
        "is the value of all {count} specimens up to rounding, so that their scatter cannot be estimated"
    );
    let help = "Check whether one test was entered several times. Otherwise state the values with more digits, remove the \
                quantity from qoi.quantities, or, for virtual specimens, give them scatter or noise.";
    let location = format!("column {}", quantities[m].column());
    Some(InputError::new(table, location, value.to_string(), problem, help))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::qoi::{ForceAt, PeakForce};

    #[test]
    fn a_curve_gives_the_quantities_that_it_reaches() {
        let displacement_mm: Vec<f64> = (0..=8).map(|i| 0.01 * f64::from(i)).collect();
        let force_n = displacement_mm.iter().map(|u| 2000.0 * u - 10_000.0 * u * u).collect();
        let curve = TestCurve::new(displacement_mm, force_n);
        let force = |micrometres| Quantity::new(ForceAt::micrometres(micrometres).unwrap());
        let quantities = [force(50), Quantity::new(PeakForce), force(90)];
        let measured = MeasuredQuantities::of(&curve, 0.3, &quantities);
        assert!((measured.values[0] - 75.0).abs() < 0.01, "{:?}", measured.values);
        assert!(measured.values[1..].iter().all(|value| value.is_nan()));
        assert_eq!(measured.missing[0].0, quantities[1]);
        assert!(measured.missing[1].1.to_string().contains("does not reach 0.0900 mm"));
        assert!(measured.unusable().is_none());
        let nothing = MeasuredQuantities::of(&curve, 0.3, &quantities[1..]);
        assert!(nothing.unusable().is_some_and(|reason| reason.to_string().starts_with("no peak")));
    }

    #[test]
    fn missing_quantities_are_counted() {
        let force = |micrometres| Quantity::new(ForceAt::micrometres(micrometres).unwrap());
        let quantities = [Quantity::new(PeakForce), force(50), force(60)];
        let nan = f64::NAN;
        let rows = [vec![1.0, 2.0, nan], vec![1.0, nan, 3.0], vec![1.0, 2.0, nan]];
        let found = missing_quantities(&quantities, &rows);
        assert_eq!(
            found,
            [
                "force-at-0.05-mm is compared for 2 of 3 specimens, because 1 specimen lacks it.",
                "force-at-0.06-mm is compared for 1 of 3 specimens, because 2 specimens lack it. Its scatter between \
                 specimens is that of the prior.",
            ]
        );
    }

    fn quantity(name: &str) -> Quantity {
        toml::Value::from(name).try_into().unwrap()
    }

    #[test]
    fn quantities_without_scatter_are_refused() {
        let quantities = [quantity("slope"), quantity("peak-force")];
        let check = |values: &[[f64; 2]]| {
            let rows: Vec<Vec<f64>> = values.iter().map(|row| row.to_vec()).collect();
            check_scatter(Path::new("specimens.csv"), &quantities, &rows)
        };
        assert!(check(&[[1500.0, 150.0], [1501.0, 150.001]]).is_none());
        assert!(check(&[[1500.0, 150.0]]).is_none());
        let error = check(&[[1500.0, 150.0], [1501.0, 150.0 + 1e-7], [1500.0, 150.0]]).unwrap();
        let text = error.to_string();
        for part in ["specimens.csv", "peak_force_N = 150", "all 3 specimens", "qoi.quantities"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(check(&[[0.0, 1.0], [0.0, 2.0]]).is_some());
    }
}
