//! Conformance tests for distributions of one count.

use ppl::prelude::*;
use ppl::{Dual, Joined};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::numerics::{assert_chi_squared, assert_close, derivative};
use ppl::check::Lifted;

const DRAWS: usize = 20_000;

/// Checks one case of a family: masses, derivatives, draws, and, if the family has moments, mean and variance. The
/// masses of counts above `last` must be negligible.
///
/// `assert_counts!([l] Poisson(l), [7.5], 90)`
macro_rules! assert_counts {
    ([$($p:ident),*] $distribution:expr, $parameters:expr, $last:expr) => {
        $crate::counts::assert_counts!(@ [$($p),*] $distribution, $parameters, $last, {
            let [$($p),*]: [f64; _] = $parameters;
            Some(($distribution.mean(), $distribution.variance()))
        })
    };
    ([$($p:ident),*] $distribution:expr, $parameters:expr, $last:expr, without moments) => {
        $crate::counts::assert_counts!(@ [$($p),*] $distribution, $parameters, $last, { None })
    };
    (@ [$($p:ident),*] $distribution:expr, $parameters:expr, $last:expr, $moments:block) => {
        $crate::counts::assert_conformance(
            &format!("{} at {:?}", stringify!($distribution), $parameters),
            $parameters,
            $last,
            &|[$($p),*]: [f64; _]| $distribution,
            &|[$($p),*]: [ppl::check::Lifted; _]| $distribution,
            $moments,
        )
    };
}
pub(crate) use assert_counts;

pub(crate) fn assert_conformance<const P: usize, D, G>(
    name: &str,
    parameters: [f64; P],
    last: u64,
    make: &dyn Fn([f64; P]) -> D,
    lifted: &dyn Fn([Lifted; P]) -> G,
    moments: Option<(f64, f64)>,
) where
    D: Distribution<f64, Value = u64>,
    G: Distribution<Lifted, Value = u64>,
{
    let plain = make(parameters);
    plain.validate().unwrap_or_else(|e| panic!("{name}: {e}"));
    let masses: Vec<f64> = (0..=last).map(|k| plain.ln_density(&k).exp()).collect();
    let sum = |g: &dyn Fn(f64) -> f64| -> f64 {
        masses.iter().enumerate().map(|(k, p)| p * g(k as f64)).sum()
    };
    assert_close(sum(&|_| 1.0), 1.0, 1e-12, 0.0, &format!("sum, {name}"));
    if let Some((mean, variance)) = moments {
        assert_close(mean, sum(&|k| k), 1e-11, 0.0, &format!("mean, {name}"));
        let by_sum = sum(&|k| (k - mean).powi(2));
        assert_close(variance, by_sum, 1e-10, 0.0, &format!("variance, {name}"));
    }

    let unit = |i: usize| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 });
    let dual = lifted(std::array::from_fn(|i| Dual::new(parameters[i], unit(i + 1))));
    let likely: Vec<u64> = (0..=last).filter(|&k| masses[k as usize] > 1e-12).collect();
    for k in [likely[0], likely[likely.len() / 2], likely[likely.len() - 1]] {
        let name = format!("mass of {k}, {name}");
        let got = dual.ln_density(&k);
        assert_close(got.value(), plain.ln_density(&k), 1e-13, 1e-13, &name);
        let by_terms = Joined::of(|terms| dual.add_terms(&k, terms));
        assert_close(by_terms.value(), got.value(), 1e-13, 1e-13, &name);
        for i in 0..P {
            let moved = |q: f64| {
                let mut parameters = parameters;
                parameters[i] = q;
                make(parameters).ln_density(&k)
            };
            let p = parameters[i];
            let numerical = derivative(moved, p, 0.02 * p.abs().max(0.05));
            let what = format!("∂{i} of {name}");
            assert_close(got.gradient()[i + 1], numerical, 2e-8, 2e-8, &what);
            assert_close(by_terms.gradient()[i + 1], numerical, 2e-8, 2e-8, &what);
        }
    }
    let pair = [likely[0], likely[likely.len() / 2]];
    let both: f64 = pair.iter().map(|k| plain.ln_density(k)).sum();
    assert_close(plain.clone().array::<2>().ln_density(&pair), both, 1e-14, 1e-14, name);
    assert_close(plain.clone().iid(2).ln_density(&pair.to_vec()), both, 1e-14, 1e-14, name);
    let another: f64 = plain.clone().iid(2).ln_density(&vec![0; 3]);
    assert_eq!(another, f64::NEG_INFINITY, "{name}");

    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut check = |what: &str, draw: &dyn Fn(&mut Xoshiro256PlusPlus) -> u64| {
        let draws: Vec<u64> = (0..DRAWS).map(|_| draw(&mut rng)).collect();
        assert_chi_squared(&draws, &masses, &format!("{what}, {name}"));
    };
    check("draws", &|rng| plain.draw(rng));
    let (iid, array) = (plain.clone().iid(2), plain.clone().array::<2>());
    check("iid", &|rng| iid.draw(rng)[1]);
    check("array", &|rng| array.draw(rng)[1]);
}
