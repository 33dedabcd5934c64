//! Runs that come in groups: how much of their scatter is that of the groups, and what that leaves open.
//!
//! Runs on one specimen share how it deviates from the others. With b_j ~ N(0, B) for each of n groups and
//! e_i ~ N(0, W) for each of N runs, on the outputs' scales,
//!
//! Y = Ψ C + Z b + E,
//!
//! where Z (runs × groups) is 1 where a run is of a group. Least squares give Ĉ = C + (ΨᵀΨ)⁻¹Ψᵀ(Z b + E), so that the
//! fit at x errs by the covariance
//!
//! W h(x) + B g(x), with h = ψᵀ(ΨᵀΨ)⁻¹ψ and g = |ZᵀΨ(ΨᵀΨ)⁻¹ψ|².
//!
//! More runs on the same groups make h small, but not g: of a constant g = Σ (N_j/N)², which is 1/n for groups of the same
//! size N/n, and it is larger towards the ends of an input that all runs of a group have in common. With a group
//! for each run g = h, and the covariance is (B + W) h, that of independent runs.
//!
//! B and W are those of moments (Henderson's third method; for a constant alone the analysis of variance): with
//! R = (I − H)Y, Z̃ = (I − H)Z, r = rank Z̃ and P the projector on Z̃,
//!
//! W = Rᵀ(I − P)R/(N − T − r) for T terms, B = (RᵀPR − r W)/|Z̃|²_F.
//!
//! For groups of the same size and a constant this is B = (MSB − MSW)/(N/n). Where too few runs are left for W
//! all scatter is taken to be that of the groups. Negative parts of B are cut.
//!
//! References: Henderson (1953), doi:10.2307/3001853; Searle, Casella & McCulloch (1992), *Variance Components*, ch. 5.

use faer::{Mat, Side};
use serde::{Deserialize, Serialize};

use crate::coefficients::CoefficientPosterior;
use crate::dataset::{Dataset, check_count};
use crate::error::SurrogateError;
use crate::fit::PceFit;

/// What is left of a column's square beside those before it, below which it is one of them.
const DEPENDENT: f64 = 1e-10;

/// What runs in groups leave open of an expansion.
///
/// ```
/// use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, GroupedRuns, Input};
/// let inputs = vec![Input::new("a", 0.0, 1.0)?];
/// let mut runs = Dataset::new(inputs.clone(), vec!["f".into()], "three specimens in turn")?;
/// let groups: Vec<usize> = (0..30).map(|i| i % 3).collect();
/// for (x, group) in DesignMethod::LatinHypercube.sample(&inputs, 30, 1)?.iter().zip(&groups) {
///     runs.push(x, &[3.0 + x[0] + [0.1, -0.02, 0.04][*group]])?;
/// }
/// let fit = DynPce::fit(&runs, &FitOptions::default())?;
/// let found = GroupedRuns::of(&fit, &runs, &groups)?;
/// // that all runs count alike would make the line three times as sure
/// let at = fit.pce.value(&[0.5])?;
/// let sure = fit.coefficients.error(&[0.5], &at)?[0][0];
/// assert!(found.between.error(&[0.5], &at)?[0][0] > 5.0 * sure);
/// # Ok::<(), surrogate::SurrogateError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct GroupedRuns {
    /// What runs leave open: W and the leverage h.
    pub within: CoefficientPosterior,
    /// What groups leave open: B and, in place of the leverage, g. Its degrees of freedom are those that B is
    /// known from.
    pub between: CoefficientPosterior,
    /// Number of groups.
    pub groups: usize,
}

impl GroupedRuns {
    /// Of the runs that a fit was made from; `groups` has the number of the group of each.
    ///
    /// Where derivatives were fitted too, all scatter is taken to be that of the groups: the errors of a run's value
    /// and derivatives hang together and tell no W.
    ///
    /// # Errors
    /// Another number of runs; one group; groups that the terms tell apart, so that nothing is left for B.
    pub fn of(fit: &PceFit, data: &Dataset, groups: &[usize]) -> Result<Self, SurrogateError> {
        check_count("groups of runs", data.len(), groups.len())?;
        check_count("runs of the fit", fit.report.rows, data.len())?;
        let mut names = groups.to_vec();
        names.sort_unstable();
        names.dedup();
        let (runs, count) = (data.len(), names.len());
        let at_least = |what, expected, found| match found < expected {
            true => Err(SurrogateError::Count { what, expected, found }),
            false => Ok(()),
        };
        at_least("groups of runs, at least", 2, count)?;

        let open = &fit.coefficients;
        let terms = open.factor().len();
        let rows: Vec<Vec<f64>> = data.rows().map(|(x, _)| open.basis(x)).collect();
        let psi = Mat::from_fn(runs, terms, |i, j| rows[i][j]);
        let factor = Mat::from_fn(terms, open.factor()[0].len(), |i, j| open.factor()[i][j]);
        let place = |i: usize| names.binary_search(&groups[i]).unwrap_or_default();
        let z = Mat::from_fn(runs, count, |i, j| f64::from(u8::from(place(i) == j)));
        // what a group's deviation does to the coefficients, and what of it is left in the residuals
        let taken = &factor * (factor.transpose() * (psi.transpose() * &z));
        let left = &z - &psi * &taken;
        let residuals = residuals(fit, data, &psi);
        let outputs = residuals.ncols();

        let directions = orthonormal(&left, &z);
        let rank = directions.ncols();
        at_least("degrees of freedom between groups, at least", 1, rank)?;
        let total = residuals.transpose() * &residuals;
        let within_freedom = open.freedom() - rank as f64;
        let has_derivatives = data.inputs_with_derivatives() > 0;
        let (own, explained) = match !has_derivatives && within_freedom >= outputs as f64 {
            true => {
                let along = directions.transpose() * &residuals;
                let explained = along.transpose() * &along;
                let own = (&total - &explained) * faer::Scale(within_freedom.recip());
                (own, explained)
            }
            false => (Mat::zeros(outputs, outputs), total.clone()),
        };
        let weight = left.squared_norm_l2();
        let between = (&explained - &own * faer::Scale(rank as f64)) * faer::Scale(weight.recip());
        let between = without_negative_parts(&between, &total);

        let indices = || open.estimate().terms().iter().map(|(index, _)| index.clone());
        let by_rows = |rows: &Mat<f64>| -> Vec<(Vec<u8>, Vec<f64>)> {
            let row = |j: usize| rows.row(j).iter().copied().collect();
            indices().enumerate().map(|(j, index)| (index, row(j))).collect()
        };
        let of = |rows: &Mat<f64>, scatter: &Mat<f64>, freedom: f64| {
            CoefficientPosterior::new(open.estimate(), by_rows(rows), by_entries(scatter), freedom)
        };
        Ok(Self {
            within: of(&factor, &own, within_freedom.max(0.0))?,
            between: of(&taken, &between, rank as f64)?,
            groups: count,
        })
    }
}

/// The residuals of the values (runs × outputs) on the outputs' scales. Where terms were chosen by the data, which
/// explain some of the noise, they are as large as those of cross-validation.
fn residuals(fit: &PceFit, data: &Dataset, psi: &Mat<f64>) -> Mat<f64> {
    let open = &fit.coefficients;
    let (terms, scales) = (open.estimate().terms(), open.estimate().output_scales());
    let larger = |m: usize| {
        let own = fit.report.residual_covariance[m][m];
        match data.inputs_with_derivatives() == 0 && own > 0.0 {
            true => (open.own_scatter()[m][m] / own).sqrt(),
            false => 1.0,
        }
    };
    let factors: Vec<f64> = (0..scales.len()).map(larger).collect();
    Mat::from_fn(data.len(), scales.len(), |i, m| {
        let fitted: f64 = terms.iter().enumerate().map(|(j, (_, c))| psi[(i, j)] * c[m]).sum();
        factors[m] * (scales[m].coordinate(data.row(i).1[m]) - fitted)
    })
}

/// An orthonormal basis of the columns of `left`, each of which is what is left of the one of `whole`.
fn orthonormal(left: &Mat<f64>, whole: &Mat<f64>) -> Mat<f64> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    for j in 0..left.ncols() {
        let mut column: Vec<f64> = left.col(j).iter().copied().collect();
        // twice is enough (Kahan)
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

/// A symmetric matrix without its negative eigenvalues, outputs being compared by their own scatter: units do
/// not matter.
fn without_negative_parts(matrix: &Mat<f64>, scatter: &Mat<f64>) -> Mat<f64> {
    let size = matrix.nrows();
    let unit: Vec<f64> = (0..size).map(|m| scatter[(m, m)].sqrt()).collect();
    // an output that is followed exactly has no scatter at all
    let relative = |i: usize, j: usize| {
        let units = unit[i] * unit[j];
        if units > 0.0 { matrix[(i, j)] / units } else { 0.0 }
    };
    let scaled = Mat::from_fn(size, size, relative);
    let Ok(eigen) = scaled.self_adjoint_eigen(Side::Lower) else {
        // never of finite numbers; the diagonal is on the safe side
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
