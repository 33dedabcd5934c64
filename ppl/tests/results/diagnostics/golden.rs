//! Every diagnostic against ArviZ and the R package posterior. `tests/golden/diagnostics.{json,py}` and
//! `posterior.{json,R}` hold the reference values and the programs that computed them, with versions.

use ppl::diagnostics::{
    e_bfmi, ess_bulk, ess_mean, ess_quantile, ess_sd, ess_tail, mcse_mean, mcse_quantile, mcse_sd,
    pareto_smooth, rhat,
};
use serde_json::Value;

use super::borrow;

fn golden() -> Value {
    serde_json::from_str(include_str!("../../golden/diagnostics.json")).expect("valid JSON")
}

struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (z ^ (z >> 31)) >> 11
    }

    /// An approximately normal number, the sum of twelve uniforms, with the same bits in every language.
    fn normal(&mut self) -> f64 {
        (0..12).fold(0.0, |sum, _| sum + self.next() as f64 * 0.5_f64.powi(53)) - 6.0
    }
}

fn chains(case: &Value) -> Vec<Vec<f64>> {
    let number = |key: &str| case[key].as_f64().expect("a number");
    let flag = |key: &str| case[key].as_bool().expect("a flag");
    let mut noise = SplitMix(number("seed") as u64);
    (0..number("count") as usize)
        .map(|c| {
            let mut x = noise.normal();
            (0..number("draws") as usize)
                .map(|_| {
                    x = number("rho") * x + noise.normal();
                    let mut y = x + number("shift") * c as f64;
                    if flag("cubed") {
                        y = y * y * y;
                    }
                    if flag("rounded") { y.floor() } else { y }
                })
                .collect()
        })
        .collect()
}

fn assert_close(what: &str, got: f64, expected: f64, tolerance: f64) {
    assert!(
        (got - expected).abs() <= tolerance * expected.abs().max(1e-3),
        "{what}: {got}, expected {expected}"
    );
}

#[test]
fn chain_diagnostics_agree_with_arviz() {
    for case in golden()["chains"].as_array().expect("a list") {
        let owned = chains(&case["case"]);
        let chains = borrow(&owned);
        let computed = [
            ("rhat", rhat(&chains)),
            ("ess_bulk", ess_bulk(&chains)),
            ("ess_tail", ess_tail(&chains)),
            ("ess_mean", ess_mean(&chains)),
            ("ess_sd", ess_sd(&chains)),
            ("mcse_mean", mcse_mean(&chains)),
            ("mcse_sd", mcse_sd(&chains)),
            ("mcse_q05", mcse_quantile(&chains, 0.05)),
            ("mcse_median", mcse_quantile(&chains, 0.5)),
        ];
        for (key, got) in computed {
            // ArviZ needs two chains for R̂ and returns null for one chain
            if let Some(expected) = case[key].as_f64() {
                assert_close(&format!("{key} of {}", case["case"]), got, expected, 1e-9);
            }
        }
        for (chain, expected) in chains.iter().zip(case["bfmi"].as_array().expect("a list")) {
            assert_close("bfmi", e_bfmi(chain), expected.as_f64().expect("a number"), 1e-12);
        }
    }
}

#[test]
fn chain_diagnostics_agree_with_the_package_posterior() {
    let golden: Value =
        serde_json::from_str(include_str!("../../golden/posterior.json")).expect("valid JSON");
    for case in golden["chains"].as_array().expect("a list") {
        let owned = chains(&case["case"]);
        let chains = borrow(&owned);
        // the R package's ESS for the sd is the ESS of |x − x̄|; ppl and ArviZ use (x − x̄)², which the standard error
        // of the sd requires
        let all = owned.concat();
        let centre = all.iter().sum::<f64>() / all.len() as f64;
        let distances: Vec<Vec<f64>> =
            owned.iter().map(|c| c.iter().map(|x| (x - centre).abs()).collect()).collect();
        let computed = [
            ("rhat", rhat(&chains)),
            ("ess_bulk", ess_bulk(&chains)),
            ("ess_tail", ess_tail(&chains)),
            ("ess_mean", ess_mean(&chains)),
            ("ess_sd", ess_mean(&borrow(&distances))),
            ("ess_median", ess_quantile(&chains, 0.5)),
            ("mcse_mean", mcse_mean(&chains)),
            ("mcse_sd", mcse_sd(&chains)),
            ("mcse_q05", mcse_quantile(&chains, 0.05)),
            ("mcse_median", mcse_quantile(&chains, 0.5)),
        ];
        for (key, got) in computed {
            let expected = case[key].as_f64().expect("a number");
            assert_close(&format!("{key} of {}", case["case"]), got, expected, 1e-9);
        }
    }
}

#[test]
fn pareto_smoothing_agrees_with_arviz() {
    for case in golden()["psis"].as_array().expect("a list") {
        let mut noise = SplitMix(case["seed"].as_u64().expect("a seed"));
        let mut draws = Vec::new();
        for _ in 0..4 {
            let mut x = noise.normal();
            for _ in 0..250 {
                x = 0.3 * x + noise.normal();
                draws.push(x);
            }
        }
        let sharpness = case["sharpness"].as_f64().expect("a number");
        for point in case["points"].as_array().expect("a list") {
            let [y, r_eff, elpd, k, p_loo] =
                std::array::from_fn(|i| point[i].as_f64().expect("a number"));
            let log_likelihood: Vec<f64> =
                draws.iter().map(|x| -0.5 * (x - sharpness * y).powi(2)).collect();
            let mut log_weights: Vec<f64> = log_likelihood.iter().map(|l| -l).collect();
            let got_k = pareto_smooth(&mut log_weights, r_eff);
            let weighted: Vec<f64> =
                log_weights.iter().zip(&log_likelihood).map(|(w, l)| w + l).collect();
            let got = ln_sum_exp(&weighted);
            let with_it = ln_sum_exp(&log_likelihood) - (log_likelihood.len() as f64).ln();
            assert_close("elpd", got, elpd, 1e-9);
            assert_close("k", got_k, k, 1e-8);
            assert_close("p_loo", with_it - got, p_loo, 1e-8);
        }
    }
}

fn ln_sum_exp(values: &[f64]) -> f64 {
    let top = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    top + values.iter().map(|v| (v - top).exp()).sum::<f64>().ln()
}
