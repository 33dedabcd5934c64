//! Multivariate normal distribution and Cholesky factors.

use ppl::prelude::*;
use ppl::{Bound, Context, Dual, LogDensity, Model, Recordable, Rejection, Site, Workspace};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::numerics::{
    KOLMOGOROV_SMIRNOV_LIMIT, assert_close, constrained, derivative, integral, kolmogorov_smirnov,
};

const MEAN: [f64; 3] = [0.4, -1.0, 2.0];
const ROWS: [[f64; 3]; 3] = [[1.5, 0.0, 0.0], [-0.4, 0.7, 0.0], [0.3, 1.1, 2.0]];
const POINT: [f64; 3] = [1.0, -2.0, 4.5];

fn lower<R: Scalar>(entries: [R; 6]) -> CholeskyFactor<R, 3> {
    let zero = R::from(0.0);
    let [a, b, c, d, e, f] = entries;
    CholeskyFactor::new([[a, zero, zero], [b, c, zero], [d, e, f]]).unwrap()
}

fn entries() -> [f64; 6] {
    [ROWS[0][0], ROWS[1][0], ROWS[1][1], ROWS[2][0], ROWS[2][1], ROWS[2][2]]
}

/// Compares with the formula in terms of the covariance matrix, its inverse and its determinant.
#[test]
fn density_equals_the_textbook_form() {
    let factor = nalgebra::Matrix3::from_fn(|i, j| ROWS[i][j]);
    let covariance = factor * factor.transpose();
    let residual = nalgebra::Vector3::from_fn(|i, _| POINT[i] - MEAN[i]);
    let square = residual.dot(&(covariance.try_inverse().unwrap() * residual));
    let determinant = (2.0 * std::f64::consts::PI).powi(3) * covariance.determinant();
    let expected = -0.5 * (square + determinant.ln());
    let got: f64 = MvNormalCholesky(MEAN, lower(entries())).ln_density(&POINT);
    assert_close(got, expected, 1e-13, 0.0, "ln p");
}

/// Checks that ∫∫ p = 1 in two dimensions.
#[test]
fn density_integrates_to_one() {
    let factor = CholeskyFactor::new([[1.5, 0.0], [-0.4, 0.7]]).unwrap();
    let joint = MvNormalCholesky([0.4, -1.0], factor);
    let over = |x: f64| {
        let p = |y: f64| -> f64 { joint.ln_density(&[x, y]).exp() };
        if (x - 0.4).abs() > 20.0 { 0.0 } else { integral(p, -1.0, 1.0) }
    };
    assert_close(integral(over, 0.4, 1.0), 1.0, 1e-11, 0.0, "∫∫p");
}

/// Compares the twelve partial derivatives with finite differences, and mixed data and unknowns with all unknowns.
#[test]
fn partials() {
    let arguments: [f64; 12] = std::array::from_fn(|i| match i {
        0..3 => POINT[i],
        3..6 => MEAN[i - 3],
        _ => entries()[i - 6],
    });
    fn ln_density<R: Scalar>(a: [R; 12]) -> R {
        let mean = [a[3], a[4], a[5]];
        let factor = lower([a[6], a[7], a[8], a[9], a[10], a[11]]);
        MvNormalCholesky(mean, factor).ln_density(&[a[0], a[1], a[2]])
    }
    let got = ln_density(Dual::variables(arguments));
    assert_close(got.value(), ln_density(arguments), 1e-15, 0.0, "value");
    for i in 0..12 {
        let moved = |v: f64| {
            let mut a = arguments;
            a[i] = v;
            ln_density(a)
        };
        let numerical = derivative(moved, arguments[i], 0.05);
        assert_close(got.gradient()[i], numerical, 1e-8, 1e-8, &format!("partial {i}"));
    }
    // mean and factor are data, so that there are only derivatives with respect to x
    let x: [Dual<3>; 3] = Dual::variables(POINT);
    let by_x: Dual<3> = MvNormalCholesky(MEAN, lower(entries())).ln_density(&x);
    assert_eq!(by_x.gradient(), std::array::from_fn(|i| got.gradient()[i]));
    let by_reference: f64 = MvNormalCholesky(&MEAN, &lower(entries())).ln_density(&POINT);
    assert_eq!(by_reference, ln_density(arguments));
}

#[test]
fn as_unknown_it_is_its_own_coordinate() {
    let joint = MvNormalCholesky(MEAN, lower(entries()));
    let mut y = Vec::new();
    Unknown::<f64>::unconstrain(&joint, &POINT, &mut y);
    assert_eq!(y, POINT);
    let mut next = y.into_iter();
    let (x, ln_density) = constrained(&joint, || next.next().unwrap(), true);
    assert_eq!(x, POINT);
    assert_eq!(ln_density, joint.ln_density(&POINT));
    assert_eq!(Unknown::<f64>::dim(&joint), 3);
}

/// Checks that z = L⁻¹(x − μ) of draws is standard normal: each entry, and the products of entries.
#[test]
fn draws() {
    const N: usize = 20_000;
    let factor = lower(entries());
    let joint = MvNormalCholesky(MEAN, factor);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(8);
    let whitened: Vec<[f64; 3]> = (0..N)
        .map(|_| {
            let x: [f64; 3] = joint.draw(&mut rng);
            factor.solve_lower(std::array::from_fn(|i| x[i] - MEAN[i]))
        })
        .collect();
    for i in 0..3 {
        let column: Vec<f64> = whitened.iter().map(|z| z[i]).collect();
        let standard = Normal(0.0, 1.0);
        let statistic = kolmogorov_smirnov(&column, |z| ppl::Univariate::cdf(&standard, z));
        assert!(statistic < KOLMOGOROV_SMIRNOV_LIMIT, "z[{i}]: {statistic}");
        for j in 0..i {
            let correlation = whitened.iter().map(|z| z[i] * z[j]).sum::<f64>() / N as f64;
            assert!(correlation.abs() < 4.0 / (N as f64).sqrt(), "z[{i}] z[{j}]: {correlation}");
        }
    }
}

#[test]
fn factor_operations() {
    let factor = lower(entries());
    let covariance = factor.covariance();
    let dense = nalgebra::Matrix3::from_fn(|i, j| ROWS[i][j]);
    let expected = dense * dense.transpose();
    let correlation = factor.correlation();
    for i in 0..3 {
        for j in 0..3 {
            assert_close(covariance[i][j], expected[(i, j)], 1e-15, 1e-15, "L Lᵀ");
            let scaled = expected[(i, j)] / (expected[(i, i)] * expected[(j, j)]).sqrt();
            assert_close(correlation[i][j], scaled, 1e-15, 1e-15, "correlation");
        }
    }
    let x = factor.solve_lower(POINT);
    for (back, expected) in factor.times(x).iter().zip(POINT) {
        assert_close(*back, expected, 1e-14, 0.0, "L L⁻¹ b");
    }
    let scaled = factor.scale_rows([2.0, 3.0, 4.0]);
    assert_eq!((scaled.get(2, 1), scaled.get(1, 2)), (4.0 * 1.1, 0.0));
    assert_eq!(factor.shape(), [3, 3]);
    let mut flat = Vec::new();
    factor.flatten(&mut flat);
    assert_eq!(flat, ROWS.concat());
}

/// Checks derivatives through solution, product, covariance and correlation.
#[test]
fn factor_derivatives() {
    fn mixed<R: Scalar>(a: [R; 9]) -> R {
        let factor = lower([a[0], a[1], a[2], a[3], a[4], a[5]]);
        let x = factor.solve_lower([a[6], a[7], a[8]]);
        let product = factor.times([x[2], x[0], x[1]]);
        let scaled = factor.scale_rows([a[8], a[6], a[7]]);
        product[2] * x[1]
            + scaled.covariance()[2][1] * product[1]
            + factor.correlation()[2][0] * x[2]
    }
    let arguments: [f64; 9] =
        std::array::from_fn(|i| if i < 6 { entries()[i] } else { POINT[i - 6] });
    let got = mixed(Dual::variables(arguments));
    for i in 0..9 {
        let moved = |v: f64| {
            let mut a = arguments;
            a[i] = v;
            mixed(a)
        };
        let numerical = derivative(moved, arguments[i], 0.05);
        assert_close(got.gradient()[i], numerical, 1e-8, 1e-8, &format!("partial {i}"));
    }
}

/// Reference values of the calibration in the project's method paper: the likelihood of eight experiments at three
/// points, given the factor of the correlations and the standard deviations.
#[test]
fn golden_likelihoods() {
    const EXPERIMENTS: [[f64; 3]; 8] = [
        [1.050_972, 1.014_755, 1.081_852],
        [1.363_639, 0.992_115, 0.966_638],
        [1.064_838, 1.209_352, 1.045_033],
        [1.26906, 1.198_739, 0.98926],
        [1.02392, 1.287_301, 1.400_661],
        [1.182_857, 1.153_241, 1.223_388],
        [0.996_402, 0.916_886, 1.099_366],
        [0.931_291, 1.118_321, 1.119_951],
    ];
    type Point = ([f64; 3], [f64; 3], [[f64; 3]; 3], f64);
    let references: [Point; 3] = [
        (
            [1.100_569_933_625_000_6, 1.110_925_257_250_000_1, 1.007_565_954_187_5],
            [0.15, 0.13, 0.17],
            [
                [1.0, 0.0, 0.0],
                [0.35, 0.936_749_699_759_759_7, 0.0],
                [-0.2, 0.394_982_779_385_881_6, 0.896_654_116_138_772_9],
            ],
            13.440_829_802_644_817,
        ),
        (
            [1.018_166_5, 1.038_749_5, 1.016_579_000_000_000_1],
            [0.2, 0.2, 0.2],
            [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            9.192_107_371_443_765,
        ),
        (
            [0.802_062_175_312_5, 1.033_333_040_187_5, 1.227_189_049_812_5],
            [0.31, 0.08, 0.4],
            [
                [1.0, 0.0, 0.0],
                [-0.5, 0.866_025_403_784_438_6, 0.0],
                [0.1, 0.346_410_161_513_775_5, 0.932_737_905_308_881_5],
            ],
            -17.203_871_087_740_847,
        ),
    ];
    for (mean, sd, rows, expected) in references {
        let factor = CholeskyFactor::new(rows).unwrap().scale_rows(sd);
        let got: f64 = MvNormalCholesky(mean, factor).iid(8).ln_density(&EXPERIMENTS.to_vec());
        assert_close(got, expected, 1e-13, 0.0, "loglik");
    }
}

/// Correlated unknowns: mean, scales, correlations, and a vector with this distribution.
struct Hierarchy;

impl Model for Hierarchy {
    fn run<C: Context>(&self, cx: &mut C) -> Result<(), Rejection> {
        static SD: Site = Site::new("sd");
        static CORR: Site = Site::new("corr");
        static EFFECT: Site = Site::new("effect");
        static COUNT: Site = Site::new("count");
        let sd = cx.unknown(&SD, HalfNormal(1.0).array::<3>())?;
        let corr = cx.unknown(&CORR, LkjCholesky::<3>(2.0))?;
        let effect = cx.unknown(&EFFECT, MvNormalCholesky([0.0; 3], corr.scale_rows(sd)))?;
        let matrix = corr.correlation();
        cx.observe(&COUNT, 4, Poisson((effect[0] + effect[2] * matrix[2][0]).exp()))
    }
}

/// Compares value, reverse mode and forward mode of a model with each other, with finite differences and with a record.
#[test]
fn a_model_of_correlated_unknowns() {
    let model = Bound::new(Hierarchy);
    let layout = model.layout().unwrap();
    assert_eq!((layout.dim, layout.variables[1].shape.clone()), (9, vec![3, 3]));
    let y = [0.1, -0.4, 0.3, 0.8, -0.5, 0.2, 0.7, -0.3, 0.4];
    let mut w = Workspace::default();
    let (mut reverse, mut forward) = ([0.0; 9], [0.0; 9]);
    let value = model.gradient(&y, &mut reverse, &mut w).unwrap();
    assert_close(model.log_density(&y, &mut w).unwrap(), value, 1e-14, 0.0, "value");
    model.forward_gradient(&y, &mut forward).unwrap();
    for i in 0..9 {
        assert_close(reverse[i], forward[i], 1e-12, 1e-12, "forward mode");
        let moved = |v: f64| {
            let mut y = y;
            y[i] = v;
            model.log_density(&y, &mut Workspace::default()).unwrap()
        };
        assert_close(reverse[i], derivative(moved, y[i], 0.05), 1e-8, 1e-8, "difference");
    }
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let record = model.constrain(&y, &mut rng).unwrap();
    for (back, y) in record.unconstrained.iter().zip(y) {
        assert_close(*back, y, 1e-12, 1e-12, "coordinates");
    }
}
