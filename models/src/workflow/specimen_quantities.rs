//! Quantities of measured specimens at the size of the mesh, and file names for messages about specimens.

use std::path::{Path, PathBuf};

use super::mesh_scale::{MeshScale, MeshSize};
use crate::case::QoiComparison;
use crate::error::InputError;
use crate::experiment::Specimen;
use crate::qoi::{QoiError, Qois, Quantity};

/// Largest ratio of the range of a quantity over the specimens to its largest value that counts as no scatter. Load cells
/// resolve about 1e-4 of their range.
const NO_SCATTER: f64 = 1e-6;

/// File names for messages about specimens.
pub(super) struct SpecimenNames<'a> {
    pub(super) table: &'a Path,
    /// Curve file of a specimen.
    pub(super) curve: &'a dyn Fn(&str) -> PathBuf,
}

/// Computes the quantities of a specimen's curve, scaled to the size of the mesh, if there is one.
///
/// # Errors
/// Fails if a quantity cannot be computed from the curve.
pub(super) fn compared(
    specimen: &Specimen,
    mesh: Option<MeshSize>,
    qoi: &QoiComparison,
    quantities: &[Quantity],
) -> Result<Vec<f64>, QoiError> {
    let fraction = specimen.slope_fraction.unwrap_or(qoi.slope_fraction);
    let curve = MeshScale::of(specimen, mesh).apply(&specimen.curve);
    Qois::values_of(&curve, fraction, quantities)
}

/// Returns an error if a quantity has the same value for all specimens, up to rounding. The covariance of the specimens is
/// then singular, and the intervals would be too narrow. `values` has a row of quantities for each specimen.
pub(super) fn check_scatter(
    table: &Path,
    quantities: &[Quantity],
    values: &[Vec<f64>],
) -> Option<InputError> {
    let ([first, _, ..], count) = (values, values.len()) else { return None };
    let has_no_scatter = |m: &usize| {
        let column = || values.iter().map(|row| row[*m]);
        let low = column().fold(f64::INFINITY, f64::min);
        let high = column().fold(f64::NEG_INFINITY, f64::max);
        high - low <= NO_SCATTER * low.abs().max(high.abs())
    };
    let m = (0..quantities.len()).find(has_no_scatter)?;
    let problem = format!(
        "is the value of all {count} specimens up to rounding, so that their scatter cannot be estimated"
    );
    let help = "Check whether one test was entered several times. Otherwise state the values with more digits, remove the \
                quantity from qoi.quantities, or, for virtual specimens, give them scatter or noise.";
    let location = format!("column {}", quantities[m].column());
    Some(InputError::new(table, location, first[m].to_string(), problem, help))
}

#[cfg(test)]
mod tests {
    use super::*;

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
