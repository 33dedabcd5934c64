//! Gaussian processes against dense matrix algebra, and as unknowns.

use ppl::prelude::*;
use ppl::{Dual, Scalar};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::numerics::{assert_close, derivative, moments};
use crate::vector_conformance::{assert_unknown, unknown};

const X: [[f64; 2]; 4] = [[0.0, 0.3], [0.5, -0.2], [1.1, 0.9], [2.0, 0.1]];
const NEW: [[f64; 2]; 2] = [[0.7, 0.2], [1.6, -0.4]];
const Y: [f64; 4] = [0.3, -0.8, 1.2, 0.4];

/// k(x, x') as the textbooks print it.
fn textbook(kernel: usize, a: f64, lengths: [f64; 2], x: [f64; 2], y: [f64; 2]) -> f64 {
    let r = (0..2).map(|d| ((x[d] - y[d]) / lengths[d]).powi(2)).sum::<f64>().sqrt();
    a * a
        * match kernel {
            0 => (-r * r / 2.0).exp(),
            1 => (1.0 + 3.0f64.sqrt() * r) * (-(3.0f64.sqrt()) * r).exp(),
            _ => {
                let s = 5.0f64.sqrt() * r;
                (1.0 + s + s * s / 3.0) * (-s).exp()
            }
        }
}

/// Amplitude, two length scales, noise, mean.
const PARAMETERS: [f64; 5] = [1.3, 0.8, 1.7, 0.4, 0.2];

/// Density of `Y`, and of two values at new inputs given them.
fn densities<R: Scalar>(kernel: usize, p: [R; 5], y: [R; 4], new: [R; 2]) -> [R; 2] {
    fn both<R: Scalar, K: ppl::Kernel<R>>(k: K, p: [R; 5], y: [R; 4], new: [R; 2]) -> [R; 2] {
        let process = GaussianProcess::new(&X, k).noise(p[3]).mean(p[4]);
        [process.ln_density(&y.to_vec()), process.predict(y, &NEW).ln_density(&new.to_vec())]
    }
    let lengths = [p[1], p[2]];
    match kernel {
        0 => both(SquaredExponential(p[0], lengths), p, y, new),
        1 => both(Matern32(p[0], lengths), p, y, new),
        _ => both(Matern52(p[0], lengths), p, y, new),
    }
}

#[test]
fn densities_equal_dense_algebra() {
    let [a, l0, l1, sd, mean] = PARAMETERS;
    for kernel in 0..3 {
        let points = [&X[..], &NEW[..]].concat();
        let noise = |i: usize| if i < 4 { sd * sd } else { 0.0 };
        let k = nalgebra::Matrix6::from_fn(|i, j| {
            let own = if i == j { noise(i) + 1e-10 * a * a } else { 0.0 };
            textbook(kernel, a, [l0, l1], points[i], points[j]) + own
        });
        let (k11, k12, k22) =
            (k.fixed_view::<4, 4>(0, 0), k.fixed_view::<4, 2>(0, 4), k.fixed_view::<2, 2>(4, 4));
        let y = nalgebra::Vector4::from(Y).add_scalar(-mean);
        let inverse = k11.try_inverse().unwrap();
        let two_pi = 2.0 * std::f64::consts::PI;
        let square = y.dot(&(inverse * y));
        let expected = -0.5 * (square + k11.determinant().ln() + 4.0 * two_pi.ln());
        let new = [0.6, -0.3];
        let [marginal, conditional] = densities(kernel, PARAMETERS, Y, new);
        assert_close(marginal, expected, 1e-10, 0.0, "marginal");

        let at_new = (k12.transpose() * inverse * y).add_scalar(mean);
        let spread = k22 - k12.transpose() * inverse * k12;
        let deviation = nalgebra::Vector2::from(new) - at_new;
        let square = deviation.dot(&(spread.try_inverse().unwrap() * deviation));
        let expected = -0.5 * (square + spread.determinant().ln() + 2.0 * two_pi.ln());
        assert_close(conditional, expected, 1e-9, 1e-9, "conditional");

        if kernel == 2 {
            let process = GaussianProcess::new(&X, Matern52(a, [l0, l1])).noise(sd).mean(mean);
            let prediction = process.predict(Y, &NEW);
            let (means, sds) = prediction.moments::<f64>();
            for i in 0..2 {
                assert_close(means[i], at_new[i], 1e-11, 1e-11, "mean");
                assert_close(sds[i], spread[(i, i)].sqrt(), 1e-11, 0.0, "sd");
            }
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
            let n = 20_000;
            let draws: Vec<Vec<f64>> = (0..n).map(|_| prediction.draw(&mut rng)).collect();
            for i in 0..2 {
                let (got, variance) = moments(&draws.iter().map(|f| f[i]).collect::<Vec<_>>());
                let error = sds[i] / f64::from(n).sqrt();
                assert_close(got, means[i], 0.0, 4.5 * error, "mean of draws");
                let error = sds[i].powi(2) * (2.0 / f64::from(n)).sqrt();
                assert_close(variance, sds[i].powi(2), 0.0, 4.5 * error, "variance of draws");
            }
            let product = |f: &Vec<f64>| (f[0] - means[0]) * (f[1] - means[1]);
            let (covariance, variance) = moments(&draws.iter().map(product).collect::<Vec<_>>());
            let error = (variance / f64::from(n)).sqrt();
            assert_close(covariance, spread[(0, 1)], 0.0, 4.5 * error, "covariance of draws");
        }
    }
}

/// Eleven partials by the trace formula against differences.
#[test]
fn partials() {
    let at: [f64; 11] = std::array::from_fn(|i| match i {
        0..5 => PARAMETERS[i],
        5..9 => Y[i - 5],
        _ => [0.6, -0.3][i - 9],
    });
    fn read<R: Scalar>(kernel: usize, p: [R; 11]) -> [R; 2] {
        let [a, b, c, d, e, y0, y1, y2, y3, f, g] = p;
        densities(kernel, [a, b, c, d, e], [y0, y1, y2, y3], [f, g])
    }
    for kernel in 0..3 {
        let got = read(kernel, Dual::variables(at));
        for i in 0..11 {
            for o in 0..2 {
                let moved = |x: f64| {
                    let mut p = at;
                    p[i] = x;
                    read(kernel, p)[o]
                };
                let expected = derivative(moved, at[i], 0.02 * at[i].abs().max(0.2));
                let what = format!("kernel {kernel}, ∂{i} of density {o}");
                assert_close(got[o].gradient()[i], expected, 1e-7, 1e-7, &what);
            }
        }
    }
}

const LINE: [f64; 3] = [0.0, 0.8, 1.9];

unknown!(Latent, |p| GaussianProcess::new(&LINE, Matern52(p[0], p[1])).mean(p[2]));
unknown!(NoisyLatent, |p| {
    GaussianProcess::new(&LINE, SquaredExponential(p[0], [p[1]]))
        .noise(p[2])
        .mean([p[3], p[4], p[3]])
});

#[test]
fn latent_values() {
    let (y, all) = ([0.3, -0.5, 0.8], [0, 1, 2]);
    assert_unknown("latent", &Latent, &[1.3, 0.9, 0.2], &y, &all);
    assert_unknown("noisy latent", &NoisyLatent, &[1.3, 0.9, 0.4, 0.2, -0.3], &y, &all);
}

#[test]
fn what_does_not_fit_is_said() {
    let kernel = SquaredExponential(1.0, 0.5);
    let message = |result: Result<(), ppl::DomainError>| result.unwrap_err().to_string();
    let negative = GaussianProcess::new(&LINE, SquaredExponential(-1.0, 0.5));
    assert_eq!(
        message(Distribution::<f64>::validate(&negative)),
        "GaussianProcess: amplitude must be positive and finite, got -1"
    );
    let lengths = GaussianProcess::new(&LINE, SquaredExponential(1.0, [0.5, 0.4]));
    assert_eq!(
        message(Distribution::<f64>::validate(&lengths)),
        "GaussianProcess: number of length scales must be 1 or that of the coordinates, 1, got 2"
    );
    let mean = GaussianProcess::new(&LINE, kernel).mean([0.0; 2]);
    assert_eq!(
        message(Distribution::<f64>::validate(&mean)),
        "GaussianProcess: length of the mean must be that of the inputs, 3, got 2"
    );
    let given = GaussianProcess::new(&LINE, kernel).predict([0.0; 2], &LINE);
    assert_eq!(
        message(Distribution::<f64>::validate(&given)),
        "predict: number of values must be that of the inputs, 3, got 2"
    );
    // two equal inputs without noise: only the jitter keeps the matrix definite; with NaN nothing
    let twice = [0.0, 0.0];
    let value: f64 = GaussianProcess::new(&twice, kernel).ln_density(&vec![0.1, 0.1]);
    assert!(value.is_finite());
    let broken: f64 =
        GaussianProcess::new(&twice, SquaredExponential(1.0, f64::NAN)).ln_density(&vec![0.1; 2]);
    assert!(broken.is_nan());
}
