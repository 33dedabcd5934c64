//! Hessian of a log density from differences of its gradient.

use nalgebra::DMatrix;

use crate::density::Rejection;
use crate::model::erased::Evaluator;

/// Difference step relative to the width 1/√curvature of the density along a coordinate. Truncation and rounding errors
/// are then of order 10⁻⁸.
const RELATIVE_STEP: f64 = 1e-4;

/// Negative Hessian `−∂² ln p / ∂yᵢ∂yⱼ` at `y`, by symmetrised central differences.
pub(super) fn negative_hessian(
    density: &mut dyn Evaluator,
    y: &[f64],
) -> Result<DMatrix<f64>, Rejection> {
    let d = y.len();
    let mut hessian = DMatrix::zeros(d, d);
    for i in 0..d {
        let guess = RELATIVE_STEP * y[i].abs().max(1.0);
        let curvature = difference(density, y, i, guess)?[i].abs();
        let step = (RELATIVE_STEP / curvature.sqrt()).clamp(1e-4 * guess, 100.0 * guess);
        let column = difference(density, y, i, step)?;
        hessian.column_mut(i).copy_from_slice(&column);
    }
    Ok((&hessian + hessian.transpose()) * 0.5)
}

/// Column i of the negative Hessian: `−(∇ln p(y + h eᵢ) − ∇ln p(y − h eᵢ)) / 2h`.
fn difference(
    density: &mut dyn Evaluator,
    y: &[f64],
    i: usize,
    step: f64,
) -> Result<Vec<f64>, Rejection> {
    let mut point = y.to_vec();
    let (mut above, mut below) = (vec![0.0; y.len()], vec![0.0; y.len()]);
    point[i] = y[i] + step;
    let upper = point[i];
    density.gradient(&point, &mut above)?;
    point[i] = y[i] - step;
    let width = upper - point[i];
    density.gradient(&point, &mut below)?;
    Ok(above.iter().zip(&below).map(|(a, b)| (b - a) / width).collect())
}
