//! Ordered values, simplexes, zero sums, directions and the matrices of Wishart.

use ppl::prelude::*;
use ppl::special::ln_gamma;
use ppl::transform::{
    Ascending, Correlation, Covariance, Simplex, Support, UnitSphere, VectorMap, ZeroSum,
};
use ppl::{Dual, Univariate};
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
unknown!(Centred, |p| Normal(p[0], p[1]).array::<4>().sum_to_zero());
unknown!(CentredVec, |p| Normal(0.0, p[0]).iid(3).sum_to_zero());
unknown!(Shares, |p| Dirichlet([p[0], p[1], p[2]]));
unknown!(SharesVec, |p| Dirichlet(p.to_vec()));

#[test]
fn ordered_values() {
    let (y, all) = ([0.3, -0.5, 0.4], [0, 1, 2]);
    assert_unknown("ordered normal", &OrderedNormal, &[0.4, 1.3], &y, &all);
    assert_unknown("positive-ordered gamma", &OrderedGamma, &[2.5, 1.5], &y, &all);
    assert_unknown("ordered uniform", &OrderedUniform, &[-1.0, 2.0], &y, &all);
    assert_unknown("ordered below", &OrderedBelow, &[0.4, 1.3], &y, &all);
}

#[test]
fn zero_sums_and_shares() {
    let y = [0.3, -0.5, 0.4];
    // volume in the hyperplane is √N times that of all entries but one
    let centred = Normal(0.0, 1.0).array::<4>().sum_to_zero();
    let mut coordinates = y.into_iter();
    let (x, ln_p) = constrained(&centred, || coordinates.next().unwrap(), true);
    assert_close(x.iter().sum::<f64>(), 0.0, 0.0, 1e-15, "sum");
    let independent: f64 = Normal(0.0, 1.0).array::<3>().ln_density(&y);
    assert_close(ln_p, independent, 1e-14, 0.0, "orthonormal");
    assert_eq!(centred.ln_density(&[1.0, -1.0, 0.5, 0.0]), f64::NEG_INFINITY);
    // isometry: its "Jacobian" in N − 1 entries is a constant that the density leaves out
    for (name, at) in [("array", &y[..]), ("Vec", &y[..2])] {
        let mut out = vec![0.0; at.len() + 1];
        let mut coordinates = at.iter().copied();
        let zero: f64 = ZeroSum.constrain(&mut || coordinates.next().unwrap(), &mut out);
        let square = |x: &[f64]| x.iter().map(|x| x * x).sum::<f64>();
        assert_close(square(&out), square(at), 1e-14, 0.0, name);
        assert_eq!(zero, 0.0);
    }
    assert_unknown("Dirichlet", &Shares, &[2.0, 0.7, 1.3], &y[..2], &[0, 1]);
    assert_unknown("Dirichlet of a Vec", &SharesVec, &[1.0, 3.0, 0.5], &y[..2], &[0, 1]);
    // −∞, not a clamped value, outside of the simplex; flat shares may vanish
    assert_eq!(Dirichlet([2.0, 2.0]).ln_density(&[1.2, -0.2]), f64::NEG_INFINITY);
    let flat: f64 = Dirichlet([1.0, 1.0, 1.0]).ln_density(&[0.0, 0.5, 0.5]);
    assert_close(flat, 2.0f64.ln(), 1e-14, 0.0, "a flat share of 0");
}

/// Everything but the Jacobian in N − 1 entries, which is the constant ½ ln N.
#[test]
fn zero_sum_readings() {
    let y = [0.3, -0.5, 0.4];
    crate::vector_conformance::assert_isometric("zero sum", &Centred, &[0.7, 1.4], &y);
    crate::vector_conformance::assert_isometric("zero sum of a Vec", &CentredVec, &[0.8], &y[..2]);
}

/// P(all N below c) of the order statistics is Fᴺ, and their density integrates to one.
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

/// Archimedes: any coordinate of a uniform direction in space is uniform on (−1, 1).
#[test]
fn directions() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    let draws: Vec<[f64; 3]> = (0..20_000).map(|_| UnitVector::<3>.draw(&mut rng)).collect();
    for i in 0..3 {
        let column: Vec<f64> = draws.iter().map(|x| x[i]).collect();
        let statistic = kolmogorov_smirnov(&column, |x| 0.5 * (x + 1.0));
        assert!(statistic < KOLMOGOROV_SMIRNOV_LIMIT, "x[{i}]: {statistic}");
    }
    let area = |n: usize| UnitSphere::ln_area(n).exp();
    let pi = std::f64::consts::PI;
    for (n, expected) in [(2, 2.0 * pi), (3, 4.0 * pi), (4, 2.0 * pi * pi)] {
        assert_close(area(n), expected, 1e-14, 0.0, "area");
    }
    // the auxiliary length: both readings are the uniform density times a density of the length
    let y = [0.4, -1.1, 0.7];
    let read = |jacobian: bool| {
        let mut next = y.into_iter();
        constrained(&UnitVector::<3>, || next.next().unwrap(), jacobian)
    };
    let ((x, with), (_, without)): (([f64; 3], f64), _) = (read(true), read(false));
    let square: f64 = y.iter().map(|y| y * y).sum();
    let independent: f64 = Normal(0.0, 1.0).array::<3>().ln_density(&y);
    assert_close(with, independent, 1e-14, 0.0, "standard normal coordinates");
    assert_close(with - without, -square.ln(), 1e-13, 1e-13, "polar coordinates: r²");
    assert_close(x[1], y[1] / square.sqrt(), 1e-15, 0.0, "direction");
    let mut out = [0.0; 3];
    let mut next = y.into_iter();
    let weight: f64 = UnitSphere.constrain(&mut || next.next().unwrap(), &mut out);
    assert_close(weight - area(3).ln(), with, 1e-13, 1e-13, "against the uniform density");
    let centre: ([f64; 2], f64) = constrained(&UnitVector::<2>, || 0.0, true);
    assert!(centre.0[0].is_nan());
    assert!(Distribution::<f64>::validate(&UnitVector::<1>).is_err());
}

/// log|J| against the determinant of dual derivatives, and the inverse.
fn assert_map<const D: usize>(
    map: &impl VectorMap<Dual<D>>,
    plain: &impl VectorMap<f64>,
    n: usize,
    y: [f64; D],
) -> Vec<f64> {
    assert_eq!(plain.dim(n), D);
    let (mut x, mut next) = (vec![Dual::from(0.0); n], Dual::variables(y).into_iter());
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
    for scale in [0.1, 1.0, 3.0] {
        let y = [0.7, -1.2, 0.1, 1.9].map(|y| y * scale);
        let shares = assert_map(&Simplex, &Simplex, 5, y);
        assert_close(shares.iter().sum::<f64>(), 1.0, 1e-15, 0.0, "sum");
        for (a, b) in [(-OPEN, OPEN), (0.0, OPEN), (-OPEN, 2.0), (-1.0, 2.0)] {
            let plain = Ascending(Support::<f64>::Real.within(a, b));
            let lifted = Ascending(Support::<Dual<4>>::Real.within(a, b));
            let x = assert_map(&lifted, &plain, 4, y);
            assert!(x.windows(2).all(|pair| pair[0] < pair[1]), "{x:?}");
            assert!(a < x[0] && x[3] < b, "{x:?}");
        }
    }
    // between two ends, the centre of coordinates spaces values evenly
    let mut x = [0.0; 3];
    let _: f64 = Ascending(Support::Between(1.0, 5.0)).constrain(&mut || 0.0, &mut x);
    for (x, expected) in x.iter().zip([2.0, 3.0, 4.0]) {
        assert_close(*x, expected, 1e-15, 0.0, "even");
    }
}

#[test]
fn factor_maps() {
    let y = [0.5, -0.9, 1.3, 0.2, -0.4, 0.8];
    let mut next = Dual::variables(y).into_iter();
    let (factor, log_jacobian): (CholeskyFactor<Dual<6>, 3>, Dual<6>) =
        Covariance.constrain(&mut || next.next().unwrap());
    let entries = [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)];
    let matrix =
        nalgebra::Matrix6::from_fn(|i, j| factor.get(entries[i].0, entries[i].1).gradient()[j]);
    assert_close(log_jacobian.value(), matrix.determinant().ln(), 1e-12, 1e-12, "covariance");
    let mut back = Vec::new();
    Covariance.unconstrain(&factor, &mut back);
    back.iter().zip(y).for_each(|(b, y)| assert_close(*b, y, 1e-14, 1e-14, "round trip"));

    let mut next = Dual::variables(y).into_iter();
    let (factor, log_jacobian): (CholeskyFactor<Dual<6>, 4>, Dual<6>) =
        Correlation.constrain(&mut || next.next().unwrap());
    let entries = [(1, 0), (2, 0), (2, 1), (3, 0), (3, 1), (3, 2)];
    let matrix =
        nalgebra::Matrix6::from_fn(|i, j| factor.get(entries[i].0, entries[i].1).gradient()[j]);
    assert_close(log_jacobian.value(), matrix.determinant().ln(), 1e-12, 1e-12, "correlation");
    let mut back = Vec::new();
    Correlation.unconstrain(&factor, &mut back);
    back.iter().zip(y).for_each(|(b, y)| assert_close(*b, y, 1e-13, 1e-13, "round trip"));
}

/// Far out nothing is clamped: a log-Jacobian stays exact or the point has no density.
#[test]
fn extreme_coordinates() {
    let read = |y: [f64; 2]| -> ([f64; 3], f64) {
        let mut next = y.into_iter();
        constrained(&Dirichlet([0.5, 1.0, 2.0]), || next.next().unwrap(), true)
    };
    let (x, far) = read([2000.0, 0.0]);
    assert_eq!((x[0], x[1]), (1.0, 0.0));
    let (_, further) = read([2001.0, 0.0]);
    // ln x₁ = 0, ln x₂ = −√2 y, ln x₃ = −y/√2: the slope is −√2 α₂ − α₃/√2
    assert_close(further - far, -2.0 * 2.0f64.sqrt(), 1e-11, 0.0, "slope at y = 2000");
    assert!(!read([f64::MAX, -f64::MAX]).1.is_finite());

    let ordered = |y: [f64; 2]| -> ([f64; 2], f64) {
        let mut next = y.into_iter();
        constrained(&Normal(0.0, 1.0).array::<2>().ordered(), || next.next().unwrap(), true)
    };
    let (x, close) = ordered([0.5, -800.0]);
    assert!(x[0] == x[1] && close.is_finite(), "{x:?} {close}");
    assert!(!ordered([0.5, 800.0]).1.is_finite());
}

/// Against ln p(W) = ((ν−K−1)/2) ln|W| − ½ tr(V⁻¹W) − (νK/2) ln 2 − (ν/2) ln|V| − ln Γ_K(ν/2) and
/// its like for the inverse, times the Jacobian 2ᴷ Π Lᵢᵢ^(K−i).
#[test]
fn wishart_densities_equal_the_textbook_forms() {
    let (nu, k) = (4.7, 3.0);
    let l = CholeskyFactor::new([[1.1, 0.0, 0.0], [0.4, 0.8, 0.0], [-0.3, 0.6, 1.7]]).unwrap();
    let s = CholeskyFactor::new([[0.9, 0.0, 0.0], [-0.2, 1.2, 0.0], [0.5, 0.1, 0.7]]).unwrap();
    let matrix = |f: &CholeskyFactor<f64, 3>| {
        let c = f.covariance();
        nalgebra::Matrix3::from_fn(|i, j| c[i][j])
    };
    let (w, v) = (matrix(&l), matrix(&s));
    let ln_pi = std::f64::consts::PI.ln();
    let multigamma: f64 =
        1.5 * ln_pi + (0..3).map(|i| ln_gamma(0.5 * (nu - f64::from(i)))).sum::<f64>();
    let jacobian = 8.0f64.ln() + (0..3).map(|i| (3 - i) as f64 * l.get(i, i).ln()).sum::<f64>();
    let common = -0.5 * nu * k * 2.0f64.ln() - multigamma + jacobian;
    let expected = 0.5 * (nu - k - 1.0) * w.determinant().ln()
        - 0.5 * (v.try_inverse().unwrap() * w).trace()
        - 0.5 * nu * v.determinant().ln()
        + common;
    assert_close(WishartCholesky(nu, s).ln_density(&l), expected, 1e-12, 0.0, "Wishart");
    let expected = -0.5 * (nu + k + 1.0) * w.determinant().ln()
        - 0.5 * (v * w.try_inverse().unwrap()).trace()
        + 0.5 * nu * v.determinant().ln()
        + common;
    let got: f64 = InverseWishartCholesky(nu, &s).ln_density(&l);
    assert_close(got, expected, 1e-12, 0.0, "inverse Wishart");
}

fn factor<R: Scalar>(p: &[R]) -> CholeskyFactor<R, 2> {
    CholeskyFactor::new([[p[0], R::from(0.0)], [p[1], p[2]]]).unwrap()
}

unknown!(Wishart, |p| WishartCholesky(p[0], factor(&p[1..])));
unknown!(InverseWishart, |p| InverseWishartCholesky(p[0], factor(&p[1..])));
unknown!(Heavy, |p| MvStudentTCholesky(p[0], [p[1], p[2]], factor(&p[3..])));
unknown!(Lkj, |p| LkjCholesky::<3, _>(p[0]));

#[test]
fn matrices() {
    let (scale, y) = ([0.9, -0.3, 1.2], [0.2, -0.5, 0.4]);
    let parameters = [&[3.6], &scale[..]].concat();
    assert_unknown("Wishart", &Wishart, &parameters, &y, &[0, 1, 2]);
    assert_unknown("inverse Wishart", &InverseWishart, &parameters, &y, &[0, 1, 2]);
    let parameters = [&[5.0, 0.2, -0.1], &scale[..]].concat();
    assert_unknown("Student t", &Heavy, &parameters, &y[..2], &[0, 1]);
    for eta in [0.8, 2.5] {
        assert_unknown("LKJ", &Lkj, &[eta], &y, &[1, 3, 4]);
    }
    let requirement = "degrees of freedom must be above K − 1 = 1 and finite, got 1";
    let error = Distribution::<f64>::validate(&WishartCholesky(1.0, factor(&scale))).unwrap_err();
    assert_eq!(error.to_string(), format!("WishartCholesky: {requirement}"));
}

/// The multivariate t tends to the normal, and its marginals are Student t.
#[test]
fn student_t_limits_and_marginals() {
    let l = factor(&[0.9, -0.3, 1.2]);
    let heavy: f64 = MvStudentTCholesky(1e9, [0.2, -0.1], l).ln_density(&[1.0, 2.0]);
    let normal: f64 = MvNormalCholesky([0.2, -0.1], l).ln_density(&[1.0, 2.0]);
    assert_close(heavy, normal, 1e-7, 0.0, "ν → ∞");
    let joint = MvStudentTCholesky(3.0, [0.2, -0.1], l);
    let marginal = integral(|y| -> f64 { joint.ln_density(&[1.0, y]).exp() }, 0.0, 1.0);
    let expected: f64 = StudentT(3.0, 0.2, 0.9).ln_density(&1.0);
    assert_close(marginal.ln(), expected, 1e-9, 0.0, "marginal of the first");
}
