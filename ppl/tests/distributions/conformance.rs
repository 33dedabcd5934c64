//! What must hold for every distribution of one number.

use ppl::prelude::*;
use ppl::{Dual, Joined, Univariate, UnivariateDensity};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::numerics::{
    KOLMOGOROV_SMIRNOV_LIMIT, assert_close, constrained, derivative, half_integral, integral,
    kolmogorov_smirnov, moments,
};

/// Room for x and up to five parameters.
pub(crate) type Lifted = Dual<6>;

const DRAWS: usize = 20_000;

/// A log density as a function of x, or of y.
type Value<D> = fn(&D, f64) -> f64;

/// A distribution over `f64` that can be an unknown.
pub(crate) trait Plain: UnivariateDensity<f64> + Unknown<f64, Value = f64> {}
impl<D> Plain for D where D: UnivariateDensity<f64> + Unknown<f64, Value = f64> {}

/// The same with derivatives.
pub(crate) trait Differentiated:
    UnivariateDensity<Lifted> + Unknown<Lifted, Value = Lifted>
{
}
impl<D> Differentiated for D where D: UnivariateDensity<Lifted> + Unknown<Lifted, Value = Lifted> {}

/// A family with the values of its parameters, and points well inside the support.
pub(crate) struct Case<'a, const P: usize> {
    pub(crate) name: &'a str,
    pub(crate) parameters: [f64; P],
    pub(crate) points: &'a [f64],
    /// Where the density has a corner, which quadrature must not cross.
    pub(crate) corner: Option<f64>,
}

/// Checks one case of one family: written once for numbers, once for numbers with derivatives.
///
/// `assert_distribution!([m, s] Normal(m, s), [0.3, 2.0], [-1.0, 0.5])`, and with `corner 0.3` at
/// the end where the density has one.
macro_rules! assert_distribution {
    ([$($p:ident),*] $distribution:expr, $parameters:expr, $points:expr) => {
        $crate::conformance::assert_distribution!(
            @ [$($p),*] $distribution, $parameters, $points, None)
    };
    ([$($p:ident),*] $distribution:expr, $parameters:expr, $points:expr, corner $corner:expr) => {
        $crate::conformance::assert_distribution!(
            @ [$($p),*] $distribution, $parameters, $points, Some($corner))
    };
    (@ [$($p:ident),*] $distribution:expr, $parameters:expr, $points:expr, $corner:expr) => {
        $crate::conformance::assert_conformance(
            &$crate::conformance::Case {
                name: &format!("{} at {:?}", stringify!($distribution), $parameters),
                parameters: $parameters,
                points: &$points,
                corner: $corner,
            },
            &|[$($p),*]: [f64; _]| $distribution,
            &|[$($p),*]: [$crate::conformance::Lifted; _]| $distribution,
        )
    };
}
pub(crate) use assert_distribution;

pub(crate) fn assert_conformance<const P: usize, D: Plain, G: Differentiated>(
    case: &Case<P>,
    make: &dyn Fn([f64; P]) -> D,
    lifted: &dyn Fn([Lifted; P]) -> G,
) {
    let distribution = make(case.parameters);
    Univariate::validate(&distribution).unwrap_or_else(|e| panic!("{}: {e}", case.name));
    integrates_to_one(case, &distribution);
    derivatives(case, make, lifted);
    maps(case, &distribution);
    distribution_functions(case, &distribution);
    draws(case, &distribution);
    crate::wrappers::assert_wrappers(case, make, lifted);
}

/// A place and a width of the unconstrained density, from its quartiles.
fn place<D: Plain>(distribution: &D) -> (f64, f64) {
    let support = distribution.support();
    let [first, median, third] =
        [0.25, 0.5, 0.75].map(|p| support.unconstrain(distribution.quantile(p)));
    (median, third - first)
}

fn density<D: Plain>(distribution: &D, y: f64) -> f64 {
    // beyond, eʸ leaves the range of numbers, and no mass is left
    if y.abs() > 650.0 && distribution.support().bounds().0.is_finite() {
        return 0.0;
    }
    Joined::of(|terms| {
        distribution.at_coordinate(y, terms);
    })
    .exp()
}

/// ∫ g(x) p(x) dx.
fn expectation<D: Plain>(distribution: &D, corner: Option<f64>, g: &dyn Fn(f64) -> f64) -> f64 {
    let (centre, scale) = place(distribution);
    let scale = scale.abs();
    let support = distribution.support();
    let integrand = |y: f64| {
        let p = density(distribution, y);
        if p == 0.0 { 0.0 } else { p * g(support.constrain(y).0) }
    };
    match corner.map(|x| support.unconstrain(x)) {
        Some(y) => {
            half_integral(integrand, y, -1.0, scale) + half_integral(integrand, y, 1.0, scale)
        }
        None => integral(integrand, centre, scale),
    }
}

fn integrates_to_one<const P: usize, D: Plain>(case: &Case<P>, distribution: &D) {
    let name = case.name;
    let expectation = |g: &dyn Fn(f64) -> f64| expectation(distribution, case.corner, g);
    assert_close(expectation(&|_| 1.0), 1.0, 1e-11, 0.0, &format!("∫p, {name}"));
    let mean = distribution.mean();
    if mean.is_finite() {
        let by_quadrature = expectation(&|x| x);
        let scale = place(distribution).1.abs().min(1.0) * 1e-10;
        // the moments of a truncation are integrals of distribution functions across the corner
        let loss = if case.corner.is_some() { 100.0 } else { 1.0 };
        assert_close(mean, by_quadrature, loss * 1e-9, scale, &format!("mean, {name}"));
        let variance = distribution.variance();
        if variance.is_finite() {
            let by_quadrature = expectation(&|x| (x - mean).powi(2));
            assert_close(variance, by_quadrature, loss * 1e-8, 0.0, &format!("variance, {name}"));
        }
    }
}

/// Partials in x (or y) and every parameter against extrapolated differences of the values.
fn derivatives<const P: usize, D: Plain, G: Differentiated>(
    case: &Case<P>,
    make: &dyn Fn([f64; P]) -> D,
    lifted: &dyn Fn([Lifted; P]) -> G,
) {
    let unit = |i: usize| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 });
    let parameters: [Lifted; P] =
        std::array::from_fn(|i| Dual::new(case.parameters[i], unit(i + 1)));
    let reading = lifted(parameters);
    let plain = make(case.parameters);
    for &x in case.points {
        let support = UnivariateDensity::<f64>::support(&plain);
        let y = support.unconstrain(x);
        let readings: [(&str, f64, Lifted, Value<D>); 3] = [
            ("ln_density", x, reading.ln_density(&Dual::new(x, unit(0))), |d, x| d.ln_density(&x)),
            (
                "constrain with Jacobian",
                y,
                constrained(&reading, || Dual::new(y, unit(0)), true).1,
                |d, y| constrained(d, || y, true).1,
            ),
            (
                "constrain without Jacobian",
                y,
                constrained(&reading, || Dual::new(y, unit(0)), false).1,
                |d, y| constrained(d, || y, false).1,
            ),
        ];
        for (what, at, dual, value) in readings {
            let name = format!("{what} at {at}, {}", case.name);
            assert_close(dual.value(), value(&plain, at), 1e-13, 1e-13, &name);
            let gradient = dual.gradient();
            let (low, high) = if what == "ln_density" {
                support.bounds()
            } else {
                (f64::NEG_INFINITY, f64::INFINITY)
            };
            let step = (0.05 * at.abs().max(0.2)).min(0.2 * (at - low)).min(0.2 * (high - at));
            let numerical = derivative(|at| value(&plain, at), at, step);
            assert_close(gradient[0], numerical, 1e-8, 1e-8, &format!("∂x of {name}"));
            for i in 0..P {
                let p = case.parameters[i];
                let moved = |q: f64| {
                    let mut parameters = case.parameters;
                    parameters[i] = q;
                    value(&make(parameters), at)
                };
                let numerical = derivative(moved, p, 0.02 * p.abs().max(0.05));
                assert_close(gradient[i + 1], numerical, 1e-8, 1e-8, &format!("∂{i} of {name}"));
            }
        }
    }
}

/// Unconstrained and constrained density differ by the log-Jacobian; the maps are inverse.
fn maps<const P: usize, D: Plain>(case: &Case<P>, distribution: &D) {
    for &x in case.points {
        let name = format!("maps at {x}, {}", case.name);
        let mut y = Vec::new();
        Unknown::<f64>::unconstrain(distribution, &x, &mut y);
        let (back, ln_density) = constrained(distribution, || y[0], true);
        assert_close(back, x, 1e-12, 0.0, &name);
        let step = 0.05 * y[0].abs().max(0.2);
        let support = distribution.support();
        let jacobian = derivative(|y| support.constrain(y).0, y[0], step);
        let expected = distribution.ln_density(&back) + jacobian.abs().ln();
        assert_close(ln_density, expected, 1e-9, 1e-9, &name);
        let (_, without) = constrained(distribution, || y[0], false);
        assert_close(without, distribution.ln_density(&back), 1e-13, 1e-13, &name);
    }
    let (low, high) = distribution.support().bounds();
    for outside in [low - 1.0, high + 1.0].into_iter().filter(|x| x.is_finite()) {
        assert_eq!(distribution.ln_density(&outside), f64::NEG_INFINITY, "{}", case.name);
    }
}

fn distribution_functions<const P: usize, D: Plain>(case: &Case<P>, distribution: &D) {
    let (_, scale) = place(distribution);
    let support = distribution.support();
    for &x in case.points {
        let name = format!("at {x}, {}", case.name);
        let (below, above) = (distribution.cdf(x), distribution.sf(x));
        let y = support.unconstrain(x);
        let p = |y: f64| density(distribution, y);
        // the coordinate may run against x
        let direction = scale.signum();
        let (smaller, towards) =
            if below < above { (below, -direction) } else { (above, direction) };
        let by_quadrature = half_integral(p, y, towards, scale.abs());
        assert_close(smaller, by_quadrature, 1e-9, 0.0, &format!("smaller tail {name}"));
        assert_close(below + above, 1.0, 1e-15, 0.0, &format!("both tails {name}"));
        // an error of the probability by its rounding moves x by ε · tail/density
        let pdf = distribution.ln_density(&x).exp();
        if below < 0.9 {
            let tolerance = 1e-12 * below / pdf + 1e-14 * x.abs();
            let back = distribution.quantile(below);
            assert_close(back, x, 0.0, tolerance, &format!("quantile {name}"));
        }
        if above < 0.9 {
            let tolerance = 1e-12 * above / pdf + 1e-14 * x.abs();
            let back = distribution.upper_quantile(above);
            assert_close(back, x, 0.0, tolerance, &format!("upper quantile {name}"));
        }
    }
    let (low, high) = support.bounds();
    for (end, below) in [(low - 1.0, 0.0), (high + 1.0, 1.0)] {
        if end.is_finite() {
            assert_eq!(distribution.cdf(end), below, "cdf outside, {}", case.name);
            assert_eq!(distribution.sf(end), 1.0 - below, "sf outside, {}", case.name);
        }
    }
}

/// 20 000 draws: Kolmogorov–Smirnov at α = 10⁻⁴, mean and variance within 4.5 standard errors.
fn draws<const P: usize, D: Plain>(case: &Case<P>, distribution: &D) {
    let name = case.name;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let draws: Vec<f64> = (0..DRAWS).map(|_| distribution.sample(&mut rng)).collect();
    let statistic = kolmogorov_smirnov(&draws, |x| distribution.cdf(x));
    assert!(statistic < KOLMOGOROV_SMIRNOV_LIMIT, "{name}: {statistic}");
    let (mean, variance) = (distribution.mean(), distribution.variance());
    if !variance.is_finite() {
        return;
    }
    let n = DRAWS as f64;
    let (sample_mean, sample_variance) = moments(&draws);
    let error = (variance / n).sqrt();
    assert_close(sample_mean, mean, 0.0, 4.5 * error, &format!("mean of draws, {name}"));
    let fourth = expectation(distribution, case.corner, &|x| (x - mean).powi(4));
    let error = ((fourth - variance * variance) / n).sqrt();
    let what = format!("variance of draws, {name}");
    assert_close(sample_variance, variance, 0.0, 4.5 * error, &what);
}
