//! The LKJ distribution, compared with det(R)^(η − 1), integrals, reference values and its marginal distributions.

use ppl::prelude::*;
use ppl::{Dual, Univariate};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::numerics::{
    KOLMOGOROV_SMIRNOV_LIMIT, assert_close, constrained, derivative, integral, kolmogorov_smirnov,
};

fn constrain<R: Scalar, const K: usize>(
    eta: f64,
    x: &[R],
    jacobian: bool,
) -> (CholeskyFactor<R, K>, R) {
    let mut next = x.iter().copied();
    constrained(&LkjCholesky::<K>(eta), || next.next().unwrap(), jacobian)
}

/// Returns the correlations below the diagonal, row by row.
fn correlations<const K: usize>(factor: &CholeskyFactor<f64, K>) -> Vec<f64> {
    let matrix = factor.covariance();
    (0..K).flat_map(|i| matrix[i][..i].to_vec()).collect()
}

fn determinant<const K: usize>(factor: &CholeskyFactor<f64, K>) -> f64 {
    let matrix = factor.covariance();
    nalgebra::DMatrix::from_fn(K, K, |i, j| matrix[i][j]).determinant()
}

/// Computes |∂(correlations)/∂(coordinates)| by finite differences.
fn jacobian<const K: usize>(eta: f64, x: &[f64]) -> f64 {
    let n = x.len();
    let column = |j: usize, i: usize| {
        let moved = |v: f64| {
            let mut x = x.to_vec();
            x[j] = v;
            correlations(&constrain::<f64, K>(eta, &x, true).0)[i]
        };
        derivative(moved, x[j], 0.1)
    };
    nalgebra::DMatrix::from_fn(n, n, |i, j| column(j, i)).determinant().abs()
}

/// Computes ∫ det(R)^(η − 1) dR. The matrices of size 2 have one correlation r ∈ (−1, 1) and the determinant 1 − r².
/// The matrices of size 3 have the determinant 1 − a² − b² − c² + 2abc, and c lies between ab ± √((1 − a²)(1 − b²)).
fn mass_of_power(size: usize, eta: f64) -> f64 {
    let power = |r: f64, f: &dyn Fn(f64) -> f64| {
        let (tanh, sech) = (r.tanh(), r.cosh().recip());
        if sech == 0.0 { 0.0 } else { f(tanh) * sech * sech }
    };
    let over = |f: &dyn Fn(f64) -> f64| integral(|y| power(y, f), 0.0, 1.0);
    let pair = over(&|r| (1.0 - r * r).powf(eta - 1.0));
    if size == 2 {
        return pair;
    }
    // with c = ab + √((1 − a²)(1 − b²)) t, the determinant is (1 − a²)(1 − b²)(1 − t²)
    let wide = over(&|a| (1.0 - a * a).powf(eta - 0.5));
    wide * wide * pair
}

/// Checks the density over correlation matrices, with a numerical change of variables.
#[test]
fn density_is_a_power_of_the_determinant() {
    for eta in [0.7, 1.0, 3.0] {
        for x in [[0.3, -0.8, 1.1], [-1.5, 0.2, 0.4]] {
            let (factor, ln_density) = constrain::<f64, 3>(eta, &x, true);
            let over_matrices = ln_density - jacobian::<3>(eta, &x).ln();
            let expected = (eta - 1.0) * determinant(&factor).ln() - mass_of_power(3, eta).ln();
            assert_close(over_matrices, expected, 1e-8, 1e-8, "K = 3");

            let (factor, ln_density) = constrain::<f64, 2>(eta, &x[..1], true);
            let over_matrices = ln_density - jacobian::<2>(eta, &x[..1]).ln();
            let expected = (eta - 1.0) * determinant(&factor).ln() - mass_of_power(2, eta).ln();
            assert_close(over_matrices, expected, 1e-8, 1e-8, "K = 2");
        }
    }
}

/// Checks the normalising constant. At the identity, the density over factors is the normalising constant. For K = 2,
/// the factor has one free entry r, and ln c₂ is −ln ∫ (1 − r²)^(η − 1) dr plus the term of √(1 − r²).
#[test]
fn normaliser_by_integration() {
    for eta in [0.5, 1.0, 3.0, 20.0] {
        let identity = CholeskyFactor::new([[1.0, 0.0], [0.0, 1.0]]).unwrap();
        let got: f64 = LkjCholesky::<2>(eta).ln_density(&identity);
        assert_close(got, -mass_of_power(2, eta).ln(), 1e-10, 1e-10, "c₂");
        let identity =
            CholeskyFactor::new([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]).unwrap();
        let got: f64 = LkjCholesky::<3>(eta).ln_density(&identity);
        assert_close(got, -mass_of_power(3, eta).ln(), 1e-10, 1e-10, "c₃");
    }
}

/// Checks that the density is a product over the coordinates: the marginal density of each coordinate integrates to 1.
#[test]
fn coordinates_separate() {
    let base = [0.3, -0.8, 1.1];
    let at = |x: [f64; 3]| constrain::<f64, 3>(2.0, &x, true).1;
    let along = |i: usize| {
        let p = |v: f64| {
            let mut x = base;
            x[i] = v;
            at(x).exp()
        };
        integral(p, 0.0, 1.0)
    };
    let product = along(0) * along(1) * along(2);
    assert_close(product / at(base).exp().powi(2), 1.0, 1e-11, 0.0, "∏ of the marginals");
}

/// Reference values of the calibration in the project's method paper: K = 3, η = 3.
#[test]
fn golden_values() {
    let rows: [([[f64; 3]; 3], f64); 3] = [
        (
            [
                [1.0, 0.0, 0.0],
                [0.35, 0.936_749_699_759_759_7, 0.0],
                [-0.2, 0.394_982_779_385_881_6, 0.896_654_116_138_772_9],
            ],
            -0.790_732_850_424_602_8,
        ),
        ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], -0.027_696_673_225_008_128),
        (
            [
                [1.0, 0.0, 0.0],
                [-0.5, 0.866_025_403_784_438_6, 0.0],
                [0.1, 0.346_410_161_513_775_5, 0.932_737_905_308_881_5],
            ],
            -1.025_425_989_021_476_3,
        ),
    ];
    for (rows, expected) in rows {
        let got: f64 = LkjCholesky::<3>(3.0).ln_density(&CholeskyFactor::new(rows).unwrap());
        assert_close(got, expected, 1e-13, 1e-14, "lp_lkj");
    }
}

/// The densities with and without the Jacobian differ by the log-Jacobian of the map in its textbook form.
#[test]
fn the_two_modes_differ_by_the_jacobian() {
    const K: usize = 5;
    let eta = 1.7;
    let x: Vec<f64> = (0..10).map(|i| 0.9 * f64::from(i * i % 7) - 2.3).collect();
    let (factor, with) = constrain::<f64, K>(eta, &x, true);
    let (_, without) = constrain::<f64, K>(eta, &x, false);
    let got: f64 = LkjCholesky::<K>(eta).ln_density(&factor);
    assert_close(without, got, 1e-12, 1e-12, "density over factors");
    let mut ln_jacobian = 0.0;
    for i in 1..K {
        for j in 0..i {
            let partial = |k: usize| -> f64 { factor.get(i, k).powi(2) };
            let rest = 1.0 - (0..j).map(partial).sum::<f64>();
            let z = factor.get(i, j) / rest.sqrt();
            let b = eta + 0.5 * (K as f64 - 2.0 - j as f64);
            ln_jacobian += (1.0 - z * z).ln() + 0.5 * rest.ln() - 0.5 * (2.0 * b).ln();
        }
    }
    assert_close(with - without, ln_jacobian, 1e-11, 1e-11, "log-Jacobian");
}

#[test]
fn derivatives() {
    let x = [0.3, -0.8, 1.1, 2.0, -0.1, 0.6];
    // the density with and without Jacobian, and every entry of the factor in one weighted sum
    fn readings<R: Scalar>(x: [R; 6]) -> [R; 3] {
        let (factor, with) = constrain::<R, 4>(2.5, &x, true);
        let (_, without) = constrain::<R, 4>(2.5, &x, false);
        let mut entries = LkjCholesky::<4>(2.5).ln_density(&factor);
        for i in 0..4 {
            for j in 0..=i {
                entries += factor.get(i, j) * (1.0 + i as f64 - 0.3 * j as f64);
            }
        }
        [with, without, entries]
    }
    let got = readings(Dual::variables(x));
    for i in 0..6 {
        for mode in 0..3 {
            let moved = |v: f64| {
                let mut x = x;
                x[i] = v;
                readings(x)[mode]
            };
            let numerical = derivative(moved, x[i], 0.1);
            let what = format!("∂{i}, reading {mode}");
            assert_close(got[mode].gradient()[i], numerical, 1e-8, 1e-8, &what);
        }
    }
}

/// Compares all functions of a factor that is stored by coordinates with the same functions of a factor that is stored
/// by entries.
#[test]
fn factors_by_coordinates_and_by_entries() {
    type D = Dual<10>;
    fn readings(factor: CholeskyFactor<D, 4>) -> Vec<D> {
        let b = [0.7, -0.2, 0.4, 1.1].map(D::from);
        let entries = (0..16).map(|k| factor.get(k / 4, k % 4));
        let matrices = [factor.rows(), factor.covariance(), factor.correlation()];
        let scaled_again = factor.scale_rows([b[0], b[2], b[3], b[0]]).rows();
        entries
            .chain(matrices.as_flattened().iter().flatten().copied())
            .chain(scaled_again.iter().flatten().copied())
            .chain(factor.times(b))
            .chain(factor.solve_lower(b))
            .chain([MvNormalCholesky(b, factor).ln_density(&[D::from(0.5); 4])])
            .collect()
    }
    let variables = D::variables([0.3, -0.8, 1.1, 2.0, -0.1, 0.6, 0.5, 2.0, 1.5, 3.0]);
    let (x, scale) = (&variables[..6], [variables[6], variables[7], variables[8], variables[9]]);
    let (by_coordinates, _) = constrain::<D, 4>(2.5, x, true);
    let mut next = x.iter();
    let rows: [[D; 4]; 4] = std::array::from_fn(|i| {
        let (mut row, mut rest) = ([D::from(0.0); 4], D::from(1.0));
        for j in 0..i {
            // 2 b = 2 η + K − 2 − j
            let y = *next.next().unwrap() / (7.0 - j as f64).sqrt();
            row[j] = y.tanh() * rest;
            rest /= y.cosh();
        }
        row[i] = rest;
        row
    });
    let made = CholeskyFactor::new(rows).unwrap();
    let stretched: [[D; 4]; 4] = std::array::from_fn(|i| rows[i].map(|entry| entry * scale[i]));
    let stretched = CholeskyFactor::new(stretched).unwrap();
    let density = |factor| LkjCholesky::<4>(2.0).ln_density(factor);
    for (found, expected) in [
        (readings(by_coordinates), readings(made)),
        (readings(by_coordinates.scale_rows(scale)), readings(stretched)),
        (vec![density(&by_coordinates)], vec![density(&made)]),
    ] {
        for (k, (found, expected)) in found.iter().zip(&expected).enumerate() {
            let what = format!("reading {k}");
            assert_close(found.value(), expected.value(), 1e-13, 1e-13, &what);
            for (f, e) in found.gradient().iter().zip(expected.gradient()) {
                assert_close(*f, e, 1e-12, 1e-12, &what);
            }
        }
    }
}

ppl::model! {
    fn readings(data: &[[f64; 3]]) {
        let nu ~ Gamma(2.0, 0.1);
        let z ~ Normal(0.0, 1.0).array::<3>();
        let sd ~ HalfNormal(1.0).array::<3>();
        let corr ~ LkjCholesky::<3>(2.0);
        let chol = corr.scale_rows(sd);
        let (x, y) = (chol.times(z), chol.solve_lower(z));
        factor(-0.1 * (x[2] * y[1] + chol.covariance()[2][1] * corr.correlation()[1][0]));
        factor(LkjCholesky::<3>(3.0).ln_density(&corr));
        for row in data {
            row ~ MvNormalCholesky([z[0] * row[1], x[0], y[2] - row[0]], chol);
            let again = *row;
            again ~ MvNormalCholesky([z[0] + nu, x[1], y[1]], corr);
            let first = row[0];
            first ~ Normal(corr.get(2, 1) + chol.get(2, 0), chol.rows()[1][1]);
        }
    }
}

/// Checks that entries can be read on the tape: no operation may begin while the arguments of another
/// operation are written.
#[test]
fn readings_on_the_tape() {
    let data = [[0.3, -0.2, 0.9], [1.0, 0.4, -0.7]];
    let model = readings(&data);
    let y: Vec<f64> = (0..10).map(|i| 0.8 * (1.7 * f64::from(i) + 0.3).sin()).collect();
    let (mut forward, mut workspace) = ([0.0; 10], ppl::Workspace::default());
    let value = model.forward_gradient(&y, &mut forward).unwrap();
    let [mut fast, mut full] = [[0.0; 10]; 2];
    let values = [
        model.gradient(&y, &mut fast, &mut workspace),
        model.tape_gradient(&y, &mut full, &mut workspace),
    ];
    for (got, gradient) in values.into_iter().zip([fast, full]) {
        assert_close(got.unwrap(), value, 1e-12, 0.0, "value");
        for (found, expected) in gradient.into_iter().zip(forward) {
            assert_close(found, expected, 1e-11, 1e-11, "gradient");
        }
    }
}

ppl::model! {
    /// Factors of small and large matrices.
    fn by_entries(pairs: &[[f64; 3]], wide: &[[f64; 9]]) {
        let small ~ LkjCholesky::<3>(1.3);
        let large ~ LkjCholesky::<9>(2.0);
        for y in pairs {
            y ~ MvNormalCholesky([0.0; 3], small);
        }
        for row in wide {
            row ~ MvNormalCholesky([0.0; 9], large);
        }
    }
}

/// Compares with finite differences of the log density, which do not use derivatives.
#[test]
fn entries_have_their_derivatives() {
    let wide = [std::array::from_fn(|i| (1.3 * i as f64).sin())];
    ppl::check::gradient(&by_entries(&[[0.3, -0.2, 0.9], [1.0, 0.4, -0.7]], &wide), 3);
}

/// Checks that every correlation has the distribution Beta(η − 1 + K/2, η − 1 + K/2) on (−1, 1).
#[test]
fn marginals_of_draws() {
    fn check<const K: usize>(eta: f64) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let draws: Vec<Vec<f64>> =
            (0..10_000).map(|_| correlations::<K>(&LkjCholesky::<K>(eta).draw(&mut rng))).collect();
        let shape = eta - 1.0 + 0.5 * K as f64;
        for pair in 0..draws[0].len() {
            let column: Vec<f64> = draws.iter().map(|r| r[pair]).collect();
            let statistic =
                kolmogorov_smirnov(&column, |r| Beta(shape, shape).cdf(0.5 * (1.0 + r)));
            assert!(statistic < KOLMOGOROV_SMIRNOV_LIMIT, "K {K}, η {eta}, {pair}: {statistic}");
        }
    }
    check::<2>(1.0);
    check::<3>(3.0);
    check::<4>(0.5);
    check::<6>(1.0);
}

/// Matrices of forty quantities: prior draws have moderate coordinates, the map is invertible, and the last entries of
/// the factor have full accuracy.
#[test]
fn large_matrices() {
    const K: usize = 40;
    let lkj = LkjCholesky::<K>(1.0);
    assert_eq!(Unknown::<f64>::dim(&lkj), 780);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
    let factor: CholeskyFactor<f64, K> = lkj.draw(&mut rng);
    let mut x = Vec::new();
    lkj.unconstrain(&factor, &mut x);
    let largest = x.iter().fold(0.0f64, |m, x| m.max(x.abs()));
    assert!(largest < 7.0, "{largest}");
    let spread = x.iter().map(|x| x * x).sum::<f64>() / 780.0;
    assert!((spread - 1.0).abs() < 0.3, "{spread}");
    let (back, ln_density) = constrain::<f64, K>(1.0, &x, true);
    assert!(ln_density.is_finite());
    for i in 0..K {
        for j in 0..=i {
            assert_close(back.get(i, j), factor.get(i, j), 1e-12, 0.0, "round trip");
        }
    }
    // a point within the range (−2, 2) of the usual starting points
    let start: Vec<f64> = (0..780).map(|i| (f64::from(i) * 0.7).sin() * 2.0).collect();
    let (factor, ln_density) = constrain::<f64, K>(1.0, &start, true);
    assert!(ln_density.is_finite());
    assert!((0..K).all(|i| factor.get(i, i) > 0.0));
    let mut again = Vec::new();
    lkj.unconstrain(&factor, &mut again);
    for (again, start) in again.iter().zip(&start) {
        assert_close(*again, *start, 1e-12, 1e-12, "coordinates");
    }
}

/// Coordinates so large that tanh is 1 in floating-point arithmetic.
#[test]
fn far_coordinates_stay_finite() {
    let x = [400.0, -300.0, 250.0];
    let (_, ln_density) = constrain::<f64, 3>(3.0, &x, true);
    let by_hand: f64 = [(7.0f64, 400.0f64), (7.0, 300.0), (6.0, 250.0)]
        .iter()
        .map(|(twice_b, x)| {
            let y = x / twice_b.sqrt();
            let ln_beta: f64 = [0.5, 0.5 * twice_b].map(ppl::special::ln_gamma).iter().sum::<f64>()
                - ppl::special::ln_gamma(0.5 * (twice_b + 1.0));
            -twice_b * (y - std::f64::consts::LN_2) - ln_beta - 0.5 * twice_b.ln()
        })
        .sum();
    assert_close(ln_density, by_hand, 1e-13, 0.0, "ln p");
}

#[test]
fn what_is_no_correlation_factor_has_no_density() {
    let covariance = CholeskyFactor::new([[2.0, 0.0], [0.0, 1.0]]).unwrap();
    let ln_density: f64 = LkjCholesky::<2>(1.0).ln_density(&covariance);
    assert_eq!(ln_density, f64::NEG_INFINITY);
}

/// Checks that the memoised constant is never used for another η or another size.
#[test]
fn constants_are_not_mixed_up() {
    let at = |eta: f64, jacobian: bool| constrain::<f64, 3>(eta, &[0.0; 3], jacobian).1;
    let smaller = |eta: f64| constrain::<f64, 2>(eta, &[0.0], true).1;
    let fresh = [at(1.0, true), at(2.0, true), at(1.0, false), smaller(1.0), smaller(2.0)];
    // ½ per coordinate at y = 0: −ln B(½, b) − ½ ln 2b, with b = η + ½ and b = η
    let term = |b: f64| -ppl::special::ln_beta(0.5, b) - 0.5 * (2.0 * b).ln();
    for (got, eta) in [(fresh[0], 1.0), (fresh[1], 2.0)] {
        assert_close(got, 2.0 * term(eta + 0.5) + term(eta), 1e-13, 0.0, "K = 3");
    }
    assert_close(fresh[3], term(1.0), 1e-13, 0.0, "K = 2");
    assert_close(fresh[4], term(2.0), 1e-13, 0.0, "K = 2");
    assert_eq!([at(1.0, true), at(1.0, true), at(1.0, false)], [fresh[0], fresh[0], fresh[2]]);
    assert_eq!(at(1.0, false), fresh[2]);
}
