//! Gaussian processes and a differential equation.

use ppl::DomainError;
use ppl::prelude::*;

use super::Data;
use ppl::{Ode, OdeSolution};

ppl::model! {
    /// Gaussian process with noise of variance sigma. The values of the process are integrated out.
    pub fn gp_regr(x: &[f64], y: &[f64]) {
        let rho ~ Gamma(25.0, 4.0);
        let alpha ~ HalfNormal(2.0);
        let sigma ~ HalfNormal(1.0);
        let factor = smooth(x, alpha, rho, sigma)?;
        y ~ MvNormalCholesky(vec![0.0; x.len()], factor);
    }

    /// Counts whose log rate is a Gaussian process.
    pub fn gp_pois_regr(x: &[f64], k: &[u64]) {
        let rho ~ Gamma(25.0, 4.0);
        let alpha ~ HalfNormal(2.0);
        let z ~ Normal(0.0, 1.0).iid(x.len());
        // a noise variance of 10⁻¹⁰ α² makes the covariance of neighbouring points positive definite in floating point
        #[track] let f = smooth(x, alpha, rho, 1e-10 * alpha.square())?.times(&z)?;
        for (f, k) in f.iter().zip(k) {
            k ~ Poisson(f.exp());
        }
    }

    /// Populations of hares and lynx: the Lotka–Volterra equations with log-normal errors of the counts.
    pub fn lotka_volterra(
        solution: &OdeSolution<PredatorPrey, 2>,
        hare: &[f64; 21],
        lynx: &[f64; 21],
    ) {
        let alpha ~ Normal(1.0, 0.5).truncate(0.0..);
        let beta ~ Normal(0.05, 0.05).truncate(0.0..);
        let gamma ~ Normal(1.0, 0.5).truncate(0.0..);
        let delta ~ Normal(0.05, 0.05).truncate(0.0..);
        let initial ~ LogNormal(10f64.ln(), 1.0).array::<2>();
        let sigma ~ LogNormal(-1.0, 1.0).array::<2>();
        let sizes = solution.states([alpha, beta, gamma, delta, initial[0], initial[1]])?;
        for year in 0..21 {
            hare[year] ~ LogNormal(sizes[year][0].ln(), sigma[0]);
            lynx[year] ~ LogNormal(sizes[year][1].ln(), sigma[1]);
        }
    }
}

/// Cholesky factor of the covariance of the noisy values of a smooth function at `x`: α² exp(−½ ((xᵢ − xⱼ)/ρ)²) + σ²
/// δᵢⱼ (Rasmussen & Williams 2006, ch. 2).
fn smooth<R: Scalar>(
    x: &[f64],
    alpha: R,
    rho: R,
    noise_variance: R,
) -> Result<DynCholeskyFactor<R>, DomainError> {
    let row = |(i, a): (usize, &f64)| {
        let near = |b: &f64| (((rho.recip() * (a - b)).square()) * -0.5).exp() * alpha.square();
        let mut row: Vec<R> = x[..=i].iter().map(near).collect();
        row[i] += noise_variance;
        row
    };
    DynCholeskyFactor::of_covariance(&x.iter().enumerate().map(row).collect::<Vec<_>>())
}

/// Lotka–Volterra equations. The parameters are the rates of growth, predation, death and reproduction, and the two
/// initial populations.
#[derive(Clone, Copy, Debug)]
pub struct PredatorPrey;

impl PredatorPrey {
    /// Solution after 0, 1, … 20 years.
    pub fn years() -> OdeSolution<Self, 2> {
        let years: [f64; 21] = std::array::from_fn(|year| year as f64);
        // the absolute tolerance is zero, because the likelihood depends on the logarithms of the populations
        OdeSolution::new(Self, 0.0, &years, [1e-6, 0.0])
    }
}

impl Ode<2, 6> for PredatorPrey {
    fn initial<S: Scalar>(&self, &[.., hare, lynx]: &[S; 6]) -> [S; 2] {
        [hare, lynx]
    }

    fn rate<S: Scalar>(
        &self,
        _: f64,
        &[hare, lynx]: &[S; 2],
        &[alpha, beta, gamma, delta, ..]: &[S; 6],
    ) -> [S; 2] {
        [hare * (alpha - beta * lynx), lynx * (delta * hare - gamma)]
    }
}

fn array<T: Copy, const N: usize>(column: Vec<T>) -> [T; N] {
    let n = column.len();
    column.try_into().unwrap_or_else(|_| panic!("{n} values, expected {N}"))
}

/// Data of [`gp_regr`] and [`gp_pois_regr`]: inputs x, values, counts.
pub fn gp_data() -> ([f64; 11], [f64; 11], [u64; 11]) {
    let data = Data::parse(include_str!("../../fixtures/posteriors/gp_pois_regr.json"));
    (array(data.column("x")), array(data.column("y")), array(data.counts("k")))
}

/// Data of [`lotka_volterra`]: pelts of hares and lynx, in thousands.
pub fn lynx_hare_data() -> ([f64; 21], [f64; 21]) {
    let data = Data::parse(include_str!("../../fixtures/posteriors/hudson_lynx_hare.json"));
    (array(data.column("hare")), array(data.column("lynx")))
}
