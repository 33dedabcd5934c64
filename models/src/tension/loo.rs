//! Leaving out one specimen after the other.

use ppl::diagnostics::Loo;
use ppl::prelude::*;
use ppl::rand::SeedableRng;
use ppl::rand_xoshiro::Xoshiro256PlusPlus;
use ppl::{DomainError, Posterior};

use super::{HardeningLaw, TensionError, TensionTest, calibrate};

/// Points of the integral over the parameters of a specimen.
const NODES: usize = 400;

/// A population at one draw of the posterior.
pub(super) struct Population {
    pub(super) mean: [f64; 3],
    pub(super) factor: CholeskyFactor<f64, 3>,
    pub(super) sd_mpa: f64,
}

/// Parameters that a specimen may have: where the integral over them is evaluated.
pub(super) struct Node {
    ln_own: [f64; 3],
    ln_proposal: f64,
    /// Σ (σ − law)² over the points of the specimen, MPa².
    squares: f64,
}

/// How well each specimen is predicted from the others by a calibration `posterior` of the law `L`.
///
/// What is left out is a whole curve, since that is what the next specimen brings; single points of a curve
/// are told by their neighbours, so that leaving out one tests interpolation only. The density
/// of a curve, p(y_k | μ, s, R, sd) = ∫ p(y_k | θ, sd) N(ln θ; μ, Σ) d ln θ, is integrated over parameters
/// drawn about those that the posterior gives the specimen. Draws are reweighted (PSIS); where Pareto's k
/// says that this does not do, `sampler` runs again without the specimen. In place of its k the result then
/// has −∞.
///
/// # Errors
/// Fewer than 25 draws; a sampler that cannot start.
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
    let nodes = tests.iter().enumerate();
    let nodes: Vec<Vec<Node>> =
        nodes.map(|(k, test)| nodes_of::<L>(posterior, k, test)).collect::<Result<_, _>>()?;
    let densities = |population: &Population| {
        let with_tests = nodes.iter().zip(tests);
        with_tests.map(|(nodes, test)| ln_density(nodes, test, population)).collect::<Vec<f64>>()
    };
    let rows: Vec<f64> = drawn.iter().flat_map(densities).collect();
    let group = &posterior.posterior;
    let mut loo = Loo::new(group.chains, group.draws, tests.len(), &rows)?;
    for k in loo.unreliable() {
        let others: Vec<TensionTest> =
            tests.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, t)| t.clone()).collect();
        let without = populations(&calibrate::<L>(&others, sampler)?)?;
        let terms: Vec<f64> = without.iter().map(|p| ln_density(&nodes[k], &tests[k], p)).collect();
        loo = loo.refitted(k, ln_sum_exp(&terms) - (terms.len() as f64).ln());
    }
    Ok(loo)
}

pub(super) fn populations(posterior: &Posterior) -> Result<Vec<Population>, DomainError> {
    let of = |name: &str| posterior.values(name).map_or(&[][..], |values| &values.data[..]);
    let (means, scatters) = (of("ln_mean").chunks_exact(3), of("scatter").chunks_exact(3));
    let draws = means.zip(scatters).zip(of("corr").chunks_exact(9)).zip(of("sd"));
    let population = |(((mean, scatter), corr), &sd_mpa): (((&[f64], &[f64]), &[f64]), &f64)| {
        let rows = std::array::from_fn(|i| std::array::from_fn(|j| scatter[i] * corr[3 * i + j]));
        Ok(Population {
            mean: [mean[0], mean[1], mean[2]],
            factor: CholeskyFactor::new(rows)?,
            sd_mpa,
        })
    };
    draws.map(population).collect()
}

/// Parameters drawn from a normal half as wide again as the posterior of those of specimen `k`.
pub(super) fn nodes_of<L: HardeningLaw>(
    posterior: &Posterior,
    k: usize,
    test: &TensionTest,
) -> Result<Vec<Node>, DomainError> {
    const WIDER: f64 = 1.5;
    let data = posterior.values("ln_own").map_or(&[][..], |values| &values.data[..]);
    let size = 3 * posterior.values("ln_own").map_or(0, |v| v.shape.first().copied().unwrap_or(0));
    let own: Vec<[f64; 3]> =
        data.chunks_exact(size.max(1)).map(|row| std::array::from_fn(|i| row[3 * k + i])).collect();
    let n = own.len() as f64;
    let mean: [f64; 3] = std::array::from_fn(|i| own.iter().map(|x| x[i]).sum::<f64>() / n);
    let covariance = |i: usize, j: usize| {
        let terms = own.iter().map(|x| (x[i] - mean[i]) * (x[j] - mean[j]));
        WIDER * WIDER * terms.sum::<f64>() / (n - 1.0)
    };
    let matrix: Vec<Vec<f64>> =
        (0..3).map(|i| (0..3).map(|j| covariance(i, j)).collect()).collect();
    let rows = DynCholeskyFactor::of_covariance(&matrix)?.rows();
    let rows = std::array::from_fn(|i| std::array::from_fn(|j| rows[i][j]));
    let proposal = MvNormalCholesky(mean, CholeskyFactor::new(rows)?);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(k as u64);
    let node = |_| {
        let ln_own: [f64; 3] = proposal.draw(&mut rng);
        let own = ln_own.map(f64::exp);
        let misfit = test.points.iter().map(|point| {
            (point.true_stress_mpa - L::stress_mpa(&own, point.plastic_strain)).powi(2)
        });
        Node { ln_own, ln_proposal: proposal.ln_density(&ln_own), squares: misfit.sum() }
    };
    Ok((0..NODES).map(node).collect())
}

/// ln ∫ p(y | θ, sd) N(ln θ; μ, Σ) d ln θ
pub(super) fn ln_density(nodes: &[Node], test: &TensionTest, population: &Population) -> f64 {
    let prior = MvNormalCholesky(population.mean, population.factor);
    let sd = population.sd_mpa;
    let normalised = test.points.len() as f64 * (sd * std::f64::consts::TAU.sqrt()).ln();
    let term = |node: &Node| {
        let fits = -0.5 * node.squares / (sd * sd) - normalised;
        fits + prior.ln_density(&node.ln_own) - node.ln_proposal
    };
    let terms: Vec<f64> = nodes.iter().map(term).collect();
    ln_sum_exp(&terms) - (NODES as f64).ln()
}
