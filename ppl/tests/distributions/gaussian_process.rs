//! Gaussian processes against dense reference computations, finite differences and closed forms.

use nalgebra::{DMatrix, DVector};
use ppl::prelude::*;
use ppl::{Covariance, CovarianceParameters, Dual, Role};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::numerics::assert_close;

const POINTS: [[f64; 2]; 5] = [[0.0, 1.0], [0.4, -0.5], [1.1, 0.2], [1.3, 2.0], [2.0, -1.0]];
const VALUES: [f64; 5] = [0.3, -0.2, 0.9, 1.4, 0.1];
const MEANS: [f64; 5] = [0.1, 0.0, -0.3, 0.8, 0.2];

/// Correlation as a function of u² > 0, written with the operations of a scalar type.
type Correlation<R> = fn(R) -> R;

fn squared_exponential<R: Scalar>(square: R) -> R {
    (square * -0.5).exp()
}

fn matern_32<R: Scalar>(square: R) -> R {
    let distance = (square * 3.0).sqrt();
    (distance + 1.0) * (-distance).exp()
}

fn matern_52<R: Scalar>(square: R) -> R {
    let distance = (square * 5.0).sqrt();
    (distance + 1.0 + distance.square() / 3.0) * (-distance).exp()
}

/// Log density by the Cholesky factor of a covariance matrix whose entries are differentiated one by one.
fn reference<R: Scalar>(
    correlation: Correlation<R>,
    values: &[R],
    means: &[R],
    [amplitude, sd]: [R; 2],
    lengths: [R; 2],
) -> R {
    let entry = |i: usize, j: usize| {
        if i == j {
            return amplitude.square() + sd.square();
        }
        let scaled = |d: usize| ((R::from(POINTS[i][d]) - POINTS[j][d]) / lengths[d]).square();
        amplitude.square() * correlation(scaled(0) + scaled(1))
    };
    let matrix: Vec<Vec<R>> = (0..5).map(|i| (0..=i).map(|j| entry(i, j)).collect()).collect();
    let factor = DynCholeskyFactor::of_covariance(&matrix).unwrap();
    MvNormalCholesky(means, factor).ln_density(&values.to_vec())
}

type D = Dual<14>;

/// Compares value and all 14 derivatives: five values, five means, amplitude, noise, two lengths.
fn compare<K: CovarianceParameters<D>>(
    name: &str,
    correlation: Correlation<D>,
    covariance: impl Fn(D, [D; 2]) -> K,
) {
    let variables = [&VALUES[..], &MEANS, &[1.3, 0.2, 0.7, 1.9]].concat();
    let variables: [D; 14] = Dual::variables(variables.try_into().unwrap());
    let (values, means) = (&variables[..5], &variables[5..10]);
    let [amplitude, sd, first, second] = [10, 11, 12, 13].map(|i| variables[i]);
    let process = GaussianProcess(&POINTS, means, covariance(amplitude, [first, second]), sd);
    let found: D = process.ln_density(&values.to_vec());
    let expected = reference(correlation, values, means, [amplitude, sd], [first, second]);
    assert_close(found.value(), expected.value(), 1e-13, 1e-13, name);
    for (i, (a, b)) in found.gradient().iter().zip(expected.gradient()).enumerate() {
        assert_close(*a, b, 1e-11, 1e-11, &format!("{name}: derivative {i}"));
    }
}

#[test]
fn densities_and_derivatives_are_those_of_the_dense_reference() {
    compare("SquaredExponential", squared_exponential, |a, l| SquaredExponential(a, PerColumn(l)));
    compare("Matern32", matern_32, |a, l| Matern32(a, PerColumn(l)));
    compare("Matern52", matern_52, |a, l| Matern52(a, PerColumn(l)));
}

/// With one length for all columns, the derivative is the sum of the derivatives with respect to equal lengths.
#[test]
fn one_length_is_the_same_length_for_every_column() {
    let [amplitude, length, sd]: [Dual<3>; 3] = Dual::variables([1.3, 0.8, 0.2]);
    let values = VALUES.map(Dual::from).to_vec();
    let one: Dual<3> =
        GaussianProcess(&POINTS, &MEANS, Matern52(amplitude, length), sd).ln_density(&values);
    let both = Matern52(amplitude, PerColumn([length, length]));
    let two: Dual<3> = GaussianProcess(&POINTS, &MEANS, both, sd).ln_density(&values);
    assert_close(one.value(), two.value(), 1e-14, 1e-14, "value");
    for i in 0..3 {
        assert_close(one.gradient()[i], two.gradient()[i], 1e-12, 1e-12, &format!("slope {i}"));
    }
}

/// One point: a normal distribution with variance a² + s². Two points: the bivariate normal distribution.
#[test]
fn few_points_in_closed_form() {
    let covariance = SquaredExponential(1.2, 0.5);
    let one: f64 = GaussianProcess(&[3.0], &[0.4], covariance, 0.9).ln_density(&vec![2.0]);
    assert_close(one, Normal(0.4, 1.5).ln_density(&2.0), 1e-14, 0.0, "one point");
    let (variance, shared) = (2.25, 1.44 * (-0.5f64).exp());
    let (x, y) = (1.6, -0.3);
    let determinant = variance * variance - shared * shared;
    let form = (variance * (x * x + y * y) - 2.0 * shared * x * y) / determinant;
    let expected = -0.5 * form - 0.5 * determinant.ln() - (2.0 * std::f64::consts::PI).ln();
    let two: f64 =
        GaussianProcess(&[3.0, 3.5], &[0.4, 0.4], covariance, 0.9).ln_density(&vec![2.0, 0.1]);
    assert_close(two, expected, 1e-13, 0.0, "two points");
    let none: f64 = GaussianProcess(&[0.0; 0], &[0.0; 0], covariance, 0.9).ln_density(&Vec::new());
    assert_eq!(none, 0.0);
}

ppl::model! {
    fn discrepancy(x: &[f64], y: &[f64]) {
        let slope ~ Normal(0.0, 2.0);
        let amplitude ~ HalfNormal(1.0);
        let length ~ LogNormal(0.0, 0.5);
        let sd ~ HalfNormal(0.3);
        let mean: Vec<Real> = x.iter().map(|x| slope * x).collect();
        y ~ GaussianProcess(x, mean, Matern52(2.0 * amplitude, length), sd + 0.1);
    }

    /// A latent process: its values are unknowns.
    fn rates(x: &[[f64; 2]], counts: &[u64]) {
        let lengths ~ LogNormal(0.0, 0.5).array::<2>();
        let zero = vec![0.0; counts.len()];
        let log_rate ~ GaussianProcess(x, &zero, SquaredExponential(0.8, PerColumn(lengths)), 0.1);
        for (n, eta) in counts.iter().zip(&log_rate) {
            n ~ PoissonLog(eta);
        }
    }

    /// A process with known covariance and known noise.
    fn known(x: &[f64], y: &[f64], further: &[f64]) {
        let level ~ Normal(0.0, 2.0);
        let mean = vec![level; x.len()];
        let process = GaussianProcess(x, &mean, SquaredExponential(0.8, 0.6), 0.1);
        y ~ process;
        let beyond = vec![level; further.len()];
        #[predict] let next ~ process.predict(y, further, &beyond)?;
    }
}

const TIMES: [f64; 6] = [0.0, 0.3, 0.5, 1.2, 1.9, 2.5];
const HEIGHTS: [f64; 6] = [0.1, 0.5, 0.7, 1.0, 1.8, 2.9];

#[test]
fn gradients_of_models() {
    ppl::check::gradient(&discrepancy(&TIMES, &HEIGHTS), 3);
    ppl::check::gradient(&rates(&POINTS, &[3, 0, 2, 5, 1]), 3);
    ppl::check::gradient(&known(&TIMES, &HEIGHTS, &[3.0]), 3);
}

/// Covariance matrix of observations with the covariance function of `known`.
fn matrix(x: &[f64], y: &[f64], noise: f64) -> DMatrix<f64> {
    DMatrix::from_fn(x.len(), y.len(), |i, j| {
        let u = (x[i] - y[j]) / 0.6;
        0.64 * (-0.5 * u * u).exp() + if i == j { noise * noise } else { 0.0 }
    })
}

/// The posterior of the level is normal with known moments, and the prediction has the moments of the conditional normal
/// distribution.
#[test]
fn posterior_and_prediction_are_those_of_the_joint_normal_distribution() {
    let further = [0.9, 3.0];
    let model = known(&TIMES, &HEIGHTS, &further);
    let posterior = Nuts::default().chains(4).draws(2500).seed(8).sample(&model).unwrap();
    let inverse = matrix(&TIMES, &TIMES, 0.1).try_inverse().unwrap();
    let (ones, y) = (DVector::from_element(6, 1.0), DVector::from_row_slice(&HEIGHTS));
    let variance = (0.25 + (ones.transpose() * &inverse * &ones)[0]).recip();
    let level = variance * (ones.transpose() * &inverse * &y)[0];
    ppl::check::mean(&posterior, "level", level).within_mcse(4.0);
    ppl::check::sd(&posterior, "level", variance.sqrt()).within_mcse(4.0);
    // next = level + Kᵀ C⁻¹ (y − level) + e, with the conditional covariance of e
    let shared = matrix(&further, &TIMES, 0.0);
    let weights = &shared * &inverse;
    let own = matrix(&further, &further, 0.1) - &weights * shared.transpose();
    for i in 0..2 {
        let of_level = 1.0 - weights.row(i).sum();
        let mean = (weights.row(i) * &y)[0] + of_level * level;
        let sd = (own[(i, i)] + of_level * of_level * variance).sqrt();
        ppl::check::mean(&posterior, &format!("next[{i}]"), mean).within_mcse(4.0);
        ppl::check::sd(&posterior, &format!("next[{i}]"), sd).within_mcse(4.0);
    }
    // the covariance of the prediction is exact
    let process = GaussianProcess(&TIMES, &[0.0; 6], SquaredExponential(0.8, 0.6), 0.1);
    let predicted = process.predict(&HEIGHTS, &further, &[0.0; 2]).unwrap();
    let covariance = predicted.1.covariance();
    for i in 0..2 {
        assert_close(predicted.0[i], (weights.row(i) * &y)[0], 1e-10, 1e-12, "mean");
        for j in 0..2 {
            assert_close(covariance[i][j], own[(i, j)], 1e-10, 1e-12, "covariance");
        }
    }
}

/// Means and covariances of draws agree with the process within four standard errors.
#[test]
fn draws_have_the_moments_of_the_process() {
    let process = GaussianProcess(&TIMES, &HEIGHTS, SquaredExponential(0.8, 0.6), 0.1);
    let expected = matrix(&TIMES, &TIMES, 0.1);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let n = 20_000;
    let draws: Vec<Vec<f64>> = (0..n)
        .map(|_| {
            let draw: Vec<f64> = Distribution::<f64>::draw(&process, &mut rng);
            draw.iter().zip(HEIGHTS).map(|(x, mean)| x - mean).collect()
        })
        .collect();
    let n = n as f64;
    for i in 0..6 {
        let mean = draws.iter().map(|draw| draw[i]).sum::<f64>() / n;
        assert!(mean.abs() < 4.0 * (expected[(i, i)] / n).sqrt(), "mean {i}: {mean}");
        for j in 0..=i {
            let found = draws.iter().map(|draw| draw[i] * draw[j]).sum::<f64>() / n;
            let square = expected[(i, j)].powi(2) + expected[(i, i)] * expected[(j, j)];
            let error = found - expected[(i, j)];
            assert!(error.abs() < 4.0 * (square / n).sqrt(), "covariance ({i}, {j}): {error}");
        }
    }
}

#[test]
fn a_latent_process_is_an_unknown() {
    let model = rates(&POINTS, &[3, 0, 2, 5, 1]);
    let layout = model.layout().unwrap();
    let unknown: Vec<_> = layout.with_role(Role::Parameter).map(|v| v.name.as_str()).collect();
    assert_eq!((unknown, layout.dim), (vec!["lengths", "log_rate"], 7));
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let record = model.draw_prior(&mut rng).unwrap();
    assert_eq!(record.values("log_rate").unwrap().len(), 5);
}

/// A covariance function of the user.
#[derive(Clone, Copy, Debug)]
struct RationalQuadratic<A>(A);

impl<A: Parameter + std::fmt::Debug> Covariance for RationalQuadratic<A> {
    fn amplitude(&self) -> f64 {
        self.0.number()
    }
    fn lengths(&self) -> Vec<f64> {
        vec![0.9]
    }
    fn correlation(&self, square: f64) -> (f64, f64) {
        let base = (1.0 + 0.5 * square).recip();
        (base, base * base)
    }
}

impl<R: Scalar, A: Parameter + ppl::Datum<R> + std::fmt::Debug> CovarianceParameters<R>
    for RationalQuadratic<A>
{
    fn parameters(&self) -> Vec<R> {
        vec![self.0.lift(), R::from(0.9)]
    }
}

ppl::model! {
    fn with_own_covariance(x: &[f64], y: &[f64]) {
        let amplitude ~ HalfNormal(1.0);
        let zero = vec![0.0; x.len()];
        y ~ GaussianProcess(x, zero, RationalQuadratic(amplitude), 0.2);
    }
}

#[test]
fn covariance_functions_of_users_have_gradients() {
    ppl::check::gradient(&with_own_covariance(&TIMES, &HEIGHTS), 3);
}

#[test]
fn invalid_processes_are_refused() {
    let refused = |outcome: Result<(), ppl::DomainError>, words: &str| {
        let message = outcome.expect_err(words).to_string();
        assert!(message.contains(words), "{message}");
    };
    type Process<'a> =
        GaussianProcess<&'a [f64], &'a [f64], SquaredExponential<f64, PerColumn<&'a [f64]>>, f64>;
    let process = |x: &'static [f64], mean, amplitude, lengths, sd| -> Process<'static> {
        GaussianProcess(x, mean, SquaredExponential(amplitude, PerColumn(lengths)), sd)
    };
    let validate = |process: &Process<'_>| Distribution::<f64>::validate(process);
    for (invalid, words) in [
        (process(&[0.0, 1.0], &[0.0], 1.0, &[1.0], 0.1), "length of the mean must be equal to"),
        (process(&[0.0, f64::NAN], &[0.0; 2], 1.0, &[1.0], 0.1), "point 1, column 0"),
        (process(&[0.0, 1.0], &[0.0; 2], -1.0, &[1.0], 0.1), "amplitude must be positive"),
        (process(&[0.0, 1.0], &[0.0; 2], 1.0, &[0.0], 0.1), "length 0 must be positive"),
        (process(&[0.0, 1.0], &[0.0; 2], 1.0, &[1.0; 2], 0.1), "number of lengths must be 1"),
        (process(&[0.0, 1.0], &[0.0; 2], 1.0, &[1.0], 0.0), "noise must be positive"),
        (process(&[0.0, 1.0], &[0.0, f64::INFINITY], 1.0, &[1.0], 0.1), "mean[1] must be finite"),
    ] {
        refused(validate(&invalid), words);
    }
    let valid = process(&[0.0, 1.0], &[0.0; 2], 1.0, &[1.0], 0.1);
    validate(&valid).unwrap();
    refused(Distribution::<f64>::fits(&valid, &vec![0.0; 3]), "length of x must be equal to");
    for density in [
        process(&[0.0, 1.0], &[0.0; 2], -1.0, &[1.0], 0.1).ln_density(&vec![0.0; 2]),
        process(&[0.0, 1.0], &[0.0; 2], 1.0, &[1.0], -0.1).ln_density(&vec![0.0; 2]),
        // equal points without noise have a singular covariance matrix
        process(&[1.0, 1.0], &[0.0; 2], 1.0, &[1.0], 1e-20).ln_density(&vec![0.0; 2]),
    ] {
        let density: f64 = density;
        assert!(density.is_nan(), "{density}");
    }
    let predicted = |y: &[f64], x: &[f64], mean: &[f64]| valid.predict(y, x, mean).map(|_| ());
    refused(predicted(&[0.0], &[2.0], &[0.0]), "length of y must be equal to");
    refused(predicted(&[0.0; 2], &[2.0], &[0.0; 2]), "length of the other mean");
    let rows: &[[f64; 2]] = &[[2.0, 1.0]];
    refused(valid.predict(&[0.0; 2], rows, &[0.0]).map(|_| ()), "columns of other point 0");
}
