//! Probabilities of intervals: value and derivatives are consistent, for known and for unknown shapes.

use ppl::prelude::*;
use ppl::{Dual, UnivariateDensity};

use crate::numerics::{assert_close, derivative};

type D<const N: usize> = Dual<N>;

/// Compares the probability of an interval for a known and for an unknown shape (the first parameter) with each other
/// and with finite differences.
fn assert_ends<const K: usize>(
    name: &str,
    point: [f64; K],
    [known, unknown]: [D<K>; 2],
    value: &dyn Fn([f64; K]) -> f64,
) {
    assert_eq!([known.value(), unknown.value()], [value(point); 2], "{name}");
    assert_eq!(known.gradient()[0], 0.0, "{name}");
    for k in 0..K {
        let name = format!("∂{k} {name}");
        if k > 0 {
            assert_close(known.gradient()[k], unknown.gradient()[k], 1e-12, 0.0, &name);
        }
        let moved = |p: f64| {
            let mut point = point;
            point[k] = p;
            value(point)
        };
        let numerical = derivative(moved, point[k], 0.02 * point[k].abs());
        assert_close(unknown.gradient()[k], numerical, 2e-8, 2e-8, &name);
    }
}

#[test]
fn locations_scales_and_rates_move_the_ends() {
    let (none, all) = (f64::NEG_INFINITY, f64::INFINITY);
    let ends = [(none, 0.6), (0.6, all), (0.4, 1.9), (0.01, all), (12.0, all), (none, 0.05)];
    for (lower, upper) in ends {
        let name = format!("between {lower} and {upper}");
        let point = [4.0, 0.3, 0.7];
        let [n, m, s] = D::variables(point);
        assert_ends(
            &format!("StudentT {name}"),
            point,
            [StudentT(4.0, m, s).ln_mass(lower, upper), StudentT(n, m, s).ln_mass(lower, upper)],
            &|[n, m, s]| StudentT(n, m, s).ln_mass(lower, upper),
        );
        let point = [2.5, 1.4];
        let [a, b] = D::variables(point);
        assert_ends(
            &format!("Gamma {name}"),
            point,
            [Gamma(2.5, b).ln_mass(lower, upper), Gamma(a, b).ln_mass(lower, upper)],
            &|[a, b]| Gamma(a, b).ln_mass(lower, upper),
        );
    }
}

/// Intervals whose probability underflows almost or completely, and intervals whose ends differ in few digits.
#[test]
fn ends_far_out_and_close_together() {
    let [m, s] = D::<2>::variables([0.3, 0.7]);
    // the tail is proportional to (s/x)³
    let tail: D<2> = StudentT(3.0, m, s).ln_sf(1e80);
    assert_close(tail.gradient()[1], 3.0 / 0.7, 1e-9, 0.0, "StudentT far out");
    let tail: D<2> = Gamma(1.0, s).ln_sf(800.0);
    assert_close(tail.value(), -560.0, 1e-12, 0.0, "Gamma far out");
    assert_close(tail.gradient()[1], -800.0, 1e-9, 0.0, "Gamma far out");
    let beyond: D<2> = Gamma(1.0, s).ln_sf(1e4);
    assert_close(beyond.value(), -7000.0, 1e-14, 0.0, "Gamma beyond the smallest number");
    assert_close(beyond.gradient()[1], -1e4, 1e-12, 0.0, "Gamma beyond the smallest number");

    let (x, width) = (1.1, 1e-9);
    let tails: [(D<2>, D<2>); 2] = [
        (StudentT(4.0, m, s).ln_mass(x, x + width), StudentT(4.0, m, s).ln_pdf(x.into())),
        (Gamma(2.5, s).ln_mass(x, x + width), Gamma(2.5, s).ln_pdf(x.into())),
    ];
    for (mass, density) in tails {
        for (got, expected) in mass.gradient().into_iter().zip(density.gradient()) {
            assert_close(got, expected, 1e-7, 1e-12, "close together");
        }
    }
}
