//! What must hold for every distribution of one number in every variation.

use ppl::Dual;
use ppl::prelude::*;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::conformance::{Case, Differentiated, Lifted, Plain};
use crate::numerics::{KOLMOGOROV_SMIRNOV_LIMIT, assert_close, derivative, kolmogorov_smirnov};

const DRAWS: usize = 1_000;

/// `.truncate`, `.censor`, `.iid` and `.array` of one case, with the 10 % and 80 % quantiles as
/// bounds.
pub(crate) fn assert_wrappers<const P: usize, D: Plain, G: Differentiated>(
    case: &Case<P>,
    make: &dyn Fn([f64; P]) -> D,
    lifted: &dyn Fn([Lifted; P]) -> G,
) {
    let plain = make(case.parameters);
    let [lower, middle, upper] = [0.1, 0.5, 0.8].map(|p| plain.quantile(p));
    let inside = lower..upper;
    let unit = |i: usize| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 });
    let parameters: [Lifted; P] =
        std::array::from_fn(|i| Dual::new(case.parameters[i], unit(i + 1)));
    let dual = lifted(parameters);

    // values, and their derivatives in every parameter against differences of them
    let check = |what: &str, got: Lifted, expected: f64, value: &dyn Fn(&D) -> f64| {
        let name = format!("{what}, {}", case.name);
        assert_close(got.value(), expected, 1e-9, 1e-9, &name);
        for i in 0..P {
            let p = case.parameters[i];
            let moved = |q: f64| {
                let mut parameters = case.parameters;
                parameters[i] = q;
                value(&make(parameters))
            };
            let step = (0.01 * p.abs().max(0.05)).min(0.2 * (upper - lower));
            let numerical = derivative(moved, p, step);
            let what = format!("∂{i} of {name}");
            assert_close(got.gradient()[i + 1], numerical, 2e-8, 2e-8, &what);
        }
    };
    let own: f64 = plain.ln_density(&middle);
    let mass = plain.cdf(upper) - plain.cdf(lower);
    check(
        "truncated",
        dual.clone().truncate(inside.clone()).ln_density(&Dual::from(middle)),
        own - mass.ln(),
        &|d| d.clone().truncate(inside.clone()).ln_density(&middle),
    );
    let censored = |x: f64| dual.clone().censor(inside.clone()).ln_density(&Dual::from(x));
    let expected = [(lower, plain.cdf(lower).ln()), (middle, own), (upper, plain.sf(upper).ln())];
    for (x, expected) in expected {
        check("censored", censored(x), expected, &|d| {
            d.clone().censor(inside.clone()).ln_density(&x)
        });
    }
    // beyond a bound counts as at it
    assert_eq!(censored(lower - 1.0).value(), censored(lower).value());
    assert_eq!(censored(upper + 1.0).value(), censored(upper).value());

    let pair = [lower, middle];
    let sum: f64 = pair.iter().map(|x| plain.ln_density(x)).sum();
    assert_close(plain.clone().array::<2>().ln_density(&pair), sum, 1e-14, 1e-14, case.name);
    assert_close(plain.clone().iid(2).ln_density(&pair.to_vec()), sum, 1e-14, 1e-14, case.name);

    draws(case.name, &plain, lower, upper);
}

/// Draws of every variation, brought to (0, 1) by the distribution function, are uniform.
fn draws<D: Plain>(name: &str, plain: &D, lower: f64, upper: f64) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    let mut assert_uniform = |what: &str, draw: &dyn Fn(&mut Xoshiro256PlusPlus) -> f64| {
        let uniform: Vec<f64> = (0..DRAWS).map(|_| draw(&mut rng)).collect();
        let statistic = kolmogorov_smirnov(&uniform, |p| p);
        assert!(statistic < KOLMOGOROV_SMIRNOV_LIMIT, "{what}, {name}: {statistic}");
    };
    let truncated = plain.clone().truncate(lower..upper);
    let (below, above) = (plain.cdf(lower), plain.cdf(upper));
    assert_uniform("truncated", &|rng| {
        (plain.cdf(Distribution::<f64>::draw(&truncated, rng)) - below) / (above - below)
    });
    // at a bound the distribution function jumps: a uniform place within the jump
    let censored = plain.clone().censor(lower..upper);
    assert_uniform("censored", &|rng| {
        let x = Distribution::<f64>::draw(&censored, rng);
        let u: f64 = rng.random();
        if x <= lower {
            below * u
        } else if x >= upper {
            above + (1.0 - above) * u
        } else {
            plain.cdf(x)
        }
    });
    let iid = plain.clone().iid(3);
    assert_uniform("iid", &|rng| plain.cdf(Distribution::<f64>::draw(&iid, rng)[2]));
    let array = plain.clone().array::<3>();
    assert_uniform("array", &|rng| plain.cdf(Distribution::<f64>::draw(&array, rng)[1]));
}
