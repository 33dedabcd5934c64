//! Ordered values.

use ppl::prelude::*;
use ppl::transform::{Ascending, Support};
use ppl::{Dual, Joined, Univariate};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::numerics::{
    KOLMOGOROV_SMIRNOV_LIMIT, assert_close, constrained, integral, kolmogorov_smirnov,
};
use crate::vector_conformance::{assert_unknown, unknown};

unknown!(OrderedNormal, |p| Normal(p[0], p[1]).array::<3>().ordered());
unknown!(OrderedGamma, |p| Gamma(p[0], p[1]).iid(3).ordered());
unknown!(OrderedUniform, |p| Uniform(p[0], p[1]).array::<3>().ordered());
unknown!(OrderedBelow, |p| Normal(p[0], p[1]).truncate(..1.5).array::<3>().ordered());

#[test]
fn ordered_values() {
    let (y, all) = ([0.3, -0.5, 0.4], [0, 1, 2]);
    assert_unknown("ordered normal", &OrderedNormal, &[0.4, 1.3], &y, &all);
    assert_unknown("positive-ordered gamma", &OrderedGamma, &[2.5, 1.5], &y, &all);
    assert_unknown("ordered uniform", &OrderedUniform, &[-1.0, 2.0], &y, &all);
    assert_unknown("ordered below", &OrderedBelow, &[0.4, 1.3], &y, &all);
}

/// Checks that P(all N below c) of ordered draws is Fᴺ, and that their density integrates to 1.
#[test]
fn ordered_draws_are_order_statistics() {
    let ordered = Normal(1.0, 2.0).array::<4>().ordered();
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let draws: Vec<[f64; 4]> = (0..20_000).map(|_| ordered.draw(&mut rng)).collect();
    assert!(draws.iter().all(|x| x.windows(2).all(|pair| pair[0] <= pair[1])));
    let largest: Vec<f64> = draws.iter().map(|x| x[3]).collect();
    let cdf = |x: f64| Normal(1.0, 2.0).cdf(x).powi(4);
    assert!(kolmogorov_smirnov(&largest, cdf) < KOLMOGOROV_SMIRNOV_LIMIT);
    let pair = Exponential(1.0).array::<2>().ordered();
    let mass = |x: f64| {
        let inner = |z: f64| -> f64 {
            let y = x + z.exp();
            (pair.ln_density(&[x, y]) + z).exp()
        };
        if x > 0.0 { integral(inner, 0.0, 1.0) } else { 0.0 }
    };
    let total = integral(|v| if v.abs() > 40.0 { 0.0 } else { mass(v.exp()) * v.exp() }, 0.0, 1.0);
    assert_close(total, 1.0, 1e-9, 0.0, "∫∫p over x₁ < x₂");
}

/// Compares log|J| with the determinant of dual derivatives, and checks the inverse.
fn assert_map<const D: usize>(
    map: &Ascending<Dual<D>>,
    plain: &Ascending<f64>,
    y: [f64; D],
) -> Vec<f64> {
    let (mut x, mut next) = (vec![Dual::from(0.0); D], Dual::variables(y).into_iter());
    let log_jacobian = map.constrain(&mut || next.next().unwrap(), &mut x);
    let matrix = nalgebra::DMatrix::from_fn(D, D, |i, j| x[i].gradient()[j]);
    let expected = matrix.determinant().abs().ln();
    assert_close(log_jacobian.value(), expected, 1e-9, 1e-9, "log-Jacobian");
    let values: Vec<f64> = x.iter().map(|x| x.value()).collect();
    let mut back = Vec::new();
    plain.unconstrain(&values, &mut back);
    for (back, y) in back.iter().zip(&y) {
        assert_close(*back, *y, 1e-8, 1e-8, "round trip");
    }
    values
}

#[test]
fn maps() {
    const OPEN: f64 = f64::INFINITY;
    for scale in [0.1, 0.5, 1.0] {
        let y = [0.7, -1.2, 0.1, 1.9].map(|y| y * scale);
        for (a, b) in [(-OPEN, OPEN), (0.0, OPEN), (-OPEN, 2.0), (-1.0, 2.0)] {
            let plain = Ascending(Support::<f64>::Real.within(a, b));
            let lifted = Ascending(Support::<Dual<4>>::Real.within(a, b));
            let x = assert_map(&lifted, &plain, y);
            assert!(x.windows(2).all(|pair| pair[0] < pair[1]), "{x:?}");
            assert!(a < x[0] && x[3] < b, "{x:?}");
        }
    }
}

/// At extreme coordinates, values are not clamped: the log-Jacobian is exact, or the point has zero density.
#[test]
fn extreme_coordinates() {
    let ordered = |y: [f64; 2]| -> ([f64; 2], f64) {
        let mut next = y.into_iter();
        constrained(&Normal(0.0, 1.0).array::<2>().ordered(), || next.next().unwrap(), true)
    };
    let (x, close) = ordered([0.5, -800.0]);
    assert!(x[0] == x[1] && close.is_finite(), "{x:?} {close}");
    assert!(!ordered([0.5, 800.0]).1.is_finite());
}

unknown!(Lkj, |_p| LkjCholesky::<3>(1.7));

#[test]
fn matrices() {
    assert_unknown("LKJ", &Lkj, &[], &[0.2, -0.5, 0.4], &[1, 3, 4]);
}

/// Checks that constraining several values together, with sums in registers, gives the same values as constraining them
/// one by one.
#[test]
fn normal_unknowns_together_are_as_one_by_one() {
    let [mean, sd, a, b, c] = Dual::variables([0.3, 1.7, -0.4, 2.2, 0.9]);
    let family = Normal(mean, sd);
    let coordinates = [a, b, c];
    let (mut one, mut all) = (coordinates.into_iter(), coordinates.into_iter());
    let expected = Joined::of(|terms| {
        for _ in 0..3 {
            family.constrain(&mut || one.next().unwrap(), true, terms);
        }
    });
    let (values, found) =
        Joined::with(|terms| family.constrain_all(3, &mut || all.next().unwrap(), true, terms));
    let of = |variables: &[Dual<5>]| variables.iter().map(|v| v.value()).collect::<Vec<_>>();
    assert_eq!(of(&values), of(&coordinates));
    assert_close(found.value(), expected.value(), 1e-14, 0.0, "log density");
    for (f, e) in found.gradient().iter().zip(expected.gradient()) {
        assert_close(*f, e, 1e-13, 0.0, "gradient");
    }
}
