//! Log densities and distribution functions, compared with scipy 1.17 (`scipy_families.csv`, written by
//! `scipy_families.py`), and conformance tests of the vector distributions among these families.

use ppl::prelude::*;

use crate::counts::assert_counts;
use crate::numerics::assert_close;
use crate::vector_conformance::{assert_unknown, unknown};

fn factor<R: Scalar>(p: &[R]) -> CholeskyFactor<R, 2> {
    CholeskyFactor::new([[p[0], R::from(0.0)], [p[1], p[2]]]).expect("a factor")
}

/// Returns log density, distribution function and survival function for a row; NaN if scipy does not have the function.
fn evaluate(family: &str, p: &[f64], x: &[f64]) -> [f64; 3] {
    fn univariate<D: Univariate + Distribution<f64, Value = f64>>(d: D, x: f64) -> [f64; 3] {
        [d.ln_density(&x), d.cdf(x), d.sf(x)]
    }
    let vector = |ln_density: f64| [ln_density, f64::NAN, f64::NAN];
    match family {
        "InverseGamma" => univariate(InverseGamma(p[0], p[1]), x[0]),
        "Gumbel" => univariate(Gumbel(p[0], p[1]), x[0]),
        "Cauchy" => univariate(Cauchy(p[0], p[1]), x[0]),
        "Triangular" => univariate(Triangular(p[0], p[1], p[2]), x[0]),
        "NegativeBinomial" => {
            let counts = NegativeBinomial(p[0], p[1]);
            let mass = |k: &u64| {
                let ln_mass: f64 = counts.ln_density(k);
                ln_mass.exp()
            };
            let k = x[0] as u64;
            let cdf: f64 = (0..=k).map(|k| mass(&k)).sum();
            let sf: f64 = (k + 1..k + 3000).map(|k| mass(&k)).sum();
            [counts.ln_density(&k), cdf, sf]
        }
        "Dirichlet" => vector(Dirichlet([p[0], p[1], p[2]]).ln_density(&[x[0], x[1], x[2]])),
        "MvStudentTCholesky" => {
            let joint = MvStudentTCholesky(p[0], [p[1], p[2]], factor(&p[3..]));
            vector(joint.ln_density(&[x[0], x[1]]))
        }
        other => panic!("no family {other}"),
    }
}

#[test]
fn families_agree_with_scipy() {
    let mut rows = 0;
    for line in include_str!("scipy_families.csv").lines().skip(1) {
        let fields: Vec<&str> = line.split(',').collect();
        let values = |field: &str| -> Vec<f64> {
            field.split(' ').map(|x| x.parse().expect("a number")).collect()
        };
        let found = evaluate(fields[0], &values(fields[1]), &values(fields[2]));
        for (i, what) in ["ln density", "cdf", "sf"].into_iter().enumerate() {
            if let Ok(expected) = fields[3 + i].parse::<f64>() {
                assert_close(found[i], expected, 1e-10, 1e-10, &format!("{what}: {line}"));
            }
        }
        rows += 1;
    }
    assert!(rows >= 58, "{rows} rows");
}

#[test]
fn counts_with_more_variance_than_mean() {
    assert_counts!([m, r] NegativeBinomial(m, r), [3.0, 1.0], 300);
    assert_counts!([m, r] NegativeBinomial(m, r), [7.5, 20.0], 200);
    assert_counts!([m, r] NegativeBinomial(m, r), [0.4, 0.3], 200);
    // the Poisson distribution is the limit for large shapes
    let limit: f64 = NegativeBinomial(3.0, 1e12).ln_density(&5);
    assert_close(limit, Poisson(3.0).ln_density(&5), 0.0, 1e-10, "large shape");
}

unknown!(Shares, |p| Dirichlet([p[0], p[1], p[2]]));
unknown!(Joint, |p| MvStudentTCholesky(p[0], [p[1], p[2]], factor(&p[3..])));

#[test]
fn vectors_are_unknowns() {
    assert_unknown("Dirichlet", &Shares, &[2.0, 3.0, 1.5], &[0.4, -0.7], &[0, 1]);
    assert_unknown("t", &Joint, &[5.0, 0.2, -0.1, 0.9, -0.3, 1.2], &[0.4, -0.7], &[0, 1]);
}

/// Shares below the smallest number: the density over coordinates is finite.
#[test]
fn a_dirichlet_reaches_far_corners() {
    use ppl::{Accumulator, Joined, Unknown};

    let shares = Dirichlet([0.01, 0.01, 0.01]);
    for corner in [[-3000.0, 1.0], [2000.0, 1.0], [1.0, -2000.0]] {
        let mut coordinates = corner.into_iter();
        let ln_density: f64 = Joined::of(|terms| {
            let next = &mut || coordinates.next().expect("two coordinates");
            let x: [f64; 3] = shares.constrain(next, true, terms);
            terms.add_number(x.iter().sum::<f64>() - 1.0);
        });
        assert!(ln_density.is_finite(), "{ln_density} at {corner:?}");
    }
    assert_eq!(Distribution::<f64>::ln_density(&shares, &[0.5, 0.6, 0.1]), f64::NEG_INFINITY);
    assert_eq!(Distribution::<f64>::ln_density(&shares, &[-0.1, 0.6, 0.5]), f64::NEG_INFINITY);
}
