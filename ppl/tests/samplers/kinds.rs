//! Targets by which a warmup is judged: four with strong correlations, one with weak correlations.
//!
//! Every data set is computed here: exact values for known parameters plus normal noise, whose standard normal numbers
//! are the normal quantiles of a fixed low-discrepancy sequence.

use ppl::{Chains, DrawStats, diagnostics::ess_bulk, prelude::*, special::normal_upper_quantile};

use crate::targets::Function;

ppl::model! {
    /// An exponential decay to an unknown asymptote.
    pub(crate) fn decay(time_s: &[f64], level: &[f64]) {
        let a ~ LogNormal(1.0, 1.0);
        let b ~ LogNormal(0.0, 1.0);
        let c ~ Normal(0.0, 5.0);
        let sd ~ HalfNormal(1.0);
        for (t, y) in time_s.iter().zip(level) {
            y ~ Normal(a * (-b * t).exp() + c, sd);
        }
    }

    /// Ludwik's hardening law: stress in MPa over plastic strain.
    pub(crate) fn hardening(strain: &[f64], stress_mpa: &[f64]) {
        let yield_mpa ~ LogNormal(5.5, 1.0);
        let k_mpa ~ LogNormal(6.5, 1.0);
        let n ~ Beta(2.0, 2.0);
        let sd_mpa ~ HalfNormal(20.0);
        for (e, s) in strain.iter().zip(stress_mpa) {
            s ~ Normal(yield_mpa + k_mpa * (n * e.ln()).exp(), sd_mpa);
        }
    }

    /// Eight schools (Rubin 1981), non-centred.
    pub(crate) fn eight_schools(effects: &[f64; 8], errors: &[f64; 8]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        let z ~ Normal(0.0, 1.0).array::<8>();
        for j in 0..8 {
            effects[j] ~ Normal(mu + tau * z[j], errors[j]);
        }
    }
}

/// Element `k` of a low-discrepancy sequence in (0, 1).
fn even(k: usize) -> f64 {
    (0.5 + k as f64 * 0.618_033_988_749_894_9).fract()
}

fn noise(k: usize) -> f64 {
    normal_upper_quantile(even(k).clamp(1e-3, 1.0 - 1e-3))
}

/// 30 times up to 3 s and 4 e^(−0.7 t) + 1 with noise 0.2; the decay has not ended at 3 s.
pub(crate) fn decay_data() -> (Vec<f64>, Vec<f64>) {
    (0..30)
        .map(|k| {
            let t = 0.1 * (k + 1) as f64;
            (t, 4.0 * (-0.7 * t).exp() + 1.0 + 0.2 * noise(k))
        })
        .unzip()
}

/// 25 strains ε from 0.002 to 0.2 and stresses 200 + 550 ε^0.35 MPa with noise 4 MPa.
pub(crate) fn hardening_data() -> (Vec<f64>, Vec<f64>) {
    (0..25)
        .map(|k| {
            let e = 0.002 * 100_f64.powf(k as f64 / 24.0);
            (e, 200.0 + 550.0 * e.powf(0.35) + 4.0 * noise(k))
        })
        .unzip()
}

/// Logistic regression on 200 rows of twenty predictors that share a factor (correlation 0.96); the slopes alternate
/// between 0.5 and −0.5, and have the prior Normal(0, 2.5).
pub(crate) fn logistic() -> impl LogDensity {
    let rows: Vec<([f64; 20], f64)> = (0..200)
        .map(|k| {
            let shared = noise(21 * k);
            let x: [f64; 20] = std::array::from_fn(|j| shared + 0.2 * noise(21 * k + 7 * j + 300));
            let score: f64 = (x.iter().zip([0.5, -0.5].iter().cycle())).map(|(x, b)| x * b).sum();
            let success = even(13 * k + 5) < 1.0 / (1.0 + (-score).exp());
            (x, if success { 1.0 } else { -1.0 })
        })
        .collect();
    let function = move |slope: &[f64], g: &mut [f64]| {
        let mut sum = 0.0;
        for (g, b) in g.iter_mut().zip(slope) {
            sum -= 0.5 * (b / 2.5).powi(2);
            *g = -b / 2.5_f64.powi(2);
        }
        for (x, sign) in &rows {
            let score = sign * x.iter().zip(slope).map(|(x, b)| x * b).sum::<f64>();
            let odds_against = (-score).exp();
            sum -= odds_against.ln_1p();
            let slope_of_term = sign * odds_against / (1.0 + odds_against);
            g.iter_mut().zip(x).for_each(|(g, x)| *g += slope_of_term * x);
        }
        Ok(sum)
    };
    Function { dim: 20, function }
}

pub(crate) const EFFECTS: [f64; 8] = [28.0, 8.0, -3.0, 7.0, -1.0, 1.0, 18.0, 12.0];
pub(crate) const ERRORS: [f64; 8] = [15.0, 10.0, 16.0, 11.0, 9.0, 11.0, 10.0, 18.0];

/// Gradient evaluations per effective draw, for the stored draws and with the warmup included; the effective draws are
/// the smallest bulk ESS of all coordinates.
pub(crate) fn gradients_per_effective_draw(chains: &Chains) -> [f64; 2] {
    let ess = (0..chains.dim)
        .map(|i| {
            let traces = chains.traces(i);
            ess_bulk(&traces.iter().map(Vec::as_slice).collect::<Vec<_>>())
        })
        .fold(f64::INFINITY, f64::min);
    let count = |stats: &[DrawStats]| stats.iter().map(|s| f64::from(s.leapfrogs)).sum::<f64>();
    let sampling: f64 = chains.chains.iter().map(|c| count(&c.stats)).sum();
    let warmup: f64 = chains.chains.iter().map(|c| count(&c.warmup.stats)).sum();
    [sampling / ess, (sampling + warmup) / ess]
}
