//! What must hold for every distribution of one count, in every variation.

use ppl::prelude::*;
use ppl::{Count, CountMass, Dual, Interval};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::conformance::Lifted;
use crate::numerics::{assert_chi_squared, assert_close, derivative};

const DRAWS: usize = 20_000;

/// A distribution over counts, as numbers.
pub(crate) trait Plain: CountMass<f64> + Numeric<f64, Value = u64> {}
impl<D: CountMass<f64> + Numeric<f64, Value = u64>> Plain for D {}

/// The same with derivatives.
pub(crate) trait Differentiated: CountMass<Lifted> + Numeric<Lifted, Value = u64> {}
impl<D: CountMass<Lifted> + Numeric<Lifted, Value = u64>> Differentiated for D {}

/// Checks one case of one family, whose masses beyond the count `last` are negligible.
///
/// `assert_counts!([l] Poisson(l), [7.5], 90)`
macro_rules! assert_counts {
    ([$($p:ident),*] $distribution:expr, $parameters:expr, $last:expr) => {
        $crate::counts::assert_conformance(
            &format!("{} at {:?}", stringify!($distribution), $parameters),
            $parameters,
            $last,
            &|[$($p),*]: [f64; _]| $distribution,
            &|[$($p),*]: [$crate::conformance::Lifted; _]| $distribution,
        )
    };
}
pub(crate) use assert_counts;

pub(crate) fn assert_conformance<const P: usize, D: Plain, G: Differentiated>(
    name: &str,
    parameters: [f64; P],
    last: u64,
    make: &dyn Fn([f64; P]) -> D,
    lifted: &dyn Fn([Lifted; P]) -> G,
) {
    let plain = make(parameters);
    Count::validate(&plain).unwrap_or_else(|e| panic!("{name}: {e}"));
    let masses: Vec<f64> = (0..=last).map(|k| plain.ln_density(&k).exp()).collect();
    moments_and_tails(name, &plain, &masses);

    let unit = |i: usize| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 });
    let dual = lifted(std::array::from_fn(|i| Dual::new(parameters[i], unit(i + 1))));
    let check = |what: &str, got: Lifted, expected: f64, value: &dyn Fn(&D) -> f64| {
        let name = format!("{what}, {name}");
        assert_close(got.value(), expected, 1e-10, 1e-10, &name);
        for i in 0..P {
            let p = parameters[i];
            let moved = |q: f64| {
                let mut parameters = parameters;
                parameters[i] = q;
                value(&make(parameters))
            };
            let numerical = derivative(moved, p, 0.02 * p.abs().max(0.05));
            let what = format!("∂{i} of {name}");
            assert_close(got.gradient()[i + 1], numerical, 2e-8, 2e-8, &what);
        }
    };
    let likely: Vec<u64> = (0..=last).filter(|&k| masses[k as usize] > 1e-12).collect();
    let [first, second, third] = [0.1, 0.6, 0.95].map(|p| plain.quantile(p));
    for k in [likely[0], second, likely[likely.len() - 1]] {
        let expected = masses[k as usize].ln();
        check(&format!("mass of {k}"), dual.ln_density(&k), expected, &|d| d.ln_density(&k));
    }
    // with the closed upper end, half open, and without one
    let sum = |range: std::ops::RangeInclusive<u64>| -> f64 {
        range.map(|k| masses[k as usize]).sum::<f64>().ln()
    };
    let intervals = [
        (Interval::new(first as f64..=third as f64), sum(first..=third)),
        (Interval::new(..third as f64 + 1.0), sum(0..=third)),
        (Interval::new(second as f64..), sum(second..=last)),
    ];
    for (interval, expected) in intervals {
        let what = format!("probability of {interval:?}");
        check(&what, dual.ln_probability(interval), expected, &|d| d.ln_probability(interval));
    }
    let inside = first as f64..=third as f64;
    check(
        "truncated",
        dual.clone().truncate(inside.clone()).ln_density(&second),
        masses[second as usize].ln() - sum(first..=third),
        &|d| d.clone().truncate(inside.clone()).ln_density(&second),
    );
    for (k, expected) in [(first, sum(0..=first)), (third, sum(third..=last))] {
        check("censored", dual.clone().censor(inside.clone()).ln_density(&k), expected, &|d| {
            d.clone().censor(inside.clone()).ln_density(&k)
        });
    }
    let pair = [first, second];
    let both: f64 = pair.iter().map(|k| plain.ln_density(k)).sum();
    assert_close(plain.clone().array::<2>().ln_density(&pair), both, 1e-14, 1e-14, name);
    assert_close(plain.clone().iid(2).ln_density(&pair.to_vec()), both, 1e-14, 1e-14, name);

    draws(name, &plain, &masses, first..=third);
}

fn moments_and_tails<D: Plain>(name: &str, plain: &D, masses: &[f64]) {
    let sum = |g: &dyn Fn(f64) -> f64| -> f64 {
        masses.iter().enumerate().map(|(k, p)| p * g(k as f64)).sum()
    };
    assert_close(sum(&|_| 1.0), 1.0, 1e-12, 0.0, &format!("sum, {name}"));
    let mean = plain.mean();
    assert_close(mean, sum(&|k| k), 1e-11, 0.0, &format!("mean, {name}"));
    let variance = sum(&|k| (k - mean).powi(2));
    assert_close(plain.variance(), variance, 1e-10, 0.0, &format!("variance, {name}"));
    for (k, mass) in masses.iter().enumerate().filter(|(_, mass)| **mass > 1e-13) {
        let below: f64 = masses[..=k].iter().sum();
        let above: f64 = masses[k + 1..].iter().rev().sum();
        let name = format!("at {k}, {name}");
        assert_close(plain.cdf(k as u64), below, 1e-11, 0.0, &format!("lower tail {name}"));
        assert_close(plain.sf(k as u64), above, 1e-11, 1e-17, &format!("upper tail {name}"));
        // a probability in the middle of the step is unambiguous
        let middle = plain.cdf(k as u64) - 0.5 * mass;
        if *mass > 1e-9 {
            assert_eq!(plain.quantile(middle), k as u64, "quantile {name}");
            let middle = plain.sf(k as u64) + 0.5 * mass;
            assert_eq!(plain.upper_quantile(middle), k as u64, "upper quantile {name}");
        }
    }
}

/// χ² of the draws of every variation.
fn draws<D: Plain>(name: &str, plain: &D, masses: &[f64], inside: std::ops::RangeInclusive<u64>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut check = |what: &str, masses: &[f64], draw: &dyn Fn(&mut Xoshiro256PlusPlus) -> u64| {
        let draws: Vec<u64> = (0..DRAWS).map(|_| draw(&mut rng)).collect();
        assert_chi_squared(&draws, masses, &format!("{what}, {name}"));
    };
    check("draws", masses, &|rng| Distribution::<f64>::draw(plain, rng));
    let iid = plain.clone().iid(2);
    check("iid", masses, &|rng| Distribution::<f64>::draw(&iid, rng)[1]);
    let array = plain.clone().array::<2>();
    check("array", masses, &|rng| Distribution::<f64>::draw(&array, rng)[1]);

    let (first, last) = (*inside.start() as usize, *inside.end() as usize);
    let bounds = first as f64..=last as f64;
    let mut conditioned = vec![0.0; masses.len()];
    let total: f64 = masses[first..=last].iter().sum();
    (first..=last).for_each(|k| conditioned[k] = masses[k] / total);
    let truncated = plain.clone().truncate(bounds.clone());
    check("truncated", &conditioned, &|rng| Distribution::<f64>::draw(&truncated, rng));

    let mut recorded = vec![0.0; masses.len()];
    for (k, p) in masses.iter().enumerate() {
        recorded[k.clamp(first, last)] += p;
    }
    let censored = plain.clone().censor(bounds);
    check("censored", &recorded, &|rng| Distribution::<f64>::draw(&censored, rng));
}
