//! Conformance tests for univariate distributions.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::gradient::derivative;
use crate::distribution::{Distribution, UnivariateDensity, Unknown};
use crate::number::dual::Dual;
use crate::number::scalar::Scalar;
use crate::special::integral_from_zero;
use crate::term::accumulator::Joined;

/// Dual number with derivatives in x and in up to seven parameters.
#[doc(hidden)]
pub type Lifted = Dual<8>;

const DRAWS: usize = 20_000;
/// Critical value of the Kolmogorov-Smirnov statistic √n sup |Fₙ − F| at probability 10⁻⁴: √(½ ln(2/10⁻⁴)).
const KOLMOGOROV_SMIRNOV: f64 = 2.225;

/// Asserts that the functions of a univariate distribution are consistent with each other. The macro works for
/// distributions of this library and for user-defined distributions.
///
/// In `assert_distribution!([m, s] Normal(m, s), [0.3, 2.0], [-1.0, 0.5, 4.0])`, `[m, s]` names the parameters and
/// `Normal(m, s)` constructs the distribution. The parameter values and some points well inside the support follow.
///
/// - The density integrates to 1. Its mean and variance, by quadrature, equal `mean` and `variance`.
/// - `cdf` and `sf` are integrals of the density, and the quantiles are their inverses.
/// - At ±∞ and NaN no function panics. The log density is −∞ at ±∞, and NaN or −∞ at NaN. `cdf` and `sf` are 0 and 1 at
///   ±∞, and NaN or a probability at NaN.
/// - Draws follow the `cdf` (Kolmogorov-Smirnov test with seed 1 at level 1 in 10 000).
/// - The maps to and from unconstrained space are inverse to each other, and the density contains their Jacobian.
/// - The partial derivatives in x and in the parameters equal finite differences of the log density, for every subset
///   of parameters that are unknown. The same holds for `.truncate(a..b)` and `.censor(a..b)`.
///
/// If the density has a kink inside the support, append the position of the kink, as in `, corner 0.3`. The
/// quadrature is split at the kink.
///
/// # Panics
/// At the first wrong value; the message states this value and the correct one.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::check::assert_distribution!([m, s] LogNormal(m, s), [1.2, 0.5], [0.2, 3.0, 20.0]);
/// ```
#[macro_export]
macro_rules! assert_distribution {
    ([$($p:ident),*] $distribution:expr, $parameters:expr, $points:expr $(, corner $corner:expr)?) => {
        $crate::check::assert_conformance(
            &$crate::check::Case {
                name: &format!("{} at {:?}", stringify!($distribution), $parameters),
                parameters: $parameters,
                points: &$points,
                corner: None::<f64>$(.or(Some($corner)))?,
            },
            &|[$($p),*]| $distribution,
            &|[$($p),*]| $distribution,
        )
    };
}

/// A distribution family with parameter values, and points well inside the support.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct Case<'a, const P: usize> {
    pub name: &'a str,
    pub parameters: [f64; P],
    pub points: &'a [f64],
    /// Position of a kink of the density.
    pub corner: Option<f64>,
}

/// A univariate distribution over the scalar type `R` that can be the prior of an unknown.
#[doc(hidden)]
pub trait Over<R: Scalar>: UnivariateDensity<R> + Unknown<R, Value = R> {}

impl<R: Scalar, D: UnivariateDensity<R> + Unknown<R, Value = R>> Over<R> for D {}

/// Implements [`assert_distribution`](crate::assert_distribution). `make` constructs the distribution with parameters
/// of type `f64`, `lifted` with parameters that are dual numbers.
#[doc(hidden)]
#[track_caller]
pub fn assert_conformance<const P: usize, D: Over<f64>, G: Over<Lifted>>(
    case: &Case<'_, P>,
    make: &dyn Fn([f64; P]) -> D,
    lifted: &dyn Fn([Lifted; P]) -> G,
) {
    let distribution = make(case.parameters);
    let valid = crate::Univariate::validate(&distribution);
    assert!(valid.is_ok(), "{}: {valid:?}", case.name);
    case.moments(&distribution);
    case.distribution_functions(&distribution);
    case.arguments_that_are_not_finite(&distribution);
    case.draws(&distribution);
    case.maps(&distribution);
    case.partials(make, lifted);
}

/// Log density at the unconstrained coordinate `y`, computed by the method that models use for unknowns.
fn constrained<R: Scalar, D: Unknown<R>>(distribution: &D, y: R, jacobian: bool) -> R {
    Joined::of(|terms| {
        distribution.constrain(&mut || y, jacobian, terms);
    })
}

/// Density at the unconstrained coordinate `y`; 0 where eʸ overflows or underflows.
fn density<D: Over<f64>>(distribution: &D, y: f64) -> f64 {
    let density = constrained(distribution, y, true).exp();
    if !density.is_finite() && y.abs() > 650.0 { 0.0 } else { density }
}

impl<const P: usize> Case<'_, P> {
    #[track_caller]
    fn close(&self, got: f64, expected: f64, relative: f64, absolute: f64, what: &str) {
        let error = (got - expected).abs();
        assert!(
            error <= relative * expected.abs() + absolute,
            "{what} of {}: got {got:e}, expected {expected:e} (error {error:.1e})",
            self.name
        );
    }

    /// Returns the centre and the width of the density over the unconstrained coordinate. The centre is the kink if
    /// there is one, otherwise the median; the width is the interquartile range.
    fn centre_and_width<D: Over<f64>>(&self, distribution: &D) -> (f64, f64) {
        let support = distribution.support();
        let [first, median, third] =
            [0.25, 0.5, 0.75].map(|p| support.unconstrain(distribution.quantile(p)));
        (self.corner.map_or(median, |x| support.unconstrain(x)), third - first)
    }

    /// Expectation ∫ g(x) p(x) dx.
    fn expectation<D: Over<f64>>(&self, distribution: &D, g: impl Fn(f64) -> f64) -> f64 {
        let (middle, width) = self.centre_and_width(distribution);
        let support = distribution.support();
        let at = |y: f64| {
            let p = density(distribution, y);
            if p == 0.0 { 0.0 } else { p * g(support.constrain(y).0) }
        };
        let side = |sign: f64| {
            integral_from_zero(|distance| at(middle + sign * distance), f64::INFINITY, width.abs())
        };
        side(-1.0) + side(1.0)
    }

    fn moments<D: Over<f64>>(&self, distribution: &D) {
        self.close(self.expectation(distribution, |_| 1.0), 1.0, 1e-9, 0.0, "the integral");
        let (mean, variance) = (distribution.mean(), distribution.variance());
        if mean.is_finite() {
            let by_quadrature = self.expectation(distribution, |x| x);
            let absolute = 1e-9 * variance.sqrt().min(f64::MAX);
            self.close(mean, by_quadrature, 1e-7, absolute, "the mean");
        }
        if mean.is_finite() && variance.is_finite() {
            let by_quadrature = self.expectation(distribution, |x| (x - mean).powi(2));
            self.close(variance, by_quadrature, 1e-6, 0.0, "the variance");
        }
    }

    fn distribution_functions<D: Over<f64>>(&self, distribution: &D) {
        let (_, width) = self.centre_and_width(distribution);
        let support = distribution.support();
        for &x in self.points {
            let (below, above) = (distribution.cdf(x), distribution.sf(x));
            let y = support.unconstrain(x);
            // the unconstrained coordinate can be a decreasing function of x
            let towards = if below < above { -width.signum() } else { width.signum() };
            let tail = |distance: f64| density(distribution, y + towards * distance);
            let by_quadrature = integral_from_zero(tail, f64::INFINITY, width.abs());
            self.close(below.min(above), by_quadrature, 1e-8, 0.0, &format!("a tail at {x}"));
            self.close(below + above, 1.0, 1e-14, 0.0, &format!("the sum of both tails at {x}"));
            // rounding a probability changes its quantile by ε · tail/density
            let pdf = distribution.ln_density(&x).exp();
            let allowed = |tail: f64| 1e-11 * tail / pdf + 1e-13 * x.abs();
            if below < 0.9 {
                self.close(distribution.quantile(below), x, 0.0, allowed(below), "a quantile");
            }
            if above < 0.9 {
                let back = distribution.upper_quantile(above);
                self.close(back, x, 0.0, allowed(above), "an upper quantile");
            }
        }
        let (low, high) = support.bounds();
        for (outside, below) in [(low - 1.0, 0.0), (high + 1.0, 1.0)] {
            if outside.is_finite() {
                let tails = [distribution.cdf(outside), distribution.sf(outside)];
                assert_eq!(tails, [below, 1.0 - below], "cdf and sf at {outside}, {}", self.name);
                let none: f64 = distribution.ln_density(&outside);
                assert_eq!(none, f64::NEG_INFINITY, "density at {outside}, {}", self.name);
            }
        }
    }

    /// Checks densities and tails at ±∞ and NaN.
    fn arguments_that_are_not_finite<D: Over<f64>>(&self, distribution: &D) {
        for (x, below) in [(f64::NEG_INFINITY, 0.0), (f64::INFINITY, 1.0)] {
            let ln_density: f64 = distribution.ln_density(&x);
            assert_eq!(ln_density, f64::NEG_INFINITY, "log density at {x}, {}", self.name);
            let tails = [distribution.cdf(x), distribution.sf(x)];
            assert_eq!(tails, [below, 1.0 - below], "cdf and sf at {x}, {}", self.name);
        }
        let nan = f64::NAN;
        let ln_density: f64 = distribution.ln_density(&nan);
        assert!(
            ln_density.is_nan() || ln_density == f64::NEG_INFINITY,
            "the log density at NaN of {}: got {ln_density}, expected NaN or -inf",
            self.name
        );
        for (function, value) in [("cdf", distribution.cdf(nan)), ("sf", distribution.sf(nan))] {
            assert!(
                value.is_nan() || (0.0..=1.0).contains(&value),
                "{function} at NaN of {}: got {value}, expected NaN or a probability",
                self.name
            );
        }
    }

    fn draws<D: Over<f64>>(&self, distribution: &D) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut draws: Vec<f64> = (0..DRAWS).map(|_| distribution.sample(&mut rng)).collect();
        draws.sort_by(f64::total_cmp);
        let n = DRAWS as f64;
        let distance = draws.iter().enumerate().fold(0.0f64, |distance, (i, &x)| {
            let p = distribution.cdf(x);
            distance.max(p - i as f64 / n).max((i + 1) as f64 / n - p)
        });
        let statistic = n.sqrt() * distance;
        assert!(
            statistic < KOLMOGOROV_SMIRNOV,
            "draws of {} do not follow its cdf: Kolmogorov–Smirnov statistic {statistic}",
            self.name
        );
    }

    fn maps<D: Over<f64>>(&self, distribution: &D) {
        let support = distribution.support();
        for &x in self.points {
            let mut y = Vec::new();
            Unknown::<f64>::unconstrain(distribution, &x, &mut y);
            let back = support.constrain(y[0]).0;
            self.close(back, x, 1e-12, 0.0, "a value by way of its coordinate");
            let slope = derivative(|step| support.constrain(y[0] + step).0);
            let with = distribution.ln_density(&x) + slope.0.abs().ln();
            let what = format!("the log density over coordinates at x = {x}");
            self.close(constrained(distribution, y[0], true), with, 1e-8, 1e-8, &what);
            let without = constrained(distribution, y[0], false);
            self.close(without, distribution.ln_density(&x), 1e-12, 1e-12, &what);
        }
    }

    /// Compares dual-number derivatives with finite differences, for every subset of parameters that are unknown.
    fn partials<D: Over<f64>, G: Over<Lifted>>(
        &self,
        make: &dyn Fn([f64; P]) -> D,
        lifted: &dyn Fn([Lifted; P]) -> G,
    ) {
        let plain = make(self.parameters);
        let support = plain.support();
        let [low, middle, high] = [0.1, 0.5, 0.8].map(|p| plain.quantile(p));
        // finite differences are wrong at a kink
        let is_corner =
            |x: f64| self.corner.is_some_and(|corner| (x - corner).abs() < 0.1 * (high - low));
        let middle = if is_corner(middle) { plain.quantile(0.3) } else { middle };
        type Function<'r, T, R> = &'r dyn Fn(&T, R) -> R;
        type Reading<'r, T> = (&'r str, Vec<f64>, Function<'r, T, f64>);
        let inner: Vec<f64> = vec![middle];
        let coordinates: Vec<f64> = self.points.iter().map(|&x| support.unconstrain(x)).collect();
        let values: [Reading<'_, D>; 5] = [
            ("ln_density", self.points.to_vec(), &|d, x| d.ln_density(&x)),
            ("constrain", coordinates.clone(), &|d, y| constrained(d, y, true)),
            ("constrain without Jacobian", coordinates, &|d, y| constrained(d, y, false)),
            ("truncate", inner, &|d, x| d.clone().truncate(low..high).ln_density(&x)),
            ("censor", vec![low, high], &|d, x| d.clone().censor(low..high).ln_density(&x)),
        ];
        let duals: [Function<'_, G, Lifted>; 5] = [
            &|d, x| d.ln_density(&x),
            &|d, y| constrained(d, y, true),
            &|d, y| constrained(d, y, false),
            &|d, x| d.clone().truncate(low..high).ln_density(&x),
            &|d, x| d.clone().censor(low..high).ln_density(&x),
        ];
        for ((reading, points, value), dual) in values.iter().zip(duals) {
            for &at in points {
                let what = format!("{reading} at {at}");
                let expected = value(&plain, at);
                // the limits of a censored distribution are data, so the derivative in x is not compared
                let moves = *reading != "censor";
                let (first, last) = match *reading {
                    "ln_density" => support.bounds(),
                    "truncate" => (low, high),
                    _ => (f64::NEG_INFINITY, f64::INFINITY),
                };
                let reach =
                    (0.05 * at.abs().max(0.2)).min(0.2 * (at - first)).min(0.2 * (last - at));
                let along_x = |step: f64| value(&plain, at + 5.0 * reach * step);
                let in_x = derivative(along_x).0 / (5.0 * reach);
                let in_parameters: [f64; P] = std::array::from_fn(|i| {
                    let p = self.parameters[i];
                    let reach = 0.1 * p.abs().max(0.05);
                    let along = |step: f64| {
                        let mut parameters = self.parameters;
                        parameters[i] = p + reach * step;
                        value(&make(parameters), at)
                    };
                    derivative(along).0 / reach
                });
                for unknown in 0..1usize << P {
                    let parameters = std::array::from_fn(|i| {
                        let is_unknown = unknown >> i & 1 == 1;
                        let slope = |j| if is_unknown && j == i + 1 { 1.0 } else { 0.0 };
                        Dual::new(self.parameters[i], std::array::from_fn(slope))
                    });
                    let x = |j| if j == 0 { 1.0 } else { 0.0 };
                    let computed = dual(&lifted(parameters), Dual::new(at, std::array::from_fn(x)));
                    self.close(computed.value(), expected, 1e-9, 1e-9, &what);
                    let gradient = computed.gradient();
                    if moves {
                        self.close(gradient[0], in_x, 1e-7, 1e-7, &format!("∂x of {what}"));
                    }
                    for i in 0..P {
                        let is_unknown = unknown >> i & 1 == 1;
                        let expected = if is_unknown { in_parameters[i] } else { 0.0 };
                        let what = format!("the partial in parameter {i} of {what}");
                        self.close(gradient[i + 1], expected, 1e-7, 1e-7, &what);
                    }
                }
            }
        }
    }
}
