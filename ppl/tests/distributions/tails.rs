//! Probabilities of far tails, of heavy tails and of narrow intervals, with their derivatives, compared with mpmath,
//! with other families, and in models that use them.

use ppl::prelude::*;
use ppl::special::Tail;
use ppl::{Dual, UnivariateDensity};

use crate::numerics::assert_close;

/// Reference values of ln P(lower < X < upper) and its derivatives with respect to the parameters: mpmath 1.3 with at
/// least 60 digits; the derivatives are central differences with this precision.
const REFERENCE: &str = include_str!("tails.csv");

struct Row {
    family: String,
    parameters: Vec<f64>,
    ends: [f64; 2],
    value: f64,
    slopes: Vec<f64>,
}

fn rows() -> Vec<Row> {
    let values = |cell: &str| -> Vec<f64> {
        cell.split(' ').map(|number| number.parse().expect("a number")).collect()
    };
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        Row {
            family: cells[0].to_owned(),
            parameters: values(cells[1]),
            ends: [values(cells[2])[0], values(cells[3])[0]],
            value: values(cells[4])[0],
            slopes: values(cells[5]),
        }
    };
    REFERENCE.lines().skip(1).map(row).collect()
}

type D = Dual<3>;

/// Checks three computations: with derivatives, with plain numbers, and, if one end is an end of the support, the tail
/// function.
fn check<P: UnivariateDensity<f64>, G: UnivariateDensity<D>>(row: &Row, plain: P, lifted: G) {
    let Row { family, parameters, ends: [lower, upper], value, slopes } = row;
    let name = format!("{family}{parameters:?} between {lower:e} and {upper:e}");
    let got: D = lifted.ln_mass(*lower, *upper);
    assert_close(got.value(), *value, 1e-12, 1e-13, &name);
    for (i, expected) in slopes.iter().enumerate() {
        assert_close(got.gradient()[i], *expected, 1e-10, 1e-12, &format!("∂{i} of {name}"));
    }
    let number = plain.ln_mass(*lower, *upper);
    assert_close(number, got.value(), 1e-13, 1e-14, &name);
    let (first, last) = plain.support().bounds();
    if *lower <= first {
        assert_close(plain.ln_tail(*upper, Tail::Lower), *value, 1e-12, 1e-13, &name);
    }
    if *upper >= last {
        assert_close(plain.ln_tail(*lower, Tail::Upper), *value, 1e-12, 1e-13, &name);
    }
}

#[test]
fn probabilities_of_intervals_agree_with_mpmath() {
    for row in &rows() {
        let p = |i: usize| row.parameters[i];
        let d = |i: usize| D::new(p(i), std::array::from_fn(|k| f64::from(u8::from(k == i))));
        match row.family.as_str() {
            "Gamma" => check(row, Gamma(p(0), p(1)), Gamma(d(0), d(1))),
            "Beta" => check(row, Beta(p(0), p(1)), Beta(d(0), d(1))),
            "StudentT" => {
                check(row, StudentT(p(0), p(1), p(2)), StudentT(d(0), d(1), d(2)));
            }
            "Weibull" => check(row, Weibull(p(0), p(1)), Weibull(d(0), d(1))),
            "HalfCauchy" => check(row, HalfCauchy(p(0)), HalfCauchy(d(0))),
            "Exponential" => check(row, Exponential(p(0)), Exponential(d(0))),
            "HalfNormal" => check(row, HalfNormal(p(0)), HalfNormal(d(0))),
            other => panic!("no family {other}"),
        }
    }
}
