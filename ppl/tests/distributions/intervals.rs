//! Probabilities of intervals: value and derivatives by the same path, shapes known and unknown.

use ppl::prelude::*;
use ppl::{CountMass, Dual, Scalar, UnivariateDensity};

use crate::numerics::{assert_close, derivative};

type D<const N: usize> = Dual<N>;

/// A sampler that looks for its step comes to dispersions where counts inside are too many to sum.
#[test]
fn what_few_counts_are_cut_off_from_agrees_with_its_gradient_everywhere() {
    for i in -30..=30 {
        for j in -4..=4 {
            let point = [2.0 * f64::from(j), f64::from(i)];
            for first in [1, 2, 3, 8, 9, 20] {
                let name = format!("from {first}, ln μ and ln φ {point:?}");
                let value = |[m, f]: [f64; 2]| -> f64 {
                    NegativeBinomial(m.exp(), f.exp()).ln_mass(first, u64::MAX)
                };
                let plain = value(point);
                let [m, f] = D::<2>::variables(point);
                let lifted: D<2> = NegativeBinomial(m.exp(), f.exp()).ln_mass(first, u64::MAX);
                assert_eq!(lifted.value(), plain, "{name}");
                assert!(lifted.gradient().iter().all(|slope| slope.is_finite()), "{name}");
                // the distribution function has few digits of a small upper tail, as differences tell
                if plain < if first <= 8 { -1e3 } else { -10.0 } {
                    continue;
                }
                for k in 0..2 {
                    let moved = |x: f64| {
                        let mut point = point;
                        point[k] = x;
                        value(point)
                    };
                    let numerical = derivative(moved, point[k], 0.05);
                    assert_close(lifted.gradient()[k], numerical, 1e-6, 1e-6, &name);
                }
            }
        }
    }
}

/// −expm1(−φ ln(1 + μ/φ)) by hand.
#[test]
fn the_hurdle_is_one_minus_the_zeros() {
    for (ln_mean, ln_dispersion) in [(3.0, -13.0), (0.0, 0.0), (-20.0, 5.0), (9.0, -30.0)] {
        let [m, f] = D::<2>::variables([ln_mean, ln_dispersion]).map(Scalar::exp);
        let got: D<2> = NegativeBinomial(m, f).ln_mass(1, u64::MAX);
        let by_hand = (-(-f * (m / f).ln_1p()).exp_m1()).ln();
        let name = format!("{ln_mean} {ln_dispersion}");
        assert_close(got.value(), by_hand.value(), 1e-15, 1e-15, &name);
        for (got, expected) in got.gradient().into_iter().zip(by_hand.gradient()) {
            assert_close(got, expected, 1e-12, 1e-12, &name);
        }
    }
}

/// A mass whose shape (the first parameter) is data, and unknown: against each other and against
/// differences.
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
        assert_ends(
            &format!("InverseGamma {name}"),
            point,
            [InverseGamma(2.5, b).ln_mass(lower, upper), InverseGamma(a, b).ln_mass(lower, upper)],
            &|[a, b]| InverseGamma(a, b).ln_mass(lower, upper),
        );
    }
}

/// Where the mass underflows, and where its two ends differ by too few digits.
#[test]
fn ends_far_out_and_close_together() {
    let [m, s] = D::<2>::variables([0.3, 0.7]);
    // a tail like (s/x)³
    let tail: D<2> = StudentT(3.0, m, s).ln_sf(1e200);
    assert_close(tail.gradient()[1], 3.0 / 0.7, 1e-9, 0.0, "StudentT far out");
    let tail: D<2> = Gamma(1.0, s).ln_sf(1e4);
    assert_close(tail.value(), -7e3, 1e-12, 0.0, "Gamma far out");
    assert_close(tail.gradient()[1], -1e4, 1e-9, 0.0, "Gamma far out");

    let (x, width) = (1.1, 1e-9);
    let tails: [(D<2>, D<2>); 3] = [
        (StudentT(4.0, m, s).ln_mass(x, x + width), StudentT(4.0, m, s).ln_pdf(x.into())),
        (Gamma(2.5, s).ln_mass(x, x + width), Gamma(2.5, s).ln_pdf(x.into())),
        (InverseGamma(2.5, s).ln_mass(x, x + width), InverseGamma(2.5, s).ln_pdf(x.into())),
    ];
    for (mass, density) in tails {
        for (got, expected) in mass.gradient().into_iter().zip(density.gradient()) {
            assert_close(got, expected, 1e-7, 1e-12, "close together");
        }
    }
}
