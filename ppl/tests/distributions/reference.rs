//! Log densities and their derivatives, compared with 50-digit values at usual and at extreme arguments
//! (`ln_density.csv`,
//! written by `reference.py`, which contains the formulas).
//!
//! Errors are counted in units in the last place of the largest term of the formula, because no method of summation is
//! more accurate for rounded arguments.

use ppl::Dual;
use ppl::prelude::*;

use crate::numerics::assert_close;

type D = Dual<4>;

/// Returns value and derivatives of a family at x and up to three parameters.
fn evaluate(family: &str, [x, a, b, c]: [D; 4]) -> D {
    let count = x.value() as u64;
    let n = a.value() as u64;
    let bound = c.value();
    match family {
        "Normal" => Normal(a, b).ln_density(&x),
        "Uniform" => Uniform(a, b).ln_density(&x),
        "HalfNormal" => HalfNormal(a).ln_density(&x),
        "LogNormal" => LogNormal(a, b).ln_density(&x),
        "Exponential" => Exponential(a).ln_density(&x),
        "Gamma" => Gamma(a, b).ln_density(&x),
        "Beta" => Beta(a, b).ln_density(&x),
        "StudentT" => StudentT(a, b, c).ln_density(&x),
        "HalfCauchy" => HalfCauchy(a).ln_density(&x),
        "Poisson" => Poisson(a).ln_density(&count),
        "Weibull" => Weibull(a, b).ln_density(&x),
        "Binomial" => Binomial(n, b).ln_density(&count),
        "BinomialLogit" => BinomialLogit(n, b).ln_density(&count),
        "PoissonLog" => PoissonLog(a).ln_density(&count),
        "MixtureOfNormals" => {
            Mixture([a, 1.0 - a], [Normal(D::from(0.0), c), Normal(b, c)]).ln_density(&x)
        }
        "NormalAbove" => Normal(a, b).truncate(bound..).ln_density(&x),
        "NormalBelow" => Normal(a, b).truncate(..bound).ln_density(&x),
        "GammaAbove" => Gamma(a, b).truncate(bound..).ln_density(&x),
        "BetaAbove" => Beta(a, b).truncate(bound..).ln_density(&x),
        "NormalTail" => Normal(a, b).censor(..x.value()).ln_density(&x),
        "GammaTail" => Gamma(a, b).censor(..x.value()).ln_density(&x),
        "GammaBelow" => Gamma(a, b).censor(x.value()..).ln_density(&x),
        "StudentTTail" => StudentT(a, b, c).censor(..x.value()).ln_density(&x),
        "WeibullTail" => Weibull(a, b).censor(..x.value()).ln_density(&x),
        other => panic!("no family {other}"),
    }
}

/// |got − expected| in units in the last place of `largest`.
fn ulps(got: f64, expected: f64, largest: f64) -> f64 {
    let exponent = largest.abs().log2().floor().max(-900.0) as i32;
    (got - expected).abs() / 2f64.powi(exponent - 52)
}

/// Returns the allowed errors of the value and of a derivative, in units in the last place. The limits are smaller if
/// every argument is between 0.01 and 100. Elsewhere, rounding errors of ln x or x − μ are amplified.
fn allowed(family: &str, arguments: &[f64]) -> (f64, f64) {
    let usual = |x: &f64| x.is_nan() || *x == 0.0 || (0.01..=100.0).contains(&x.abs());
    match family {
        // densities and probabilities are exponentials of logarithms, whose rounding errors are ε times the logarithm
        "MixtureOfNormals" => (4.0, 512.0),
        // the density at an end of an interval is divided by the probability; both are exponentials of logarithms
        "GammaAbove" | "GammaBelow" | "GammaTail" | "StudentTTail" => (64.0, 1024.0),
        _ if arguments.iter().all(usual) => (4.0, 8.0),
        _ => (64.0, 512.0),
    }
}

/// Whether the derivative with respect to the argument with this index is computed by quadrature. Its error is 10⁻¹¹,
/// which does not decrease with the derivative.
fn by_quadrature(family: &str, place: usize) -> bool {
    match family {
        "BetaAbove" | "GammaAbove" | "GammaBelow" | "GammaTail" => place > 0,
        // only the derivative with respect to the shape
        "StudentTTail" => place == 1,
        _ => false,
    }
}

#[test]
fn log_densities_agree_with_fifty_digits() {
    let (mut rows, mut failures) = (0, Vec::new());
    for line in include_str!("ln_density.csv").lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let number = |i: usize| fields[i].parse().unwrap_or(f64::NAN);
        let arguments = [1, 2, 3, 4].map(number);
        let got = evaluate(fields[0], Dual::variables(arguments));
        let allowed = allowed(fields[0], &arguments);
        let at = fields[..5].join(",");
        // for a log density below 1, the error is relative to 1
        let error = ulps(got.value(), number(5), number(6).max(1.0));
        if error.is_nan() || error > allowed.0 {
            failures.push(format!("{at}: {error:.1} ulp, {:e} for {}", got.value(), fields[5]));
        }
        for (i, partial) in got.gradient().into_iter().enumerate() {
            let (expected, largest) = (number(7 + 2 * i), number(8 + 2 * i));
            if expected.is_nan() {
                continue;
            }
            let (allowed, floor) =
                if by_quadrature(fields[0], i) { (50_000.0, 1.0) } else { (allowed.1, 0.0) };
            let error = ulps(partial, expected, largest.max(floor));
            if error.is_nan() || error > allowed {
                let name = ["x", "a", "b", "c"][i];
                failures
                    .push(format!("{at}: ∂{name} {error:.1} ulp, {partial:e} for {expected:e}"));
            }
        }
        rows += 1;
    }
    assert!(rows >= 125, "{rows} rows");
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

fn factor<const K: usize>(entries: &[f64]) -> CholeskyFactor<f64, K> {
    CholeskyFactor::new(std::array::from_fn(|i| std::array::from_fn(|j| entries[i * K + j])))
        .expect("a factor")
}

/// Version of the test for matrices (`vectors.csv`, written by `vectors.py`).
#[test]
fn vector_log_densities_agree_with_fifty_digits() {
    let mut rows = 0;
    for line in include_str!("vectors.csv").lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let values = |field: &str| -> Vec<f64> {
            field.split(' ').map(|x| x.parse().expect("a number")).collect()
        };
        let (family, x, p) = (fields[0], values(fields[1]), values(fields[2]));
        let expected: f64 = fields[3].parse().unwrap();
        let got: f64 = match (family, x.len()) {
            ("LkjCholesky", 9) => LkjCholesky::<3>(p[0]).ln_density(&factor(&x)),
            _ => panic!("no family {family} of {} numbers", x.len()),
        };
        assert_close(got, expected, 1e-14, 1e-14, line);
        rows += 1;
    }
    assert!(rows >= 4, "{rows} rows");
}
