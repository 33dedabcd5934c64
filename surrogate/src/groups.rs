//! Variance components of runs in groups: scatter between groups, scatter within a group, and the resulting
//! errors of the fit.
//!
//! Runs on the same specimen form a group. Runs of a group share the deviation of the specimen from the mean response.
//! With the deviation b_j ~ N(0, B) for each of n groups and the error e_i ~ N(0, W) for each of N runs, on the
//! outputs' scales, the model is
//!
//! Y = Ψ C + Z b + E,
//!
//! where Ψ contains the values of the basis polynomials at the runs, C the coefficients, and Z (runs × groups) is 1
//! where a run belongs to a group and 0 elsewhere. The least squares estimate is Ĉ = C + (ΨᵀΨ)⁻¹Ψᵀ(Z b + E), so that
//! the error of the fit at x has the covariance
//!
//! W h(x) + B g(x), with h = ψᵀ(ΨᵀΨ)⁻¹ψ and g = |ZᵀΨ(ΨᵀΨ)⁻¹ψ|².
//!
//! More runs on the same groups reduce h but not g. If the expansion is a constant, g = Σ (N_j/N)² for groups of N_j
//! runs, which is 1/n for groups of equal size N/n. If all runs of a group have the same value of an input, g
//! increases towards the ends of that input's interval. If each run is its own group, g = h, and the covariance is (B
//! + W) h, as for independent runs.
//!
//! B and W are estimated by the method of moments (Henderson's third method; for a constant expansion, this is the
//! analysis of variance). With the hat matrix H = Ψ(ΨᵀΨ)⁻¹Ψᵀ, R = (I − H)Y, Z̃ = (I − H)Z, r = rank Z̃ and the
//! projector P onto the columns of Z̃,
//!
//! W = Rᵀ(I − P)R/(N − T − r) for T terms, B = (RᵀPR − r W)/|Z̃|²_F.
//!
//! For groups of equal size and a constant expansion, B = (MSB − MSW)/(N/n), with the mean squares between groups
//! (MSB) and within groups (MSW). If too few degrees of freedom remain for W, W is set to 0 and all scatter is
//! attributed to the groups. Negative eigenvalues of B are set to 0.
//!
//! References: Henderson (1953), doi:10.2307/3001853; Searle, Casella & McCulloch (1992), *Variance
//! Components*, ch. 5.

use faer::{Mat, Side};
use serde::{Deserialize, Serialize};

use crate::coefficients::posterior::CoefficientPosterior;
use crate::dataset::{Dataset, check_count};
use crate::error::SurrogateError;
use crate::fit::options::PceFit;

/// Relative squared norm below which a column is linearly dependent: orthogonalisation against the preceding columns
/// reduces the squared norm of the column to less than this fraction.
const DEPENDENT: f64 = 1e-10;

/// Errors of a fit to runs in groups, separated into scatter within and between groups.
///
/// ```
/// use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, GroupedRuns, Input};
/// let inputs = vec![Input::new("a", 0.0, 1.0)?];
/// let mut runs = Dataset::new(inputs.clone(), vec!["f".into()], "three specimens")?;
/// let groups: Vec<usize> = (0..30).map(|i| i % 3).collect();
/// for (x, group) in DesignMethod::LatinHypercube.sample(&inputs, 30, 1)?.iter().zip(&groups) {
///     runs.push(x, &[3.0 + x[0] + [0.1, -0.02, 0.04][*group]])?;
/// }
/// let fit = DynPce::fit(&runs, &FitOptions::default())?;
/// let errors = GroupedRuns::of(&fit, &runs, &groups)?;
/// // the error of the line is larger than the error that independent runs would have
/// let at = fit.pce.value(&[0.5])?;
/// let independent = fit.coefficients.error(&[0.5], &at)?[0][0];
/// assert!(errors.between.error(&[0.5], &at)?[0][0] > 5.0 * independent);
/// # Ok::<(), surrogate::SurrogateError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GroupedRuns {
    /// Error of the fit from the scatter within groups. The covariance of this error at x is W h(x), with the
    /// covariance W of the scatter within groups and the leverage h.
    pub within: CoefficientPosterior,
    /// Error of the fit from the scatter between groups. The covariance of this error at x is B g(x), with the
    /// covariance B of the scatter between groups and the function g, which is defined on the page of this module. The
    /// degrees of freedom of this posterior are the degrees of freedom of the estimate of B.
    pub between: CoefficientPosterior,
    /// Number of groups.
    pub groups: usize,
}

impl GroupedRuns {
    /// Estimates the variance components from the runs of a fit. `groups` contains the group number of each run.
    ///
    /// If derivatives were fitted too, all scatter is attributed to the groups: the errors within a run are
    /// correlated, so that the scatter within groups cannot be estimated.
    ///
    /// # Errors
    /// If the number of runs is wrong, there is only one group, or the terms explain all differences between groups,
    /// so that the scatter between groups cannot be estimated.
    pub fn of(fit: &PceFit, data: &Dataset, groups: &[usize]) -> Result<Self, SurrogateError> {
        check_count("groups of runs", data.len(), groups.len())?;
        check_count("runs of the fit", fit.report.rows, data.len())?;
        let mut names = groups.to_vec();
        names.sort_unstable();
        names.dedup();
        let (runs, count) = (data.len(), names.len());
        let at_least = |what, expected, actual| match actual < expected {
            true => Err(SurrogateError::Count { what, expected, found: actual }),
            false => Ok(()),
        };
        at_least("or more groups of runs", 2, count)?;

        let posterior = &fit.coefficients;
        let terms = posterior.factor().len();
        let rows: Vec<Vec<f64>> = data.rows().map(|(x, _)| posterior.basis(x)).collect();
        let psi = Mat::from_fn(runs, terms, |i, j| rows[i][j]);
        let factor =
            Mat::from_fn(terms, posterior.factor()[0].len(), |i, j| posterior.factor()[i][j]);
        let group = |i: usize| names.binary_search(&groups[i]).unwrap_or_default();
        let z = Mat::from_fn(runs, count, |i, j| f64::from(u8::from(group(i) == j)));
        // effect of a group's deviation on the coefficients, and the part of the deviation that remains in
        // the residuals
        let taken = &factor * (factor.transpose() * (psi.transpose() * &z));
        let left = &z - &psi * &taken;
        let residuals = residuals(fit, data, &psi);
        let outputs = residuals.ncols();

        let directions = orthonormal(&left, &z);
        let rank = directions.ncols();
        at_least("or more degrees of freedom between groups", 1, rank)?;
        let total = residuals.transpose() * &residuals;
        let within_freedom = posterior.freedom() - rank as f64;
        let has_derivatives = data.inputs_with_derivatives() > 0;
        let (within, explained) = match !has_derivatives && within_freedom >= outputs as f64 {
            true => {
                let along = directions.transpose() * &residuals;
                let explained = along.transpose() * &along;
                let within = (&total - &explained) * faer::Scale(within_freedom.recip());
                (within, explained)
            }
            false => (Mat::zeros(outputs, outputs), total.clone()),
        };
        let weight = left.squared_norm_l2();
        let between =
            (&explained - &within * faer::Scale(rank as f64)) * faer::Scale(weight.recip());
        let between = without_negative_parts(&between, &total);

        let indices = || posterior.estimate().terms().iter().map(|(index, _)| index.clone());
        let by_rows = |rows: &Mat<f64>| -> Vec<(Vec<u8>, Vec<f64>)> {
            let row = |j: usize| rows.row(j).iter().copied().collect();
            indices().enumerate().map(|(j, index)| (index, row(j))).collect()
        };
        let component = |rows: &Mat<f64>, scatter: &Mat<f64>, freedom: f64| {
            CoefficientPosterior::new(
                posterior.estimate(),
                by_rows(rows),
                by_entries(scatter),
                freedom,
            )
        };
        Ok(Self {
            within: component(&factor, &within, within_freedom.max(0.0))?,
            between: component(&taken, &between, rank as f64)?,
            groups: count,
        })
    }
}

/// Returns the residuals of the values (runs × outputs) on the outputs' scales. Sparse terms were chosen with the
/// data and explain some of the noise; residuals of a fit with sparse terms are therefore scaled up to the size of
/// the cross-validation residuals.
fn residuals(fit: &PceFit, data: &Dataset, psi: &Mat<f64>) -> Mat<f64> {
    let posterior = &fit.coefficients;
    let (terms, scales) = (posterior.estimate().terms(), posterior.estimate().output_scales());
    let larger = |m: usize| {
        let variance = fit.report.residual_covariance[m][m];
        match data.inputs_with_derivatives() == 0 && variance > 0.0 {
            true => (posterior.scatter_on_scales()[m][m] / variance).sqrt(),
            false => 1.0,
        }
    };
    let factors: Vec<f64> = (0..scales.len()).map(larger).collect();
    Mat::from_fn(data.len(), scales.len(), |i, m| {
        let fitted: f64 = terms.iter().enumerate().map(|(j, (_, c))| psi[(i, j)] * c[m]).sum();
        factors[m] * (scales[m].coordinate(data.row(i).1[m]) - fitted)
    })
}

/// Returns an orthonormal basis of the columns of `left`. Column j of `left` is a projection of column j of `whole`;
/// the tolerance for linear dependence is relative to the norm of column j of `whole`.
fn orthonormal(left: &Mat<f64>, whole: &Mat<f64>) -> Mat<f64> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for j in 0..left.ncols() {
        let mut column: Vec<f64> = left.col(j).iter().copied().collect();
        // one repetition makes the basis orthogonal to working precision (Kahan's "twice is enough")
        for _ in 0..2 {
            for before in &basis {
                let along: f64 = column.iter().zip(before).map(|(a, b)| a * b).sum();
                column.iter_mut().zip(before).for_each(|(a, b)| *a -= along * b);
            }
        }
        let square: f64 = column.iter().map(|a| a * a).sum();
        if square > DEPENDENT * whole.col(j).squared_norm_l2() {
            column.iter_mut().for_each(|a| *a /= square.sqrt());
            basis.push(column);
        }
    }
    Mat::from_fn(left.nrows(), basis.len(), |i, j| basis[j][i])
}

/// Sets the negative eigenvalues of a symmetric matrix to 0. Outputs are scaled by their scatter first, so
/// that the result does not depend on their units.
fn without_negative_parts(matrix: &Mat<f64>, scatter: &Mat<f64>) -> Mat<f64> {
    let size = matrix.nrows();
    let unit: Vec<f64> = (0..size).map(|m| scatter[(m, m)].sqrt()).collect();
    // an output that the polynomial fits exactly has no scatter
    let relative = |i: usize, j: usize| {
        let units = unit[i] * unit[j];
        if units > 0.0 { matrix[(i, j)] / units } else { 0.0 }
    };
    let scaled = Mat::from_fn(size, size, relative);
    let Ok(eigen) = scaled.self_adjoint_eigen(Side::Lower) else {
        // the decomposition does not fail for finite numbers; if it fails, keep only the diagonal,
        // which is a cautious estimate
        return Mat::from_fn(size, size, |i, j| if i == j { matrix[(i, i)].max(0.0) } else { 0.0 });
    };
    let (vectors, values) = (eigen.U(), eigen.S());
    Mat::from_fn(size, size, |i, j| {
        let part = |k: usize| values[k].max(0.0) * vectors[(i, k)] * vectors[(j, k)];
        unit[i] * unit[j] * (0..size).map(part).sum::<f64>()
    })
}

fn by_entries(matrix: &Mat<f64>) -> Vec<Vec<f64>> {
    (0..matrix.nrows()).map(|i| matrix.row(i).iter().copied().collect()).collect()
}
