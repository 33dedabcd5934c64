//! Log densities with 50 digits, at usual and at extreme arguments (`ln_density.csv`, made by
//! `reference.py`, which states the formulas).

use ppl::prelude::*;

use crate::numerics::assert_close;

#[test]
fn log_densities_agree_with_fifty_digits() {
    let mut rows = 0;
    for line in include_str!("ln_density.csv").lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let [x, a, b, c] = [1, 2, 3, 4].map(|i| fields[i].parse().unwrap_or(f64::NAN));
        let expected: f64 = fields[5].parse().unwrap();
        let got: f64 = match fields[0] {
            "Normal" => Normal(a, b).ln_density(&x),
            "Uniform" => Uniform(a, b).ln_density(&x),
            "HalfNormal" => HalfNormal(a).ln_density(&x),
            "LogNormal" => LogNormal(a, b).ln_density(&x),
            "Exponential" => Exponential(a).ln_density(&x),
            "Gamma" => Gamma(a, b).ln_density(&x),
            "Beta" => Beta(a, b).ln_density(&x),
            "StudentT" => StudentT(a, b, c).ln_density(&x),
            "HalfCauchy" => HalfCauchy(a).ln_density(&x),
            "Poisson" => Poisson(a).ln_density(&(x as u64)),
            "NormalAbove" => Normal(a, b).truncate(c..).ln_density(&x),
            "NormalBelow" => Normal(a, b).truncate(..c).ln_density(&x),
            "GammaAbove" => Gamma(a, b).truncate(c..).ln_density(&x),
            "BetaAbove" => Beta(a, b).truncate(c..).ln_density(&x),
            other => panic!("no family {other}"),
        };
        // far out, the normaliser of a truncation cancels a density of some 10³
        let truncated = fields[0].ends_with("Above") || fields[0].ends_with("Below");
        let absolute = if truncated { 2e-12 } else { 1e-14 };
        assert_close(got, expected, 2e-14, absolute, line);
        rows += 1;
    }
    assert!(rows >= 90, "{rows} rows");
}
