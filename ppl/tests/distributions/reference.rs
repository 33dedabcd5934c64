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

fn factor<const K: usize>(entries: &[f64]) -> CholeskyFactor<f64, K> {
    CholeskyFactor::new(std::array::from_fn(|i| std::array::from_fn(|j| entries[i * K + j])))
        .expect("a factor")
}

/// The densities over factors of size K, or vectors of that length.
fn ln_density_of_size<const K: usize>(family: &str, x: &[f64], p: &[f64]) -> f64 {
    let vector = |v: &[f64]| -> [f64; K] { std::array::from_fn(|i| v[i]) };
    match family {
        "MvStudentTCholesky" => MvStudentTCholesky(p[0], vector(&p[1..]), factor::<K>(&p[1 + K..]))
            .ln_density(&vector(x)),
        "WishartCholesky" => WishartCholesky(p[0], factor::<K>(&p[1..])).ln_density(&factor(x)),
        "InverseWishartCholesky" => {
            InverseWishartCholesky(p[0], factor::<K>(&p[1..])).ln_density(&factor(x))
        }
        "LkjCholesky" => LkjCholesky::<K>(p[0]).ln_density(&factor(x)),
        other => panic!("no family {other}"),
    }
}

/// The same for vectors, matrices and categories (`vectors.csv`, made by `vectors.py`).
#[test]
fn vector_log_densities_agree_with_fifty_digits() {
    let mut rows = 0;
    for line in include_str!("vectors.csv").lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let numbers = |field: &str| -> Vec<f64> {
            field.split(' ').map(|x| x.parse().expect("a number")).collect()
        };
        let (family, x, p) = (fields[0], numbers(fields[1]), numbers(fields[2]));
        let expected: f64 = fields[3].parse().unwrap();
        let counts: Vec<u64> = x.iter().map(|&k| k as u64).collect();
        let got: f64 = match (family, x.len()) {
            ("Dirichlet", _) => Dirichlet(&p).ln_density(&x),
            ("Multinomial", _) => Multinomial(counts.iter().sum(), &p).ln_density(&counts),
            ("CategoricalLogit", _) => CategoricalLogit(&p).ln_density(&counts[0]),
            ("OrderedLogistic", _) => OrderedLogistic(p[0], &p[1..]).ln_density(&counts[0]),
            (_, 2 | 4) => ln_density_of_size::<2>(family, &x, &p),
            _ => ln_density_of_size::<3>(family, &x, &p),
        };
        // log gamma functions of large arguments cancel: the error is that of the largest one
        let largest = p.iter().chain(&x).fold(1.0f64, |m, v| m.max(v.abs()));
        let absolute = match family {
            "Dirichlet" | "Multinomial" => 4.0 * f64::EPSILON * largest * largest.ln().max(1.0),
            "WishartCholesky" | "InverseWishartCholesky" => 1e-13,
            _ => 1e-14,
        };
        assert_close(got, expected, 1e-14, absolute, line);
        rows += 1;
    }
    assert!(rows >= 35, "{rows} rows");
}
