//! Gaussian processes and a differential equation.

use ppl::prelude::*;
use ppl::{CholeskyFactor, DomainError, Forward, Generic};

use super::Data;

ppl::model! {
    /// Gaussian process with noise, its values integrated out.
    pub fn gp_regr(x: &[f64; 11], y: &[f64; 11]) {
        let rho ~ Gamma(25.0, 4.0);
        let alpha ~ HalfNormal(2.0);
        let sigma ~ HalfNormal(1.0);
        let factor = covariance_factor(x, alpha, rho, sigma)?;
        *y ~ MvNormalCholesky([0.0; 11], factor);
    }

    /// Counts whose log rate is a Gaussian process.
    pub fn gp_pois_regr(x: &[f64; 11], k: &[u64; 11]) {
        let rho ~ Gamma(25.0, 4.0);
        let alpha ~ HalfNormal(2.0);
        let z ~ Normal(0.0, 1.0).array::<11>();
        let factor = covariance_factor(x, alpha, rho, Real::from(1e-10))?;
        #[track] let f = times(&factor, z);
        for i in 0..11 {
            k[i] ~ Poisson(f[i].exp());
        }
    }

    /// Hares and lynx: log-normal errors about the solution of the Lotka–Volterra equations.
    pub fn lotka_volterra(hare: &[f64; 21], lynx: &[f64; 21]) {
        let alpha ~ Normal(1.0, 0.5).truncate(0.0..);
        let beta ~ Normal(0.05, 0.05).truncate(0.0..);
        let gamma ~ Normal(1.0, 0.5).truncate(0.0..);
        let delta ~ Normal(0.05, 0.05).truncate(0.0..);
        let initial ~ LogNormal(10f64.ln(), 1.0).array::<2>();
        let sigma ~ LogNormal(-1.0, 1.0).array::<2>();
        let parameters = [alpha, beta, gamma, delta, initial[0], initial[1]];
        let log_size = Forward(PredatorPrey).try_at(parameters)?;
        for year in 0..21 {
            hare[year] ~ LogNormal(log_size[2 * year], sigma[0]);
            lynx[year] ~ LogNormal(log_size[2 * year + 1], sigma[1]);
        }
    }
}

/// Cholesky factor of α² exp(−(xᵢ − xⱼ)²/2ρ²) + noise δᵢⱼ.
///
/// # Errors
/// [`DomainError`] if it is not positive definite in floating point.
pub fn covariance_factor<S: Scalar, const N: usize>(
    x: &[f64; N],
    alpha: S,
    rho: S,
    noise: S,
) -> Result<CholeskyFactor<S, N>, DomainError> {
    let mut l = [[S::from(0.0); N]; N];
    let width = rho.square() * 2.0;
    for i in 0..N {
        for j in 0..=i {
            let mut entry = alpha.square() * (-(width.recip() * (x[i] - x[j]).powi(2))).exp();
            if i == j {
                entry += noise;
            }
            for k in 0..j {
                entry -= l[i][k] * l[j][k];
            }
            l[i][j] = if i == j { entry.sqrt() } else { entry / l[j][j] };
        }
    }
    CholeskyFactor::new(l)
}

/// L z.
fn times<S: Scalar, const N: usize>(l: &CholeskyFactor<S, N>, z: [S; N]) -> [S; N] {
    std::array::from_fn(|i| (0..=i).map(|k| l.get(i, k) * z[k]).sum())
}

/// Logarithms of both populations after 0, 1, … 20 years, from growth, predation, death,
/// reproduction and the initial sizes, by classical Runge–Kutta steps of a twentieth of a year.
#[derive(Clone, Copy)]
pub struct PredatorPrey;

impl Generic<6, 42> for PredatorPrey {
    fn eval<S: Scalar>(&self, [alpha, beta, gamma, delta, u, v]: [S; 6]) -> [S; 42] {
        const STEPS: usize = 20;
        let h = 1.0 / STEPS as f64;
        // in logarithms the populations stay positive
        let slope = |[a, b]: [S; 2]| [alpha - beta * b.exp(), delta * a.exp() - gamma];
        let step = |y: [S; 2], k: [S; 2], h: f64| [y[0] + k[0] * h, y[1] + k[1] * h];
        let mut y = [u.ln(), v.ln()];
        let mut out = [S::from(0.0); 42];
        [out[0], out[1]] = y;
        for year in 1..21 {
            for _ in 0..STEPS {
                let k1 = slope(y);
                let k2 = slope(step(y, k1, 0.5 * h));
                let k3 = slope(step(y, k2, 0.5 * h));
                let k4 = slope(step(y, k3, h));
                y = std::array::from_fn(|i| {
                    y[i] + (k1[i] + k2[i] * 2.0 + k3[i] * 2.0 + k4[i]) * (h / 6.0)
                });
            }
            out[2 * year] = y[0];
            out[2 * year + 1] = y[1];
        }
        out
    }
}

fn array<T: Copy, const N: usize>(column: Vec<T>) -> [T; N] {
    let n = column.len();
    column.try_into().unwrap_or_else(|_| panic!("{n} values, expected {N}"))
}

/// Data of [`gp_regr`] and [`gp_pois_regr`]: places, values, counts.
pub fn gp_data() -> ([f64; 11], [f64; 11], [u64; 11]) {
    let data = Data::parse(include_str!("../../fixtures/posteriors/gp_pois_regr.json"));
    (array(data.column("x")), array(data.column("y")), array(data.counts("k")))
}

/// Data of [`lotka_volterra`]: pelts of hares and lynx, in thousands.
pub fn lynx_hare_data() -> ([f64; 21], [f64; 21]) {
    let data = Data::parse(include_str!("../../fixtures/posteriors/hudson_lynx_hare.json"));
    (array(data.column("hare")), array(data.column("lynx")))
}
