//! Arrays and vectors of independent values: density, gradient and draws equal the results for
//! separate elements.

use ppl::Dual;
use ppl::prelude::*;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::numerics::{
    KOLMOGOROV_SMIRNOV_LIMIT, assert_close, constrained, derivative, kolmogorov_smirnov,
};

/// Compares an array and a vector of an element distribution with the element distribution.
fn assert_repeats<D>(name: &str, element: D, values: [f64; 3])
where
    D: Unknown<f64, Value = f64> + ppl::Univariate,
{
    let sum: f64 = values.iter().map(|x| element.ln_density(x)).sum();
    let (array, iid) = (element.clone().array::<3>(), element.clone().iid(3));
    assert_close(array.ln_density(&values), sum, 1e-14, 1e-14, name);
    assert_close(iid.ln_density(&values.to_vec()), sum, 1e-14, 1e-14, name);
    assert_eq!(iid.ln_density(&vec![values[0]; 2]), f64::NEG_INFINITY, "{name}: length");
    assert_eq!((array.dim(), iid.dim()), (3, 3));
    Distribution::<f64>::validate(&array).unwrap();
    Distribution::<f64>::validate(&iid).unwrap();

    let (mut from_array, mut from_iid) = (Vec::new(), Vec::new());
    array.unconstrain(&values, &mut from_array);
    iid.unconstrain(&values.to_vec(), &mut from_iid);
    assert_eq!(from_array, from_iid);
    for jacobian in [true, false] {
        let mut coordinates = from_array.iter().copied();
        let (x, ln_density) = constrained(&array, || coordinates.next().unwrap(), jacobian);
        let mut coordinates = from_array.iter().copied();
        let (same, same_density) = constrained(&iid, || coordinates.next().unwrap(), jacobian);
        assert_eq!((x.to_vec(), ln_density), (same, same_density));
        let by_element: f64 =
            from_array.iter().map(|&y| constrained(&element, || y, jacobian).1).sum();
        assert_close(ln_density, by_element, 1e-14, 1e-14, name);
        for (got, expected) in x.iter().zip(values) {
            assert_close(*got, expected, 1e-12, 0.0, name);
        }
    }

    // every entry has the distribution of an element, and neighbouring entries are uncorrelated
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let draws: Vec<[f64; 3]> = (0..10_000).map(|_| array.draw(&mut rng)).collect();
    let repeated: Vec<Vec<f64>> = (0..10_000).map(|_| iid.draw(&mut rng)).collect();
    for i in 0..3 {
        let column: Vec<f64> = draws.iter().map(|d| d[i]).collect();
        let other: Vec<f64> = repeated.iter().map(|d| d[i]).collect();
        for sample in [&column, &other] {
            let statistic = kolmogorov_smirnov(sample, |x| element.cdf(x));
            assert!(statistic < KOLMOGOROV_SMIRNOV_LIMIT, "{name}: {statistic}");
        }
    }
    let products: f64 =
        draws.iter().map(|d| (element.cdf(d[0]) - 0.5) * (element.cdf(d[1]) - 0.5)).sum();
    // the product of two centred uniform variables has the variance 1/144
    assert!(products.abs() < 4.0 * (10_000.0f64 / 144.0).sqrt(), "{name}: {products}");
}

#[test]
fn repeated_families() {
    assert_repeats("Normal", Normal(0.3, 2.0), [-1.0, 0.2, 4.0]);
    assert_repeats("Uniform", Uniform(-1.0, 4.0), [-0.5, 0.2, 3.0]);
    assert_repeats("HalfNormal", HalfNormal(2.0), [0.1, 0.2, 4.0]);
    assert_repeats("LogNormal", LogNormal(0.3, 0.8), [0.1, 0.2, 4.0]);
    assert_repeats("Exponential", Exponential(2.0), [0.1, 0.2, 1.0]);
    assert_repeats("Gamma", Gamma(0.3, 2.0), [0.1, 0.2, 4.0]);
    assert_repeats("Beta", Beta(1.3, 2.0), [0.1, 0.2, 0.9]);
    assert_repeats("StudentT", StudentT(3.0, 0.1, 2.0), [-1.0, 0.2, 4.0]);
    assert_repeats("HalfCauchy", HalfCauchy(2.0), [0.1, 0.2, 40.0]);
    assert_repeats("Truncated", Normal(0.15, 0.25).truncate(0.0..), [0.1, 0.2, 0.9]);
}

/// Checks that the derivative with respect to an unknown parameter is the sum over all elements.
#[test]
fn derivatives_of_repetitions() {
    let values = [0.1, 0.2, 0.9];
    let value = |mean: f64, sd: f64| -> f64 {
        Normal(mean, sd).truncate(0.0..).array::<3>().ln_density(&values)
    };
    let [mean, sd] = Dual::variables([0.15, 0.25]);
    let lifted = values.map(Dual::from);
    let array: Dual<2> = Normal(mean, sd).truncate(0.0..).array::<3>().ln_density(&lifted);
    let iid: Dual<2> = Normal(mean, sd).truncate(0.0..).iid(3).ln_density(&lifted.to_vec());
    assert_eq!(array.gradient(), iid.gradient());
    let numerical =
        [derivative(|m| value(m, 0.25), 0.15, 0.01), derivative(|s| value(0.15, s), 0.25, 0.01)];
    for (got, expected) in array.gradient().iter().zip(numerical) {
        assert_close(*got, expected, 1e-8, 1e-8, "array of truncated normals");
    }
}

/// Distributions of counts and flags can be repeated too.
#[test]
fn repeated_observations() {
    let ln_density: f64 = Poisson(3.0).array::<2>().ln_density(&[1, 4]);
    let one_by_one: f64 = [1, 4].iter().map(|k| -> f64 { Poisson(3.0).ln_density(k) }).sum();
    assert_eq!(ln_density, one_by_one);
    let ln_density: f64 = Bernoulli(0.2).iid(2).ln_density(&vec![true, false]);
    assert_close(ln_density, 0.16f64.ln(), 1e-15, 0.0, "two flips");
}
