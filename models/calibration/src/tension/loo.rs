//! Leave-one-out cross-validation over the specimens.

use ppl::diagnostics::Loo;
use ppl::prelude::*;
use ppl::{DomainError, Posterior};

use super::{HardeningLaw, TensionError, TensionTest, calibrate};

/// Parameters of the population at one draw of the posterior.
pub(super) struct Population {
    pub(super) mean: [f64; 3],
    pub(super) factor: CholeskyFactor<f64, 3>,
    pub(super) sd_mpa: f64,
}

/// Least-squares fit of a law to one curve.
pub(super) struct CurveFit {
    readings: f64,
    /// Logarithms of the fitted parameters.
    ln_own: [f64; 3],
    /// Sum of the squared residuals, Σ (σ − law)², MPa².
    squares: f64,
    /// Cholesky factor of (JᵀJ)⁻¹, where J contains the derivatives of the law at the points with respect to the
    /// logarithms of the parameters.
    unit: DynCholeskyFactor<f64>,
}

/// Computes how well each specimen is predicted from the other specimens. `posterior` is a calibration of the law
/// `L` to all specimens.
///
/// A whole curve is left out, because a further specimen has a whole curve. Leaving out single points would test
/// interpolation only, because the neighbours of a point predict it. The density of the curve y_k is p(y_k | μ, s, R,
/// sd) = ∫ p(y_k | θ, sd) N(ln θ; μ, Σ) d ln θ with Σ = diag(s) R diag(s). For this integral, the law is linearised
/// about the least-squares fit of the curve. Draws are reweighted (PSIS). If Pareto's k of a specimen is above the
/// threshold, `sampler` runs again without the specimen, and the result has −∞ instead of k.
/// # Errors
/// If there are fewer than 25 draws, the sampler cannot start, or a curve does not determine three parameters.
///
/// # Reference
/// Merkle, Furr & Rabe-Hesketh (2019), doi:10.1007/s11336-019-09679-0, for leaving out groups by their
/// marginal likelihood.
pub fn loo_by_specimen<L: HardeningLaw>(
    posterior: &Posterior,
    tests: &[TensionTest],
    sampler: &Nuts<'_>,
) -> Result<Loo, TensionError> {
    let drawn = populations(posterior)?;
    let fits = tests.iter().enumerate();
    let fits: Vec<CurveFit> =
        fits.map(|(k, test)| fit_of::<L>(posterior, k, test)).collect::<Result<_, _>>()?;
    let mut rows = Vec::with_capacity(drawn.len() * tests.len());
    for population in &drawn {
        for fit in &fits {
            rows.push(ln_density(fit, population)?);
        }
    }
    let group = &posterior.posterior;
    let mut loo = Loo::new(group.chains, group.draws, tests.len(), &rows)?;
    for k in loo.unreliable() {
        let others: Vec<TensionTest> =
            tests.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, t)| t.clone()).collect();
        let without = populations(&calibrate::<L>(&others, sampler)?)?;
        let terms: Vec<f64> =
            without.iter().map(|p| ln_density(&fits[k], p)).collect::<Result<_, _>>()?;
        loo = loo.refitted(k, ln_sum_exp(&terms) - (terms.len() as f64).ln());
    }
    Ok(loo)
}

pub(super) fn populations(posterior: &Posterior) -> Result<Vec<Population>, DomainError> {
    let draws_of = |name: &str| posterior.values(name).map_or(&[][..], |values| &values.data[..]);
    let (means, scatters) =
        (draws_of("ln_mean").chunks_exact(3), draws_of("scatter").chunks_exact(3));
    let draws = means.zip(scatters).zip(draws_of("corr").chunks_exact(9)).zip(draws_of("sd"));
    let mut all = Vec::new();
    for (((mean, scatter), corr), &sd_mpa) in draws {
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| scatter[i] * corr[3 * i + j]));
        let mean = [mean[0], mean[1], mean[2]];
        all.push(Population { mean, factor: CholeskyFactor::new(rows)?, sd_mpa });
    }
    Ok(all)
}

/// Fits a curve by the Gauss–Newton method, starting from the posterior mean of specimen `k`.
pub(super) fn fit_of<L: HardeningLaw>(
    posterior: &Posterior,
    k: usize,
    test: &TensionTest,
) -> Result<CurveFit, DomainError> {
    const STEPS: usize = 20;
    const DIFFERENCE: f64 = 1e-5;
    let ln_parameters = posterior.values("ln_own");
    let size = ln_parameters.map_or(1, |values| values.size().max(1));
    let draws = ln_parameters.map_or(&[][..], |values| &values.data[..]).chunks_exact(size);
    let n = draws.len() as f64;
    let mut ln_own: [f64; 3] =
        std::array::from_fn(|i| draws.clone().map(|row| row[3 * k + i]).sum::<f64>() / n);
    let stress = |ln: &[f64; 3], strain: f64| L::stress_mpa(&ln.map(f64::exp), strain);
    let slopes = |at: &[f64; 3], strain: f64| -> [f64; 3] {
        std::array::from_fn(|i| {
            let moved = |by: f64| std::array::from_fn(|j| at[j] + if i == j { by } else { 0.0 });
            (stress(&moved(DIFFERENCE), strain) - stress(&moved(-DIFFERENCE), strain))
                / (2.0 * DIFFERENCE)
        })
    };
    let mut factor = None;
    let mut squares = 0.0;
    for _ in 0..STEPS {
        let (mut normal, mut right) = (vec![vec![0.0; 3]; 3], [0.0; 3]);
        squares = 0.0;
        for point in &test.points {
            let gap = point.true_stress_mpa - stress(&ln_own, point.plastic_strain);
            let slopes = slopes(&ln_own, point.plastic_strain);
            squares += gap * gap;
            for i in 0..3 {
                right[i] += slopes[i] * gap;
                (0..3).for_each(|j| normal[i][j] += slopes[i] * slopes[j]);
            }
        }
        let inverse = inverse(&DynCholeskyFactor::of_covariance(&normal)?)?;
        for i in 0..3 {
            ln_own[i] += (0..3).map(|j| inverse[i][j] * right[j]).sum::<f64>();
        }
        factor = Some(DynCholeskyFactor::of_covariance(&inverse)?);
    }
    let unit = factor.ok_or_else(|| DomainError::new("no least-squares step"))?;
    Ok(CurveFit { readings: test.points.len() as f64, ln_own, squares, unit })
}

/// Computes (L Lᵀ)⁻¹ from the columns of L⁻¹.
fn inverse(factor: &DynCholeskyFactor<f64>) -> Result<Vec<Vec<f64>>, DomainError> {
    let column = |i: usize| {
        let unit: Vec<f64> = (0..3).map(|j| if i == j { 1.0 } else { 0.0 }).collect();
        factor.solve_lower(&unit)
    };
    let columns: Vec<Vec<f64>> = (0..3).map(column).collect::<Result<_, _>>()?;
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum();
    Ok((0..3).map(|i| (0..3).map(|j| product(&columns[i], &columns[j])).collect()).collect())
}

/// Computes ln ∫ p(y | θ, sd) N(ln θ; μ, Σ) d ln θ with the law linearised about the fit. The integral is a product of
/// two densities: the density of the residuals of the fit, and the density N(ln θ̂; μ, Σ + sd² (JᵀJ)⁻¹) of the fitted
/// parameters θ̂ in the population. J is the Jacobian of the law.
pub(super) fn ln_density(fit: &CurveFit, population: &Population) -> Result<f64, DomainError> {
    let variance = population.sd_mpa.powi(2);
    let unit_covariance = fit.unit.covariance();
    let scatter = population.factor.covariance();
    let both: Vec<Vec<f64>> = (0..3)
        .map(|i| (0..3).map(|j| scatter[i][j] + variance * unit_covariance[i][j]).collect())
        .collect();
    let about =
        MvNormalCholesky(population.mean.to_vec(), DynCholeskyFactor::of_covariance(&both)?);
    let volume: f64 = (0..3).map(|i| fit.unit.get(i, i).ln()).sum();
    let residuals = -0.5 * fit.squares / variance
        - 0.5 * (fit.readings - 3.0) * (std::f64::consts::TAU * variance).ln();
    Ok(residuals + volume + about.ln_density(&fit.ln_own.to_vec()))
}
