//! Information of a further test that has the same errors as the present test.

use nalgebra::{Cholesky, DMatrix};

/// Mean response of a test: derivatives with respect to the parameters, quantities × parameters, and precision of the
/// mean of the tested specimens without the shared error, quantities × quantities.
pub(super) struct MeanResponse {
    pub(super) jacobian: DMatrix<f64>,
    pub(super) precision: DMatrix<f64>,
}

/// Returns Σ_k Hᵀ Σ_k⁻¹ H over specimens: H selects the recorded quantities of a specimen, and Σ_k is their part of the
/// covariance `scatter`. `None` if a covariance is not positive definite.
pub(super) fn precision_of(
    scatter: &DMatrix<f64>,
    recorded: &[Vec<usize>],
) -> Option<DMatrix<f64>> {
    let size = scatter.nrows();
    let mut precision = DMatrix::zeros(size, size);
    for recorded in recorded {
        let part = scatter.select_rows(recorded).select_columns(recorded);
        let inverse = Cholesky::new(part)?.inverse();
        for (a, &i) in recorded.iter().enumerate() {
            recorded.iter().enumerate().for_each(|(b, &j)| precision[(i, j)] += inverse[(a, b)]);
        }
    }
    Some(precision)
}

/// Returns the information that the test `other` adds to the present test, if both have the same error with covariance
/// `shared`. `quantities` has the index in the present test of each quantity of `other`. `None` if a system is singular.
///
/// The means are J₀θ + e + ε₀ and J₁θ + H e + ε₁: e is the error with covariance S, ε have the precisions P, and H selects
/// the quantities of `other`. With both stacked, the information is Jᵀ (1 + P G S Gᵀ)⁻¹ P J, where G stacks 1 and H.
pub(super) fn gained(
    present: &MeanResponse,
    other: &MeanResponse,
    shared: &DMatrix<f64>,
    quantities: &[usize],
) -> Option<DMatrix<f64>> {
    let (size, more) = (present.precision.nrows(), other.precision.nrows());
    let parameters = present.jacobian.ncols();
    let mut jacobian = DMatrix::zeros(size + more, parameters);
    jacobian.rows_mut(0, size).copy_from(&present.jacobian);
    jacobian.rows_mut(size, more).copy_from(&other.jacobian);
    let mut precision = DMatrix::zeros(size + more, size + more);
    precision.view_mut((0, 0), (size, size)).copy_from(&present.precision);
    precision.view_mut((size, size), (more, more)).copy_from(&other.precision);
    let index = |row: usize| if row < size { row } else { quantities[row - size] };
    let common = DMatrix::from_fn(size + more, size + more, |a, b| shared[(index(a), index(b))]);
    let both = information(&jacobian, &precision, &common)?;
    Some(both - information(&present.jacobian, &present.precision, shared)?)
}

/// Jᵀ (P⁻¹ + S)⁻¹ J = Jᵀ (1 + P S)⁻¹ P J for the precision P, which may be singular.
pub(super) fn information(
    jacobian: &DMatrix<f64>,
    precision: &DMatrix<f64>,
    shared: &DMatrix<f64>,
) -> Option<DMatrix<f64>> {
    let size = precision.nrows();
    let within = DMatrix::identity(size, size) + precision * shared;
    Some(jacobian.transpose() * within.lu().solve(&(precision * jacobian))?)
}
