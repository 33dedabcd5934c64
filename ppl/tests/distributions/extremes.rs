//! Extreme arguments: densities are −∞ there and never NaN, and draws lie inside the support.

use ppl::prelude::*;
use ppl::{LogDensity, Unknown, Workspace};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

const POSITIVE: [f64; 9] =
    [f64::MIN_POSITIVE, 1e-300, 1e-20, 0.3, 1.0, 40.0, 1e20, 1e300, f64::MAX];
const SHARES: [f64; 6] = [f64::MIN_POSITIVE, 1e-300, 1e-9, 0.3, 1.0 - 1e-9, 1.0 - f64::EPSILON];
const SCALES: [f64; 7] = [1e-300, 1e-100, 1e-3, 1.0, 1e3, 1e100, 1e300];
const COUNTS: [u64; 7] = [0, 1, 2, 15, 1_000_000, 1 << 62, u64::MAX];

fn real() -> Vec<f64> {
    POSITIVE.iter().flat_map(|x| [*x, -x]).chain([0.0, 800.0, -800.0]).collect()
}

fn check<D, V>(name: &str, distribution: D, values: &[V], failed: &mut Vec<String>)
where
    D: Distribution<f64, Value = V> + std::fmt::Debug,
    V: std::fmt::Debug,
{
    assert!(distribution.validate().is_ok(), "{name} {distribution:?}");
    for x in values {
        if distribution.ln_density(x).is_nan() {
            failed.push(format!("{distribution:?} at {x:?}"));
        }
    }
}

/// Returns all pairs of the given parameters.
fn pairs(a: &[f64], b: &[f64]) -> Vec<(f64, f64)> {
    a.iter().flat_map(|&a| b.iter().map(move |&b| (a, b))).collect()
}

#[test]
fn no_density_is_nan_at_finite_arguments() {
    let failed = &mut Vec::new();
    let real = &real()[..];
    macro_rules! all {
        ($values:expr, $a:expr, $b:expr => $($Name:ident),*) => {
            for (a, b) in pairs(&$a[..], &$b[..]) {
                $(check(stringify!($Name), $Name(a, b), &$values[..], failed);)*
            }
        };
        ($values:expr, $a:expr => $($Name:ident),*) => {
            for &a in &$a[..] {
                $(check(stringify!($Name), $Name(a), &$values[..], failed);)*
            }
        };
    }
    all!(real, real, SCALES => Normal);
    all!(POSITIVE, real, SCALES => LogNormal);
    all!(POSITIVE, SCALES, SCALES =>
        Gamma, Weibull);
    all!(POSITIVE, SCALES => Exponential, HalfNormal, HalfCauchy);
    all!(SHARES, SCALES, SCALES => Beta);
    for (m, s) in pairs(real, &SCALES) {
        for freedom in [1e-3, 1.0, 4.0, 1e3, 1e100] {
            check("StudentT", StudentT(freedom, m, s), real, failed);
        }
    }
    all!(COUNTS, SCALES => Poisson);
    all!(COUNTS, [-800.0, -1.0, 700.0, 720.0, 800.0, 1e300] => PoissonLog);
    all!([true, false], real => BernoulliLogit);
    for n in [0u64, 1, 20, 1 << 53] {
        for &x in real {
            check("BinomialLogit", BinomialLogit(n, x), &COUNTS, failed);
        }
        for p in SHARES {
            check("Binomial", Binomial(n, p), &COUNTS, failed);
        }
    }
    let shown = failed.iter().take(40).cloned().collect::<Vec<_>>().join("\n");
    assert!(failed.is_empty(), "{} are NaN:\n{shown}", failed.len());
}

#[test]
fn an_overflowing_rate_has_no_mass() {
    for eta in [710.0, 800.0, 1e300] {
        for k in [0, 1, 15] {
            let value: f64 = PoissonLog(eta).ln_density(&k);
            assert_eq!(value, f64::NEG_INFINITY, "{k} at {eta}");
        }
    }
    // a rate that underflows still gives the correct masses
    for (k, mass) in [(0, 0.0), (1, -800.0), (2, -1600.0 - 2f64.ln())] {
        let value: f64 = PoissonLog(-800.0).ln_density(&k);
        approx::assert_relative_eq!(value, mass, max_relative = 1e-14);
    }
}

/// Checks draws for shapes so small that half of the draws underflow or overflow.
#[test]
fn draws_lie_inside_the_open_support() {
    fn check<D: Unknown<f64> + std::fmt::Debug>(distribution: D, inside: impl Fn(&D::Value) -> bool)
    where
        D::Value: std::fmt::Debug,
    {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        for _ in 0..400 {
            let x = distribution.draw(&mut rng);
            assert!(inside(&x), "{distribution:?} draws {x:?}");
            let mut y = Vec::new();
            distribution.unconstrain(&x, &mut y);
            assert!(y.iter().all(|y| y.is_finite()), "{distribution:?} draws {x:?}, at {y:?}");
        }
    }
    let positive = |x: &f64| *x > 0.0 && x.recip() > 0.0 && x.recip().is_finite();
    check(Gamma(1e-4, 1e-3), positive);
    check(Gamma(1e-4, 1e-3).truncate(..5.0), positive);
    check(LogNormal(0.0, 2000.0), positive);
    check(Exponential(1e-308), positive);
    check(Weibull(1e-3, 1.0), positive);
    check(Beta(1e-4, 1e-4), |x| 0.0 < *x && *x < 1.0);
    check(StudentT(1.0, 0.0, 1e308), |x| x.is_finite());
    check(Gamma(1e-4, 1e-3).iid(3), |x| x.iter().all(positive));
    check(Gamma(1e-3, 1e-3).array::<2>(), |x| x.iter().all(positive));
}

ppl::model! {
    fn rates(k: &[u64]) {
        for k in k {
            let rate ~ Gamma(0.0001, 0.001);
            k ~ Poisson(rate);
        }
    }

    fn scale(y: &[f64]) {
        let precision ~ Gamma(0.001, 0.001);
        for y in y {
            y ~ Normal(0.0, 1.0 / precision.sqrt());
        }
    }

    fn far(k: &[u64]) {
        let eta ~ Normal(0.0, 2000.0);
        for k in k {
            k ~ PoissonLog(eta);
        }
    }
}

#[test]
fn priors_that_underflow_have_a_layout() {
    let model = rates(&[1, 0, 2, 4, 1, 3, 0, 0, 1, 1, 2, 3, 1, 1, 0, 0, 2]);
    assert_eq!(model.layout().expect("draws are rates").dim, 17);
    assert_eq!(scale(&[0.3, -0.2]).layout().expect("draws are scales").dim, 1);
}

#[test]
fn points_where_a_rate_overflows_have_no_density() {
    let model = far(&[3, 5]);
    let work = &mut Workspace::default();
    for y in [720.0, 800.0, 1e300] {
        let (value, gradient) =
            (model.log_density(&[y], work), model.gradient(&[y], &mut [0.0], work));
        for outcome in [value, gradient] {
            let error = outcome.expect_err("no density").to_string();
            assert!(error.contains("log density is -inf"), "at {y}: {error}");
        }
    }
}
