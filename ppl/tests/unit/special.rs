//! Special functions, compared with 60-digit values (`special.csv`, written by `tests/distributions/reference.py`).

use super::*;

/// Returns the value of the function, the allowed relative error, and the allowed absolute error. The absolute error is
/// positive if the value is a small sum of larger terms.
fn evaluate(function: &str, [a, b, x]: [f64; 3]) -> (f64, f64, f64) {
    match function {
        "ln_gamma" => (ln_gamma(a), 1e-15, 5e-15),
        "stirling_error" => (stirling_error(a), 1e-15, 5e-15),
        "ln_minus_digamma" => (ln_minus_digamma(a), 1e-15, 4e-15),
        "ln_beta" => (ln_beta(a, b), 1e-15, 1e-14),
        "ln_1p_minus" => (ln_1p_minus(a), 2e-15, 0.0),
        "ln_one_minus_exp" => (ln_one_minus_exp(a), 2e-15, 0.0),
        "deviance" => (deviance(a, b), 3e-15, 0.0),
        "gamma_p" => (regularised_gamma(a, b).0, 1e-13, 0.0),
        "gamma_q" => (regularised_gamma(a, b).1, 1e-13, 0.0),
        "beta_lower" => (regularised_beta(a, b, x, 1.0 - x).0, 1e-13, 0.0),
        "beta_upper" => (regularised_beta(a, b, x, 1.0 - x).1, 1e-13, 0.0),
        "mills_ratio" => (mills_ratio(a), 1e-15 + 1e-16 * a.min(0.0).powi(2), 0.0),
        // in the far tail, the rounding error of the argument is multiplied by the squared argument
        "normal_cdf" => (normal_cdf(a), 1e-15 + 1e-16 * a * a, 0.0),
        "normal_from_zero" => (normal_from_zero(a), 1e-15, 0.0),
        "half_normal_quantile" => (half_normal_quantile(a), 1e-14, 0.0),
        // for p near ½, the quantile is near 0 and has the rounding error of p − ½
        "normal_quantile" => (normal_quantile(a), 1e-14, 2e-16),
        "normal_upper_quantile" => (normal_upper_quantile(a), 1e-14, 0.0),
        "interval_ln_mass" => (NormalInterval::new(a, b).ln_mass, 1e-14, 1e-15),
        "interval_first" => (NormalInterval::new(a, b).first, 1e-13, 1e-15),
        // the value is a difference of terms of the size α²
        "interval_second" => (NormalInterval::new(a, b).second, 1e-13, 1e-14),
        other => panic!("no function {other}"),
    }
}

#[test]
fn functions_agree_with_sixty_digits() {
    let mut rows = 0;
    let mut failures = Vec::new();
    for line in include_str!("special.csv").lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let arguments = [1, 2, 3].map(|i| fields[i].parse().unwrap_or(f64::NAN));
        let expected: f64 = fields[4].parse().unwrap();
        let (got, relative, absolute) = evaluate(fields[0], arguments);
        let error = (got - expected).abs();
        if error.is_nan() || error > relative * expected.abs() + absolute {
            failures.push(format!("{line}: got {got:e}, relative error {:.1e}", error / expected));
        }
        rows += 1;
    }
    assert!(rows > 240);
    assert!(failures.is_empty(), "\n{}", failures.join("\n"));
}

#[test]
fn domains_end_in_nan() {
    for x in [0.0, -1.5, f64::NAN] {
        assert!(ln_gamma(x).is_nan());
        assert!(stirling_error(x).is_nan());
        assert!(ln_minus_digamma(x).is_nan());
        assert!(regularised_gamma(x, 1.0).0.is_nan());
        assert!(regularised_beta(x, 1.0, 0.5, 0.5).0.is_nan());
    }
    assert_eq!([0.0, 0.5, 1.0].map(normal_quantile), [f64::NEG_INFINITY, 0.0, f64::INFINITY]);
    assert!([-0.1, 1.1, f64::NAN].iter().all(|p| normal_quantile(*p).is_nan()));
    approx::assert_relative_eq!(digamma(1.0), -0.577_215_664_901_532_9, max_relative = 1e-14);
}

#[test]
fn quantiles_invert_their_tails() {
    for p in [1e-200, 1e-30, 1e-3, 0.3, 0.5, 0.8] {
        for a in [0.05, 0.7, 3.0, 250.0, 1e5] {
            let at = |tail| gamma_ln_quantile(a, p, tail).exp();
            // the rounding error of x changes ln P by a·ε
            let tolerance = 1e-13 + 1e-15 * a;
            let lower = regularised_gamma(a, at(Tail::Lower)).0;
            let underflow = at(Tail::Lower) < 1e-290;
            assert!(underflow || (lower / p - 1.0).abs() < tolerance * 100.0, "{a} {p} {lower:e}");
            let upper = regularised_gamma(a, at(Tail::Upper)).1;
            assert!((upper / p - 1.0).abs() < tolerance * 1000.0, "{a} {p} {upper:e}");
            for b in [0.4, 2.0, 80.0] {
                let at = |tail| logistic(beta_logit_quantile(a, b, p, tail));
                let (x, y) = at(Tail::Lower);
                let lower = regularised_beta(a, b, x, y).0;
                let underflow = x < 1e-290;
                assert!(underflow || (lower / p - 1.0).abs() < 1e-9, "{a} {b} {p} {lower:e}");
                let (x, y) = at(Tail::Upper);
                let upper = regularised_beta(a, b, x, y).1;
                let underflow = y < 1e-290;
                assert!(underflow || (upper / p - 1.0).abs() < 1e-9, "{a} {b} {p} {upper:e}");
            }
        }
    }
}
