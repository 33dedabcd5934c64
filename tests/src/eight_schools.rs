//! Eight schools (Rubin 1981): data, both parametrisations, and reference moments.

use ppl::prelude::*;

/// Estimated treatment effects.
pub const EFFECT: [f64; 8] = [28.0, 8.0, -3.0, 7.0, -1.0, 1.0, 18.0, 12.0];
/// Standard errors of the estimated treatment effects.
pub const ERROR: [f64; 8] = [15.0, 10.0, 16.0, 11.0, 9.0, 11.0, 10.0, 18.0];

ppl::model! {
    /// Centred parametrisation: the effects are unknowns, and the posterior has a funnel.
    pub fn centred(y: &[f64; 8], se: &[f64; 8]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        let theta ~ Normal(mu, tau).array::<8>();
        for j in 0..8 {
            y[j] ~ Normal(theta[j], se[j]);
        }
    }

    /// Non-centred parametrisation: standardised effects are unknowns.
    pub fn non_centred(y: &[f64; 8], se: &[f64; 8]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        let z ~ Normal(0.0, 1.0).array::<8>();
        for j in 0..8 {
            #[track] let theta = mu + tau * z[j];
            y[j] ~ Normal(theta, se[j]);
        }
    }
}

/// Mean and standard deviation of mu, tau and the first theta. Given tau, mu and theta are normal, so that only an
/// integral over tau is computed numerically (Gelman et al., *Bayesian Data Analysis*, §5.4).
pub fn moments_by_quadrature() -> [(f64, f64); 3] {
    let mut mass = 0.0;
    let mut first = [0.0; 3];
    let mut second = [0.0; 3];
    let steps = 200_000;
    for i in 0..steps {
        // tau = 5 tan(π u / 2): the prior is uniform in u
        let u = (f64::from(i) + 0.5) / f64::from(steps);
        let tau = 5.0 * (std::f64::consts::FRAC_PI_2 * u).tan();
        let (mut precision, mut weighted, mut log_marginal) = (1.0 / 25.0, 0.0, 0.0);
        for (y, se) in EFFECT.iter().zip(&ERROR) {
            let v = se * se + tau * tau;
            precision += 1.0 / v;
            weighted += y / v;
            log_marginal -= 0.5 * (v.ln() + y * y / v);
        }
        let (mean, variance) = (weighted / precision, 1.0 / precision);
        log_marginal += 0.5 * (weighted * mean - f64::ln(precision));
        let w = f64::exp(log_marginal);
        // theta given mu is normal with shrinkage b: theta = b y + (1 − b) mu + noise
        let b = tau * tau / (tau * tau + ERROR[0] * ERROR[0]);
        let theta = b * EFFECT[0] + (1.0 - b) * mean;
        let theta_variance = b * ERROR[0] * ERROR[0] + (1.0 - b) * (1.0 - b) * variance;
        mass += w;
        let moments = [(mean, variance), (tau, 0.0), (theta, theta_variance)];
        for (k, (m, v)) in moments.into_iter().enumerate() {
            first[k] += w * m;
            second[k] += w * (v + m * m);
        }
    }
    std::array::from_fn(|k| {
        let m = first[k] / mass;
        (m, (second[k] / mass - m * m).sqrt())
    })
}
