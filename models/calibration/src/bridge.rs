//! Marginal likelihood of a model (evidence) from its posterior draws, by bridge sampling.

use nalgebra::{Cholesky, DMatrix, DVector};
use ppl::diagnostics::ess_mean;
use ppl::{Chains, LogDensity};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Relative change of the estimate at which the iteration ends.
const TOLERANCE: f64 = 1e-10;
/// Limit of the number of iterations.
const MOST: usize = 1000;
/// Largest standard error of the logarithm of an estimate that is reliable.
const LARGEST_ERROR: f64 = 0.5;

/// Logarithm of the marginal likelihood p(y) = ∫ p(y | θ) p(θ) dθ of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MarginalLikelihood {
    /// ln p(y).
    pub ln: f64,
    /// Monte Carlo standard error of `ln`.
    pub error: f64,
}

/// Reason why a marginal likelihood cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BridgeError {
    /// The chains have too few draws.
    #[error("{draws} draws are too few for {dim} unknowns: raise calibration.draws")]
    FewDraws {
        /// Number of draws of all chains.
        draws: usize,
        /// Number of unknowns.
        dim: usize,
    },
    /// The covariance of the draws is not positive definite.
    #[error("the covariance of the draws is not positive definite")]
    Covariance,
    /// The estimate does not converge, or its error is large.
    #[error(
        "the draws and their normal approximation overlap too little: the standard error of ln p(y) is {error:.2}"
    )]
    Unreliable {
        /// Standard error of the logarithm.
        error: f64,
    },
}

/// Estimates the marginal likelihood of a density from its draws.
///
/// The first half of each chain determines a normal distribution g. With the second half (N₁ draws θ*) and as many draws θ~ of g
/// (N₂), the estimate r solves
///
/// r = [N₂⁻¹ Σ q(θ~)/(s₁ q(θ~) + s₂ r g(θ~))] / [N₁⁻¹ Σ g(θ*)/(s₁ q(θ*) + s₂ r g(θ*))],
///
/// where q is the density that is not normalised, s₁ = E/(E + N₂), s₂ = N₂/(E + N₂), and E is the effective size of the N₁ draws.
/// Everything is computed in the unconstrained coordinates of the sampler. `seed` is the seed of the draws of g.
///
/// # Errors
/// Too few draws, a covariance that is not positive definite, or a standard error of ln r above 0.5.
///
/// # Example
/// The density exp(−y²/2) has the integral √(2π):
/// ```
/// use breccia_calibration::marginal_likelihood;
/// use ppl::{LogDensity, Nuts, Rejection};
///
/// struct Normal;
/// impl LogDensity for Normal {
///     type Workspace = ();
///     fn dim(&self) -> usize {
///         1
///     }
///     fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
///         Ok(-0.5 * y[0] * y[0])
///     }
///     fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
///         g[0] = -y[0];
///         self.log_density(y, w)
///     }
/// }
///
/// let chains = Nuts::default().chains(2).draws(1000).seed(7).run(&Normal)?;
/// let found = marginal_likelihood(&Normal, &chains, 7).expect("enough draws");
/// let exact = 0.5 * (2.0 * std::f64::consts::PI).ln();
/// assert!((found.ln - exact).abs() < 4.0 * found.error);
/// # Ok::<(), ppl::SampleError>(())
/// ```
///
/// # References
/// Meng & Wong (1996), *Statistica Sinica* 6, 831–860: the estimate. Frühwirth-Schnatter (2004),
/// doi:10.1111/j.1368-423X.2004.00125.x: its error for correlated draws. Gronau et al. (2017), doi:10.1016/j.jmp.2017.09.005:
/// halves of the draws and effective size.
pub fn marginal_likelihood<D: LogDensity>(
    density: &D,
    chains: &Chains,
    seed: u64,
) -> Result<MarginalLikelihood, BridgeError> {
    let dim = density.dim();
    let length = chains.chains.iter().map(|chain| chain.draws.len() / dim.max(1)).min();
    let half = length.unwrap_or(0) / 2;
    let few = BridgeError::FewDraws { draws: 2 * half * chains.chains.len(), dim };
    if dim == 0 || half * chains.chains.len() < 10 * (dim + 1) {
        return Err(few);
    }
    let part = |first: usize| {
        chains.chains.iter().map(move |chain| &chain.draws[first * dim..(first + half) * dim])
    };
    let proposal = Proposal::of(part(0).flat_map(|draws| draws.chunks(dim)), dim)?;
    let mut workspace = D::Workspace::default();
    let mut ln_ratio = |y: &[f64]| {
        let ln_density = density.log_density(y, &mut workspace).unwrap_or(f64::NEG_INFINITY);
        ln_density - proposal.ln_density(y)
    };
    let posterior: Vec<Vec<f64>> =
        part(half).map(|draws| draws.chunks(dim).map(&mut ln_ratio).collect()).collect();
    let count = half * chains.chains.len();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let proposed: Vec<f64> = (0..count).map(|_| ln_ratio(&proposal.draw(&mut rng))).collect();
    let traces: Vec<&[f64]> = posterior.iter().map(Vec::as_slice).collect();
    let effective = ess_mean(&traces);
    let effective = if effective.is_nan() { count as f64 } else { effective.min(count as f64) };
    bridge(&posterior, &proposed, effective)
}

/// Solves the equation of the estimate by iteration. `posterior` (one row per chain) and `proposed` are ln q − ln g at the draws of the
/// density and of g.
fn bridge(
    posterior: &[Vec<f64>],
    proposed: &[f64],
    effective: f64,
) -> Result<MarginalLikelihood, BridgeError> {
    let n2 = proposed.len() as f64;
    let (s1, s2) = (effective / (effective + n2), n2 / (effective + n2));
    let mut sorted = posterior.concat();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted[sorted.len() / 2];
    let mean = |values: &mut dyn Iterator<Item = f64>, count: f64| values.sum::<f64>() / count;
    // q/g relative to its median; 1/(s₁ q/g + s₂ r) is finite for every ratio
    let ratio = |ln: f64| (ln - middle).exp();
    let weight = |ln: f64, r: f64| match ratio(ln) {
        ratio if ratio.is_infinite() => 1.0 / s1,
        ratio => ratio / (s1 * ratio + s2 * r),
    };
    let inverse = |ln: f64, r: f64| 1.0 / (s1 * ratio(ln) + s2 * r);
    let n1 = sorted.len() as f64;
    let (mut r, mut is_converged) = (1.0, false);
    for _ in 0..MOST {
        let above = mean(&mut proposed.iter().map(|&ln| weight(ln, r)), n2);
        let below = mean(&mut sorted.iter().map(|&ln| inverse(ln, r)), n1);
        let next: f64 = above / below;
        let change = (next / r - 1.0).abs();
        r = next;
        if !r.is_finite() || r <= 0.0 {
            return Err(BridgeError::Unreliable { error: f64::INFINITY });
        }
        if change < TOLERANCE {
            is_converged = true;
            break;
        }
    }
    if !is_converged {
        return Err(BridgeError::Unreliable { error: f64::INFINITY });
    }
    // with p = q/r: f₁ = p/(s₁ p + s₂ g) at draws of g, f₂ = g/(s₁ p + s₂ g) at draws of the density
    let of_proposed: Vec<f64> = proposed.iter().map(|&ln| weight(ln, r)).collect();
    let of_posterior: Vec<Vec<f64>> = posterior
        .iter()
        .map(|chain| chain.iter().map(|&ln| r * inverse(ln, r)).collect())
        .collect();
    let traces: Vec<&[f64]> = of_posterior.iter().map(Vec::as_slice).collect();
    let effective = ess_mean(&traces);
    let effective = if effective.is_nan() { n1 } else { effective };
    let error = (squared_variation(&of_proposed) / n2
        + squared_variation(&of_posterior.concat()) / effective)
        .sqrt();
    match error < LARGEST_ERROR {
        true => Ok(MarginalLikelihood { ln: r.ln() + middle, error }),
        false => Err(BridgeError::Unreliable { error }),
    }
}

/// Variance of numbers divided by the square of their mean.
fn squared_variation(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
    squares / (n - 1.0) / (mean * mean)
}

/// Normal distribution with the mean and covariance of draws.
struct Proposal {
    mean: DVector<f64>,
    /// Cholesky factor of the covariance.
    factor: DMatrix<f64>,
    ln_normaliser: f64,
}

impl Proposal {
    fn of<'a>(
        draws: impl Iterator<Item = &'a [f64]> + Clone,
        dim: usize,
    ) -> Result<Self, BridgeError> {
        let count = draws.clone().count() as f64;
        let mean =
            draws.clone().fold(DVector::zeros(dim), |sum, y| sum + DVector::from_column_slice(y));
        let mean = mean / count;
        let covariance = draws.fold(DMatrix::zeros(dim, dim), |sum, y| {
            let away = DVector::from_column_slice(y) - &mean;
            sum + &away * away.transpose()
        });
        let factor = Cholesky::new(covariance / (count - 1.0)).ok_or(BridgeError::Covariance)?.l();
        let ln_determinant: f64 = factor.diagonal().iter().map(|x| x.ln()).sum();
        let ln_normaliser = -0.5 * dim as f64 * (2.0 * std::f64::consts::PI).ln() - ln_determinant;
        Ok(Self { mean, factor, ln_normaliser })
    }

    fn ln_density(&self, y: &[f64]) -> f64 {
        let away = DVector::from_column_slice(y) - &self.mean;
        let whitened = self.factor.solve_lower_triangular(&away);
        whitened.map_or(f64::NAN, |z| self.ln_normaliser - 0.5 * z.norm_squared())
    }

    fn draw(&self, rng: &mut impl Rng) -> Vec<f64> {
        let z = DVector::from_fn(self.mean.len(), |_, _| rng.sample::<f64, _>(StandardNormal));
        (&self.mean + &self.factor * z).as_slice().to_vec()
    }
}

#[cfg(test)]
mod tests {
    use ppl::Nuts;
    use ppl::prelude::*;

    use super::*;

    ppl::model! {
        fn normal_mean(data: &[f64], prior_sd: f64) {
            let mean ~ Normal(1.0, prior_sd);
            for x in data {
                x ~ Normal(mean, 0.7);
            }
        }
    }

    ppl::model! {
        fn success(successes: &[bool], a: f64) {
            let p ~ Beta(a, 2.0);
            for one in successes {
                factor(if *one { p.ln() } else { (-p).ln_1p() });
            }
        }
    }

    const DATA: [f64; 5] = [1.3, 0.2, 2.1, 1.7, 0.9];

    /// ln of the normal density of all data, whose covariance is 0.7² 1 + τ² 1 1ᵀ.
    fn exact(prior_sd: f64) -> f64 {
        let n = DATA.len() as f64;
        let (own, shared) = (0.49, prior_sd * prior_sd);
        let sum: f64 = DATA.iter().map(|x| x - 1.0).sum();
        let squares: f64 = DATA.iter().map(|x| (x - 1.0).powi(2)).sum();
        let quadratic = (squares - shared * sum * sum / (own + n * shared)) / own;
        let ln_determinant = (n - 1.0) * own.ln() + (own + n * shared).ln();
        -0.5 * (n * (2.0 * std::f64::consts::PI).ln() + ln_determinant + quadratic)
    }

    #[test]
    fn conjugate_models_have_their_closed_form() {
        let sampler = Nuts::default().chains(4).draws(2000).seed(3);
        for prior_sd in [0.5, 20.0] {
            let model = normal_mean(&DATA, prior_sd);
            let chains = sampler.clone().run(&model).unwrap();
            let found = marginal_likelihood(&model, &chains, 5).unwrap();
            assert!((found.ln - exact(prior_sd)).abs() < 4.0 * found.error, "{found:?}");
            assert!(found.error < 0.02, "{found:?}");
        }
        // 3 successes in 4 trials: B(a + 3, 2 + 1)/B(a, 2), with B(x, 2) = 1/(x (x + 1)) and B(x, 3) = 2/(x (x + 1) (x + 2))
        let a = 1.5;
        let model = success(&[true, true, false, true], a);
        let chains = sampler.run(&model).unwrap();
        let found = marginal_likelihood(&model, &chains, 5).unwrap();
        let x = a + 3.0;
        let closed = (2.0 * a * (a + 1.0) / (x * (x + 1.0) * (x + 2.0))).ln();
        assert!((found.ln - closed).abs() < 4.0 * found.error, "{found:?} {closed}");
    }

    /// The standard error is the standard deviation of estimates with different seeds.
    #[test]
    fn the_error_is_the_scatter_of_estimates() {
        let model = normal_mean(&DATA, 0.5);
        let estimates: Vec<MarginalLikelihood> = (0..60)
            .map(|seed| {
                let chains = Nuts::default().chains(2).draws(200).seed(seed).run(&model).unwrap();
                marginal_likelihood(&model, &chains, seed).unwrap()
            })
            .collect();
        let n = estimates.len() as f64;
        let squares: f64 = estimates.iter().map(|one| (one.ln - exact(0.5)).powi(2)).sum();
        let stated = estimates.iter().map(|one| one.error * one.error).sum::<f64>() / n;
        // the ratio of variances has a standard error of √(2/60) = 0.18
        let ratio = squares / n / stated;
        assert!((0.45..1.8).contains(&ratio), "{ratio}");
    }

    #[test]
    fn what_cannot_be_estimated_is_refused() {
        let model = normal_mean(&DATA, 0.5);
        let chains = Nuts::default().chains(1).draws(20).seed(1).run(&model).unwrap();
        let error = marginal_likelihood(&model, &chains, 1).unwrap_err();
        assert_eq!(error, BridgeError::FewDraws { draws: 20, dim: 1 });
        // draws that are far from the draws of the normal distribution
        let far = vec![(0..100).map(|i| 50.0 + f64::from(i)).collect::<Vec<f64>>()];
        let proposed: Vec<f64> = (0..100).map(|i| -50.0 - f64::from(i)).collect();
        assert!(matches!(bridge(&far, &proposed, 100.0), Err(BridgeError::Unreliable { .. })));
    }
}
